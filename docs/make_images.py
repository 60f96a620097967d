"""Make README's and payloads' pictures: ``python docs/make_images.py`` writes docs/images/."""

from importlib.resources import files
from pathlib import Path

import numpy as np
from PIL import Image

from defmanip_gym.baselines.analytic.tanner import TannerController
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.envs.rendering.renderer import TransportRenderer
from defmanip_gym.envs.rendering.view_params import ViewParams
from defmanip_gym.payloads.mjcf import MjcfPayload

FOLDER = Path(__file__).parent / "images"


def strip() -> Image.Image:
    """Return the robot on its way, braking hard with the beam near its limit, and at the goal."""
    engine = TransportEngine(TransportConfig(constraint_mode="cost"), num_envs=1)
    renderer = TransportRenderer(engine, ViewParams(width=480, height=420))
    frames = []
    engine.reset(options={"start": "paper"})
    for _ in range(24):
        engine.step(np.array([[0.9, 0.0, 0.0]]))
    frames.append(renderer.render("rgb_array"))
    engine.reset(options={"start": "paper"})
    controller, state = TannerController(), None
    observation, _ = engine.reset(options={"start": "paper"})
    for step in range(900):
        action, state = controller.predict(observation, state, np.array([step == 0]))
        result = engine.step(action)
        observation = result.observations
        if step == 250:
            frames.insert(0, renderer.render("rgb_array"))
        if result.terminated[0]:
            break
    frames.append(renderer.render("rgb_array"))
    renderer.close()
    return Image.fromarray(np.concatenate(frames, axis=1))


def payloads() -> Image.Image:
    """Return the objects of the examples, accelerated for 0.7 s."""
    frames = []
    for name in ("hose", "spherical", "bucket"):
        path = files("defmanip_gym.objects") / "examples" / f"{name}.xml"
        config = TransportConfig(
            constraint_mode="cost",
            inner_loop="measured_force",
            payload=MjcfPayload(path=str(path)),
        )
        engine = TransportEngine(config, num_envs=1)
        renderer = TransportRenderer(engine, ViewParams(width=480, height=420, camera_name="side"))
        engine.reset(options={"start": "paper"})
        for _ in range(35):
            engine.step(np.array([[0.9, 0.2, 0.0]]))
        frames.append(renderer.render("rgb_array"))
        renderer.close()
    return Image.fromarray(np.concatenate(frames, axis=1))


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    strip().save(FOLDER / "plant.png", optimize=True)
    payloads().save(FOLDER / "payloads.png", optimize=True)
