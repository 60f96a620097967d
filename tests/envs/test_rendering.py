"""Images show the plant; skipped only where no OpenGL can be had."""

import gymnasium
import numpy as np
import pytest

import defmanip_gym  # noqa: F401
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.envs.rendering.renderer import TransportRenderer
from defmanip_gym.envs.rendering.view_params import ViewParams
from defmanip_gym.params import BeamParams
from defmanip_gym.plant.names import OVERVIEW_CAMERA
from defmanip_gym.plant.scene import BEAM_COLOR, LIMIT_COLOR, swing_color

ENV_ID = "DeformTransport-v0"


pytestmark = pytest.mark.usefixtures("opengl")


def reddish(image):
    """Share of pixels that are clearly more red than green or blue."""
    red, green, blue = np.moveaxis(image.astype(int), -1, 0)
    return ((red > green + 60) & (red > blue + 60)).mean()


def test_rgb_image_shows_the_robot_in_front_of_the_floor():
    env = gymnasium.make(ENV_ID, render_mode="rgb_array")
    env.reset(options={"start": "paper"})
    image = env.render()
    assert image.shape == (480, 640, 3) and image.dtype == np.uint8
    assert image.std() > 10
    env.close()


def test_depth_image_is_nearer_where_the_robot_is():
    env = gymnasium.make(ENV_ID, render_mode="depth_array")
    env.reset(options={"start": "paper"})
    image = env.render()
    assert image.shape == (480, 640) and image.dtype == np.float32
    assert image.min() < image.max()
    env.close()


@pytest.mark.parametrize("segments", [1, 4])
def test_beam_turns_red_as_the_swing_nears_sigma(segments):
    env = gymnasium.make(
        ENV_ID,
        render_mode="rgb_array",
        constraint_mode="cost",
        beam=BeamParams(segment_count=segments),
    )
    env.reset(options={"start": "paper"})
    calm = reddish(env.render())
    for _ in range(30):
        *_, info = env.step(np.array([1.0, 0.0, 0.0]))
    assert info["constraint_margin"] < 0.1
    assert reddish(env.render()) > calm + 1e-3
    env.close()


def test_colour_follows_the_share_of_sigma():
    assert swing_color(0.0, 0.5) == pytest.approx(BEAM_COLOR)
    assert swing_color(0.5, 0.5) == pytest.approx(LIMIT_COLOR)
    assert swing_color(-2.0, 0.5) == pytest.approx(LIMIT_COLOR)


def test_batch_renders_each_episode():
    env = gymnasium.make_vec(ENV_ID, num_envs=2, render_mode="rgb_array")
    env.reset(options={"start": np.array([(-8, 5, 0, 1.0, -1.5, 0), (-2, 1, 1, 1.3, -1.2, 0)])})
    first, second = env.render()
    assert first.shape == second.shape == (480, 640, 3)
    assert not np.array_equal(first, second)
    env.close()


def test_overview_camera_sees_the_goal():
    engine = TransportEngine(TransportConfig(), num_envs=1)
    engine.reset(options={"start": "paper"})
    view = ViewParams(width=320, height=240, camera_name=OVERVIEW_CAMERA)
    renderer = TransportRenderer(engine, view)
    image = renderer.render("rgb_array").astype(int)
    assert (image[..., 0] > image[..., 2] + 60).sum() > 20  # the goal's orange
    renderer.close()


def test_rendering_does_not_disturb_the_episode():
    rows = []
    for mode in (None, "rgb_array"):
        env = gymnasium.make(ENV_ID, render_mode=mode)
        env.reset(seed=1)
        for _ in range(5):
            observation, *_ = env.step(np.array([0.3, 0.1, 0.0]))
            if mode:
                env.render()
        rows.append(observation)
        env.close()
    assert np.array_equal(*rows)
