"""Objects from model files: the same numbers as the theory's beams, and clear refusals."""

from dataclasses import fields
from importlib.resources import files

import numpy as np
import pytest

from defmanip_gym.errors import CertificateError, ObjectFileError
from defmanip_gym.objects.mjcf_object import mjcf_object, object_from_mjcf
from defmanip_gym.params import BeamParams
from defmanip_gym.plant.object_rig import ObjectRig
from defmanip_gym.theory.certificates import CertificateConditions, certify
from defmanip_gym.theory.payload.zero_dynamics import is_hurwitz, linearize

HOSE = files("defmanip_gym.objects") / "examples" / "hose.xml"
RODS = '<inertial pos="0 0 -0.2" mass="1" diaginertia="0.02 0.02 0.001"/>'
PENDULUM = f"""
<body name="grip" pos="1 2 3">
  <freejoint/>
  <site name="grasp"/> <site name="other" pos="0 0 -0.1"/>
  <geom type="sphere" size="0.05" mass="0.5"/>
  <body name="rod">
    <joint name="swing" axis="0 -1 0" stiffness="1" damping="0.1"/>
    {RODS}
    <site name="tip" pos="0 0 -0.4"/>
  </body>
</body>
"""


@pytest.fixture
def write(tmp_path):
    def write(body=PENDULUM, *, extra="", option=""):
        path = tmp_path / "object.xml"
        path.write_text(
            f"<mujoco><compiler angle='radian'/>{option}"
            f"<worldbody><light pos='0 0 3'/>{body}</worldbody>{extra}</mujoco>"
        )
        return path

    return write


def beam_as_mjcf(beam):
    """Return a beam as a user would write it: hinges relative to one another."""
    length, mass = beam.segment_length_m, beam.segment_mass_kg
    across, along = mass * length**2 / 12, mass * beam.radius_m**2 / 2
    text = ""
    for index in reversed(range(beam.segment_count)):
        stiffness = beam.joint_stiffness if index else beam.root_stiffness
        damping = beam.joint_damping if index else beam.damping
        text = (
            f'<body pos="0 0 {-length if index else 0}">'
            f'<joint name="bend_{index}" axis="0 -1 0" stiffness="{stiffness}"'
            f' damping="{damping}"/>'
            f'<inertial pos="0 0 {-length / 2}" mass="{mass}"'
            f' diaginertia="{across} {across} {along}"/>{text}</body>'
        )
    return f'<body><site name="grasp"/>{text}</body>'


@pytest.mark.parametrize("segments", [1, 3])
def test_a_beam_from_a_file_is_the_theorys_beam(write, segments):
    beam = BeamParams(segment_count=segments, root_stiffness=1.5, joint_stiffness=3.0)
    found = object_from_mjcf(write(beam_as_mjcf(beam)), grasp_site="grasp")
    expected = linearize(beam)
    relative = np.tril(np.ones((segments, segments)))  # absolute angles are sums of joint angles
    for field in fields(expected):
        if field.name in ("coordinates", "equilibrium", "is_excited_by_yaw"):
            continue
        value = getattr(expected, field.name)
        if field.name == "m_o12":
            value = value @ relative
        elif field.name != "m_o11":
            value = relative.T @ value @ relative
        np.testing.assert_allclose(getattr(found, field.name), value, atol=1e-6, err_msg=field.name)
    np.testing.assert_allclose(found.equilibrium, 0, atol=1e-9)
    assert not found.is_excited_by_yaw
    assert found.coordinates == tuple(f"bend_{index}" for index in range(segments))


BENT = """
<body name="grip"><site name="grasp"/>
  <geom type="sphere" size="0.05" mass="0.5"/>
  <body name="upper">
    <joint name="upper" axis="0 -1 0" stiffness="4" damping="0.1"/>
    <inertial pos="0.05 0 -0.2" mass="1" diaginertia="0.02 0.02 0.001"/>
    <body name="lower" pos="0 0 -0.4">
      <joint name="lower" axis="0 -1 0" stiffness="2" damping="0.1" armature="0.01"/>
      <inertial pos="0.04 0 -0.2" mass="0.7" diaginertia="0.02 0.02 0.001"/>
    </body>
  </body>
</body>
"""


def test_an_object_with_its_mass_off_the_axis_hangs_bent(write):
    thing = mjcf_object(write(BENT), grasp_site="grasp")
    linear = thing.linear
    assert np.abs(linear.equilibrium).max() > 0.03
    rig = ObjectRig(thing.rig(), count=1, num_threads=1)
    assert np.abs(rig.accelerations(np.zeros((1, 4)))).max() < 1e-6
    rig.play(np.zeros((1, 2000, 4)))
    np.testing.assert_allclose(rig.z2[0], linear.equilibrium, atol=1e-6)


def test_every_matrix_is_the_derivative_of_the_rigs_acceleration(write):
    thing = mjcf_object(write(BENT), grasp_site="grasp")
    linear, rest = thing.linear, thing.linear.equilibrium
    rig = ObjectRig(thing.rig(), count=1, num_threads=1)

    def torque(offset=(0.0, 0.0), rate=(0.0, 0.0), inputs=(0.0, 0.0, 0.0, 0.0)):
        rig.place((rest + offset)[None], np.array(rate)[None])
        return linear.m_o22 @ rig.accelerations(np.array(inputs)[None])[0]

    def slope(function):
        step = 1e-4
        return np.stack(
            [(function(e) - function(-e)) / (2 * step) for e in step * np.eye(2)], axis=1
        )

    np.testing.assert_allclose(
        slope(lambda e: torque(e)), -linear.k_o22 - linear.gravity_stiffness, atol=1e-5
    )
    np.testing.assert_allclose(slope(lambda e: torque(rate=e)), -linear.d_o22, atol=1e-5)
    for axis in range(3):
        inputs = np.eye(4)[axis]
        np.testing.assert_allclose(torque(inputs=inputs), -linear.m_o12[axis], atol=1e-5)
    np.testing.assert_allclose(np.diag(linear.k_o22), [4, 2], atol=1e-6)


def test_turning_is_known_to_push_a_bent_object_but_not_a_straight_one(write):
    assert object_from_mjcf(write(BENT), grasp_site="grasp").is_excited_by_yaw
    assert not object_from_mjcf(write(), grasp_site="grasp").is_excited_by_yaw
    crosswise = PENDULUM.replace(
        "</body>\n</body>",
        f"""<body pos="0 0 -0.4">
      <joint axis="1 0 0" stiffness="1" damping="0.1"/>{RODS}</body></body></body>""",
    )
    assert object_from_mjcf(write(crosswise), grasp_site="grasp").is_excited_by_yaw


def test_tendons_densities_slides_and_includes_count(write, tmp_path):
    (tmp_path / "rod.xml").write_text(
        '<mujocoinclude><body name="rod"><joint name="swing" axis="0 -1 0" damping="0.1"/>'
        '<joint name="stretch" type="slide" axis="0 0 -1" stiffness="500" damping="1"/>'
        '<geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.02" density="900"/></body>'
        "</mujocoinclude>"
    )
    body = (
        '<body name="grip"><site name="grasp"/><geom size="0.05" mass="0.5"/>'
        '<include file="rod.xml"/></body>'
    )
    tendon = (
        '<tendon><fixed stiffness="2" damping="0.3">'
        '<joint joint="swing" coef="2"/></fixed></tendon>'
    )
    linear = object_from_mjcf(write(body, extra=tendon), grasp_site="grasp")
    capsule = 900 * np.pi * 0.02**2 * (0.4 + 4 / 3 * 0.02)
    assert linear.m_o11[0, 0] == pytest.approx(0.5 + capsule)
    assert linear.k_o22[0, 0] == pytest.approx(8.0, abs=1e-6)
    assert linear.d_o22[0, 0] == pytest.approx(0.1 + 1.2, abs=1e-6)
    assert linear.equilibrium[1] == pytest.approx(capsule * 9.81 / 500, rel=1e-6)
    assert linear.coordinates == ("swing", "stretch")


def test_the_free_joint_goes_and_a_hinge_at_the_root_stays(write):
    hinged = (
        '<body name="rod"><joint name="swing" axis="0 -1 0" damping="0.1"/>'
        f'<site name="grasp"/>{RODS}</body>'
    )
    one = object_from_mjcf(write(hinged), grasp_site="grasp")
    assert one.coordinates == ("swing",) and one.m_o11[0, 0] == pytest.approx(1.0)
    assert object_from_mjcf(write(), grasp_site="grasp").coordinates == ("swing",)


def test_the_example_can_be_certified():
    linear = object_from_mjcf(str(HOSE), grasp_site="grasp")
    assert linear.count == 4 and is_hurwitz(linear.A_u)
    assert certify(linear).acceleration_bound > 0.3


def swapped(old, new):
    assert old in PENDULUM
    return {"body": PENDULUM.replace(old, new)}


SWING = '<joint name="swing" axis="0 -1 0" stiffness="1" damping="0.1"/>'
REFUSALS = {
    "no internal coordinates": (swapped(SWING, ""), "does not deform"),
    "ball joint": (swapped(SWING, '<joint type="ball" name="elbow"/>'), "elbow"),
    "friction loss": (swapped('damping="0.1"', 'frictionloss="0.1"'), "friction loss"),
    "nonlinear damping": (swapped('damping="0.1"', 'damping="0.1 0.2"'), "nonlinear"),
    "nonlinear spring": (swapped('stiffness="1"', 'stiffness="1 0.2"'), "nonlinear"),
    "narrow limits": (swapped('damping="0.1"', 'damping="0.1" range="-0.3 0.3"'), "swing"),
    "limits with a margin": (
        swapped('damping="0.1"', 'damping="0.1" range="-1.2 1.2" margin="0.5"'),
        "swing",
    ),
    "upside down": (swapped('pos="0 0 -0.2" mass="1"', 'pos="0 0 0.8" mass="1"'), "stable"),
    "second root": ({"body": PENDULUM + '<body><geom size="0.1"/></body>'}, "one body"),
    "other gravity": ({"option": "<option gravity='0 0 -1'/>"}, "gravity"),
    "fluid": ({"option": "<option density='1.2'/>"}, "fluid"),
    "equality": (
        {"extra": "<equality><joint joint1='swing'/></equality>"},
        "equality",
    ),
    "actuator": ({"extra": "<actuator><motor joint='swing'/></actuator>"}, "actuators"),
    "not MuJoCo's": (swapped('axis="0 -1 0"', 'axles="0 -1 0"'), "axles"),
    "moving site": (
        {
            "body": '<body name="rod"><joint name="swing" axis="0 -1 0" damping="0.1"/>'
            f'<site name="grasp" pos="0 0 -0.1"/>{RODS}</body>'
        },
        "'swing' moves it",
    ),
    "twist without spring": (
        swapped(SWING, '<joint name="twist" axis="0 0 1" damping="0.1"/>'),
        "stable",
    ),
    "point mass": (
        {
            "body": '<body name="bob"><joint axis="0 -1 0" damping="0.1"/><site name="grasp"/>'
            '<inertial pos="0 0 -0.5" mass="1" diaginertia="1e-9 1e-9 1e-9"/></body>'
        },
        "Point masses",
    ),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_what_is_no_smooth_object_is_refused_by_name(write, name):
    changes, words = REFUSALS[name]
    with pytest.raises(ObjectFileError, match=words):
        object_from_mjcf(write(**changes), grasp_site="grasp")


def test_missing_files_and_sites_are_told(write, tmp_path):
    with pytest.raises(ObjectFileError, match=r"missing\.xml"):
        object_from_mjcf(tmp_path / "missing.xml", grasp_site="grasp")
    with pytest.raises(ObjectFileError, match="'grasp', 'other', 'tip'"):
        object_from_mjcf(write(), grasp_site="handle")
    with pytest.raises(ObjectFileError, match="root body 'grip'"):
        object_from_mjcf(write(), grasp_site="tip")
    broken = tmp_path / "broken.xml"
    broken.write_text("<mujoco><worldbody>")
    with pytest.raises(ObjectFileError, match="MuJoCo says"):
        object_from_mjcf(broken, grasp_site="grasp")


def test_the_grasp_may_lie_off_the_bodys_origin(write):
    aside = PENDULUM.replace('<site name="grasp"/>', '<site name="grasp" pos="0.1 0 0"/>')
    linear = object_from_mjcf(write(aside), grasp_site="grasp")
    # held beside its axle the object feels turning, but not otherwise
    assert linear.is_excited_by_yaw
    straight = object_from_mjcf(write(), grasp_site="grasp")
    np.testing.assert_allclose(linear.m_o12, straight.m_o12, atol=1e-9)


def test_the_push_of_an_acceleration_changes_with_the_deformation_of_a_bent_object(write):
    straight = mjcf_object(write(), grasp_site="grasp")
    np.testing.assert_allclose(straight.linear.horizontal_stiffness, 0, atol=1e-8)
    aside = PENDULUM.replace('pos="0 0 -0.2"', 'pos="0.15 0 -0.2"')
    bent = mjcf_object(write(aside), grasp_site="grasp")
    # a mass m at (x, z) from its hinge, turned by φ: m_o12 = −m z', m_o12' = −m x'
    (angle,) = bent.linear.equilibrium
    x = 0.15 * np.cos(angle) + 0.2 * np.sin(angle)
    z = 0.15 * np.sin(angle) - 0.2 * np.cos(angle)
    np.testing.assert_allclose(bent.linear.m_o12[:, 0], [-z, 0, x], atol=1e-9)
    np.testing.assert_allclose(bent.linear.horizontal_stiffness[:, 0, 0], [-x, 0], atol=1e-8)
    np.testing.assert_allclose(bent.linear.vertical_stiffness, -z, atol=1e-8)


def test_yaw_acceleration_that_only_acts_beside_the_equilibrium_counts_too(write):
    # two balls off the plane of the swing: its product of inertia grows with the swing
    plate = """<body name="grip"><site name="grasp"/><geom size="0.05" mass="0.5"/><body>
        <joint name="swing" axis="0 -1 0" damping="0.02"/>
        <geom type="sphere" size="0.02" mass="0.5" pos=".15 .6 -.15"/>
        <geom type="sphere" size="0.02" mass="0.5" pos="-.15 -.6 -.15"/></body></body>"""
    linear = object_from_mjcf(write(plate), grasp_site="grasp")
    assert linear.is_excited_by_yaw
    with pytest.raises(CertificateError, match="yaw_rate"):
        certify(linear, conditions=CertificateConditions(yaw_rate_rad_s=0.3))


def test_an_object_that_horizontal_acceleration_leaves_alone_is_refused(write):
    spring = """<body name="grip"><site name="grasp"/><geom size="0.05" mass="0.5"/><body>
        <joint name="bounce" type="slide" axis="0 0 1" stiffness="500" damping="5"/>
        <geom size="0.05" mass="0.5"/></body></body>"""
    with pytest.raises(CertificateError, match="horizontal"):
        certify(object_from_mjcf(write(spring), grasp_site="grasp"))
