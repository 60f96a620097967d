"""Factories shared by the tests of theory, plant and their agreement."""

import gymnasium
import numpy as np
import pytest
from hypothesis import settings

import defmanip_gym  # noqa: F401
from defmanip_gym.envs.rendering.graphics import GRAPHICS
from defmanip_gym.envs.rendering.opengl import open_context
from defmanip_gym.errors import RenderingError
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.plant.rod_body import RodBody
from defmanip_gym.plant.simulation import Simulation

settings.register_profile("repeatable", deadline=None, max_examples=40, derandomize=True)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def opengl():
    """Skip tests that draw where no OpenGL can be had."""
    try:
        GRAPHICS.run(lambda: open_context().free())
    except RenderingError as error:
        pytest.skip(str(error))


@pytest.fixture
def make_plant():
    """Return a factory of plants at rest; ``swing`` is given to every segment."""

    def make(
        beam=None,
        *,
        count=1,
        physics_period_s=0.005,
        num_threads=1,
        joints=(np.pi / 2, -np.pi / 2),
        swing=0.0,
        robot=None,
    ):
        beam = beam or BeamParams()
        simulation = Simulation(
            robot or RobotParams(),
            RodBody(beam),
            count=count,
            goal_position_m=(0.0, 0.0, 1.0),
            physics_period_s=physics_period_s,
            num_threads=num_threads,
        )
        simulation.place(
            np.arange(count),
            np.zeros((count, 3)),
            np.tile(joints, (count, 1)),
            np.full((count, beam.segment_count), swing),
        )
        return simulation

    return make


@pytest.fixture
def make_batch():
    """Return a factory of batched environments that neither end nor reset by themselves."""

    def make(num_envs=1, env_id="DeformTransport-v0", **kwargs):
        return gymnasium.make_vec(
            f"defmanip_gym:{env_id}",
            num_envs=num_envs,
            vectorization_mode="vector_entry_point",
            **{
                "autoreset_mode": "Disabled",
                "constraint_mode": "cost",
                "num_threads": 1,
                "max_episode_steps": 10**6,
                **kwargs,
            },
        )

    return make
