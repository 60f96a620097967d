"""What the plant looks like: floor, light, cameras, goal marker, colours."""

from __future__ import annotations

import mujoco
import numpy as np

from defmanip_gym.plant import names

ROBOT_COLOR = [0.22, 0.35, 0.48, 1.0]
WHEEL_COLOR = [0.13, 0.14, 0.16, 1.0]
BEAM_COLOR = [0.20, 0.65, 0.45, 1.0]
LIMIT_COLOR = [0.88, 0.15, 0.12, 1.0]
SMALLEST_DRAWN_RADIUS_M = 0.03  # thinner beams are hard to see
GOAL_COLOR = [0.95, 0.65, 0.10, 0.55]


def dress(spec: mujoco.MjSpec, goal_position_m: tuple[float, float, float]) -> None:
    """Add everything to the scene that has no part in the dynamics."""
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1920, 1080
    spec.visual.headlight.ambient = [0.45, 0.45, 0.45]
    spec.visual.headlight.diffuse = [0.35, 0.35, 0.35]
    spec.visual.headlight.specular = [0.1, 0.1, 0.1]
    spec.visual.map.shadowclip = 4.0
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.78, 0.86, 0.94],
        rgb2=[0.96, 0.97, 0.99],
        width=256,
        height=256,
    )
    spec.add_texture(
        name="tiles",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=[0.80, 0.82, 0.83],
        rgb2=[0.74, 0.76, 0.78],
        markrgb=[0.62, 0.64, 0.66],
        width=512,
        height=512,
    )
    floor = spec.add_material(name="floor", texrepeat=[0.5, 0.5], texuniform=True, reflectance=0.08)
    floor.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    world = spec.worldbody
    world.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[30, 30, 0.1], material="floor"
    )
    world.add_light(
        name="sun",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=[0, 0, 8],
        dir=[0.4, 0.3, -1.0],
        diffuse=[0.5, 0.5, 0.5],
        castshadow=True,
    )
    _add_goal(world, goal_position_m)
    _add_cameras(world)


def add_base_cameras(base: mujoco.MjsBody) -> None:
    """Add the cameras that follow the robot, and the one that turns with it."""
    following = mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM
    from_behind, from_above = [1, 0, 0, 0, 0.24, 0.97], [1, 0, 0, 0, 1, 0]
    track = base.add_camera(
        name=names.TRACKING_CAMERA, pos=[0.45, -2.5, 1.35], xyaxes=from_behind, fovy=42
    )
    top = base.add_camera(name=names.TOP_CAMERA, pos=[0, 0, 5.0], xyaxes=from_above, fovy=42)
    track.mode = top.mode = following
    # the plane in which arm and beam swing is the image's
    base.add_camera(
        name=names.SIDE_CAMERA, pos=[0.5, -2.6, 0.6], xyaxes=[1, 0, 0, 0, 0, 1], fovy=42
    )


def add_grasp_camera(forearm: mujoco.MjsBody, length_m: float) -> None:
    """Add the camera on the forearm that looks past its end onto the beam."""
    forearm.add_camera(
        name=names.GRASP_CAMERA,
        pos=[length_m - 0.3, -0.5, 0.1],
        xyaxes=[0.5, -0.35, 0, 0.14, 0.2, 0.37],
        fovy=60,
    )


def swing_color(largest_swing_rad: float, sigma_rad: float) -> np.ndarray:
    """Return the beam's RGBA: its own colour at rest, red at and beyond |z2| = σ."""
    share = min(1.0, abs(largest_swing_rad) / sigma_rad) ** 2
    return (1.0 - share) * np.array(BEAM_COLOR) + share * np.array(LIMIT_COLOR)


def _add_goal(world: mujoco.MjsBody, position: tuple[float, float, float]) -> None:
    x, y, z = position
    sphere, cylinder = mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CYLINDER
    world.add_site(name=names.GOAL_SITE, pos=[x, y, z], size=[0.05], type=sphere, rgba=GOAL_COLOR)
    world.add_site(
        name="goal_mast",
        pos=[x, y, z / 2],
        size=[0.008, z / 2, 0],
        type=cylinder,
        rgba=GOAL_COLOR,
    )
    world.add_site(
        name="goal_disc", pos=[x, y, 0.005], size=[0.25, 0.004, 0], type=cylinder, rgba=GOAL_COLOR
    )


def _add_cameras(world: mujoco.MjsBody) -> None:
    # over the middle of the way from the paper's start to the goal
    world.add_camera(
        name=names.OVERVIEW_CAMERA, pos=[-4.0, -5.0, 7.5], xyaxes=[1, 0, 0, 0, 0.75, 0.66], fovy=52
    )
