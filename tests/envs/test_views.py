"""Size and camera of images are what an environment or a call asks for."""

import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import AddRenderObservation

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.envs.rendering.renderer import TransportRenderer
from defmanip_gym.envs.rendering.view_params import FreeCameraParams, ViewParams
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams

ENV_ID = "DeformTransport-v0"
CAMERAS = ("track", "top", "side", "grasp", "overview")
SMALL = {"width": 48, "height": 36}

draws = pytest.mark.usefixtures("opengl")


def make(**arguments):
    return gymnasium.make(ENV_ID, **{"render_mode": "rgb_array", **SMALL, **arguments})


def picture(env, start="paper"):
    env.reset(seed=0, options={"start": start})
    image = env.render()
    env.close()
    return image


@draws
@pytest.mark.parametrize("mode", ["rgb_array", "depth_array"])
def test_images_have_the_size_that_was_asked_for(mode):
    image = picture(make(width=33, height=np.int64(21), render_mode=mode))
    assert image.shape[:2] == (21, 33)
    images = gymnasium.make_vec(ENV_ID, num_envs=3, render_mode=mode, width=33, height=21)
    images.reset(seed=0)
    assert np.shape(images.render())[:3] == (3, 21, 33)
    images.close()


@draws
def test_named_cameras_show_different_images_with_the_beam_in_all_but_the_overview():
    env = make(width=240, height=180).unwrapped
    env.reset(options={"start": "paper"})
    images = [env.render_camera(name) for name in CAMERAS]
    for i, image in enumerate(images):
        assert not any(np.array_equal(image, other) for other in images[:i])
    for name, image in zip(CAMERAS, images, strict=True):
        red, green, blue = np.moveaxis(image.astype(int), -1, 0)
        beam = ((green > red + 20) & (green > blue + 5)).sum()
        # from above the forearm hides it
        assert beam > 20 or name in ("top", "overview"), name
    env.close()


@draws
@pytest.mark.parametrize("name", ["track", "side", "top"])
def test_cameras_follow_the_robot(name):
    env = make(camera_name=name)
    near, far = (picture(env, (x, 3.0, 0.0, 1.0, -1.5, 0.0)) for x in (-8.0, -4.0))
    robot = (near[..., 2].astype(int) > near[..., 0] + 40).mean()
    # the floor's tiles move by, the robot stays
    assert robot > 0.005
    assert robot == pytest.approx((far[..., 2].astype(int) > far[..., 0] + 40).mean(), rel=0.2)


@draws
def test_cameras_go_by_name_or_by_number():
    env = make().unwrapped
    model = env.engine.simulation.model
    for i in range(model.ncam):
        by_number, by_name = make(camera_id=i), make(camera_name=model.camera(i).name)
        np.testing.assert_array_equal(picture(by_number), picture(by_name))
    assert {model.camera(i).name for i in range(model.ncam)} == set(CAMERAS)
    np.testing.assert_array_equal(picture(make()), picture(make(camera_name="track")))


@draws
def test_the_free_camera_stands_where_its_configuration_says():
    config = {"azimuth": 90, "elevation": -20.0, "distance": 3.0}
    far = picture(make(default_camera_config=config | {"distance": 9.0}))
    near = picture(make(default_camera_config=config))
    assert not np.array_equal(near, far)
    same = [
        make(default_camera_config=FreeCameraParams(**config)),
        make(default_camera_config=config, camera_id=-1),
        make(default_camera_config=config | {"trackbodyid": 1}),
    ]
    for env in same:
        np.testing.assert_array_equal(picture(env), near)
    away = make(default_camera_config=config | {"lookat": np.array([50.0, 0.0, 1.0])})
    assert not np.array_equal(picture(away), near)


@draws
def test_the_free_camera_follows_the_robot_from_the_first_image_on():
    config = {"distance": 3.0}
    env, start = make(default_camera_config=config), (-4.0, 3.0, 0.0, 1.0, -1.5, 0.0)
    picture(env)
    np.testing.assert_array_equal(
        picture(env, start), picture(make(default_camera_config=config), start)
    )


@draws
def test_several_cameras_of_one_environment_are_each_a_lone_ones():
    env = make(render_mode=None).unwrapped
    env.reset(seed=0, options={"start": "paper"})
    for name in CAMERAS:
        image = env.render_camera(name)
        np.testing.assert_array_equal(image, picture(make(camera_name=name)))
        # smaller, and larger than what the environment draws by itself: the same, finer or coarser
        small = env.render_camera(name, width=24, height=18)
        large = env.render_camera(name, width=96, height=72)
        assert small.shape == (18, 24, 3) and large.shape == (72, 96, 3)
        for fine, coarse in ((image, small), (large, image)):
            height, width = coarse.shape[:2]
            averaged = fine.reshape(height, 2, width, 2, 3).mean(axis=(1, 3))
            assert np.abs(averaged - coarse).mean() < 5, name
    assert env.render_camera("side", mode="depth_array").dtype == np.float32
    env.close()


@draws
def test_a_batch_shows_what_single_environments_show():
    starts = np.array(
        [(-8, 5, 0, 1.0, -1.5, 0.1), (-2, 1, 1, 1.3, -1.2, 0), (-5, 2, 0, 1, -1.5, 0)]
    )
    beam = BeamParams(segment_count=2)
    arguments = {**SMALL, "beam": beam, "camera_name": "side", "render_mode": "rgb_array"}
    envs = gymnasium.make_vec(ENV_ID, num_envs=3, **arguments)
    envs.reset(options={"start": starts})
    batches = envs.render(), envs.render_camera("grasp"), envs.render_camera("top", width=20)
    for i, start in enumerate(starts):
        env = gymnasium.make(ENV_ID, **arguments).unwrapped
        env.reset(options={"start": start})
        images = env.render(), env.render_camera("grasp"), env.render_camera("top", width=20)
        for image, of_batch in zip(images, batches, strict=True):
            np.testing.assert_array_equal(of_batch[i], image)
        env.close()
    envs.close()


REFUSED = [
    ("width", {"width": 0}),
    ("width", {"width": 10**6}),
    ("height", {"height": 10.5}),
    ("height", {"height": None}),
    ("camera_name", {"camera_name": "behind"}),
    ("camera_name", {"camera_name": "side", "camera_id": 0}),
    ("camera_id", {"camera_id": 17}),
    ("camera_id", {"camera_id": -2}),
    ("camera_id", {"camera_id": True}),
    ("camera_id", {"camera_name": 2.5}),
    ("default_camera_config", {"default_camera_config": {"zoom": 2.0}}),
    ("default_camera_config", {"default_camera_config": 3.0}),
    ("default_camera_config", {"default_camera_config": {}, "camera_name": "side"}),
    ("distance", {"default_camera_config": {"distance": -1.0}}),
    ("elevation", {"default_camera_config": {"elevation": np.nan}}),
    ("lookat", {"default_camera_config": {"lookat": [1.0, 2.0]}}),
    ("trackbodyid", {"default_camera_config": {"trackbodyid": 99}}),
    ("trackbodyid", {"default_camera_config": {"trackbodyid": 1.5}}),
    ("trackbodyid", {"default_camera_config": {"trackbodyid": np.zeros(2)}}),
    ("trackbodyid", {"default_camera_config": {"trackbodyid": 1, "lookat": [0, 0, 0]}}),
]


@pytest.mark.parametrize(("name", "arguments"), REFUSED)
def test_views_that_are_none_are_refused_by_name(name, arguments):
    for construct in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(ParameterError) as caught:
            construct(ENV_ID, **arguments)
        assert caught.value.name == name


def test_an_unknown_camera_is_told_the_known_ones():
    env = make().unwrapped
    env.reset(seed=0)
    for refused in (lambda: make(camera_name="behind"), lambda: env.render_camera("behind")):
        with pytest.raises(ParameterError, match="'track', .*'grasp'"):
            refused()
    with pytest.raises(ParameterError, match="mode"):
        env.render_camera("side", mode="human")
    with pytest.raises(ParameterError, match="width"):
        env.render_camera("side", width=-1)


VIEWS = [
    {"width": 33, "height": 21, "camera_name": "side"},
    {"camera_id": 2},
    {"default_camera_config": {"distance": 4.0, "lookat": [0.0, 0.0, 1.0]}},
    {"default_camera_config": FreeCameraParams(azimuth=np.float64(20.0))},
]


@draws
@pytest.mark.parametrize("view", VIEWS, ids=lambda view: "-".join(view))
def test_views_travel_with_pickles_and_specifications(view):
    env = make(**view)
    image = picture(env)
    np.testing.assert_array_equal(picture(pickle.loads(pickle.dumps(env))), image)
    spec = EnvSpec.from_json(env.spec.to_json())
    np.testing.assert_array_equal(picture(gymnasium.make(spec)), image)
    envs = gymnasium.make_vec(ENV_ID, num_envs=1, render_mode="rgb_array", **{**SMALL, **view})
    again = gymnasium.make_vec(EnvSpec.from_json(envs.spec.to_json()))
    np.testing.assert_array_equal(picture(again), picture(envs))
    assert np.array_equal(picture(again)[0], image)


@draws
def test_pixels_are_observations_through_gymnasiums_wrapper():
    env = AddRenderObservation(make(width=84, height=84))
    assert env.observation_space == gymnasium.spaces.Box(0, 255, (84, 84, 3), np.uint8)
    seen = [env.reset(seed=0, options={"start": "paper"})[0]]
    seen += [env.step(np.array([1.0, 0.0, 0.0]))[0] for _ in range(20)]
    assert all(pixels in env.observation_space for pixels in seen)
    np.testing.assert_array_equal(seen[-1], env.unwrapped.render())
    assert not np.array_equal(seen[0], seen[-1])
    env.close()


@draws
def test_gymnasiums_checker_accepts_an_environment_that_draws():
    check_env(make().unwrapped, skip_render_check=True)
    check_env(make(render_mode="depth_array").unwrapped, skip_render_check=True)


def test_rendering_without_a_mode_warns(caplog):
    env, envs = gymnasium.make(ENV_ID), gymnasium.make_vec(ENV_ID, num_envs=2)
    for each in (env.unwrapped, envs):
        each.reset(seed=0)
        with pytest.warns(UserWarning, match="render_mode"):
            assert each.render() is None


def test_a_renderer_that_never_drew_can_be_closed():
    renderer = TransportRenderer(TransportEngine(TransportConfig(), num_envs=1), ViewParams())
    renderer.close()
    renderer.close()
