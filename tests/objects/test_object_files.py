"""What a model file asks of MuJoCo's compiler arrives on the rig, or is refused in words."""

import copy
import re
import warnings

import mujoco
import numpy as np
import pytest

from defmanip_gym.errors import ObjectFileError
from defmanip_gym.objects.mjcf_object import mjcf_object
from defmanip_gym.plant import object_file
from defmanip_gym.plant.object_copy import add_object
from defmanip_gym.plant.object_rig import ObjectRig

FREE = "<freejoint/>"
GRIP = f"{FREE}<site name='grasp'/><geom name='fist' size='.03' mass='.5'/>"
ROD = "<inertial pos='.01 0 -.2' mass='1' diaginertia='.02 .03 .01'/>"


def grip(inside, *, at=""):
    return f"<worldbody><body name='grip' {at}>{GRIP}{inside}</body></worldbody>"


def rod(joint="damping='.1'", *, inside="", body="name='rod'"):
    return f"<body {body}><joint name='swing' axis='0 -1 0' {joint}/>{ROD}{inside}</body>"


ARM = rod(
    "stiffness='1' damping='.1'",
    inside=f"<site name='upper' pos='.05 0 -.1'/><geom name='pulley' size='.04' pos='0 0 -.4'"
    " mass='.1'/><site name='side' pos='.1 0 -.4'/>"
    "<body pos='0 0 -.4'><joint name='bend' axis='0 -1 0' stiffness='2' damping='.2'/>"
    f"{ROD}<site name='lower' pos='.06 0 -.2'/></body>",
)
FILES = {
    "total mass": "<compiler settotalmass='5'/>" + grip(rod("stiffness='1' damping='.1'")),
    "damping ratio": grip(rod("springdamper='.3 .2'")),
    "fused bodies": "<compiler fusestatic='true'/>"
    + grip(rod(inside="<body pos='0 0 -.3'><geom size='.05' mass='.7'/></body>")),
    "degrees": "<compiler angle='degree' eulerseq='zyx'/>"
    + grip(rod("ref='5' springref='-8' stiffness='3'"), at="euler='20 0 0' pos='1 2 3'"),
    "radians": "<compiler angle='radian'/>" + grip(rod("ref='.1' springref='-.2' stiffness='3'")),
    "classes": "<default><joint damping='.3'/><default class='soft'><joint stiffness='7'"
    " armature='.02'/><geom density='300'/></default></default>"
    + grip(
        "<body childclass='soft'><joint axis='0 -1 0'/>"
        "<geom type='capsule' size='.02' fromto='0 0 0 .02 0 -.4'/></body>"
    ),
    "inertia from geoms": "<compiler inertiafromgeom='true' inertiagrouprange='1 2'/>"
    + grip(
        "<geom group='1' size='.02'/>"
        + rod(inside="<geom group='2' size='.05' pos='0 0 -.3' mass='2'/><geom size='.2'/>")
    ),
    "bounds": "<compiler boundmass='.8' boundinertia='.05'/>" + grip(ARM),
    "balanced inertia": "<compiler balanceinertia='true'/>"
    + grip(rod().replace("'.02 .03 .01'", "'.02 .5 .01'")),
    "whole inertia": grip(
        rod().replace("diaginertia='.02 .03 .01'", "fullinertia='.02 .03 .02 .001 .002 -.001'")
    ),
    "rotors": grip(rod("armature='.3' stiffness='1' damping='.1'")),
    "fixed tendon": grip(ARM) + "<tendon><fixed stiffness='3' damping='.4' armature='.1'>"
    "<joint joint='swing' coef='2'/><joint joint='bend' coef='-1'/></fixed></tendon>",
    "spatial tendon": grip("<site name='anchor' pos='.1 0 0'/>" + ARM)
    + "<tendon><spatial stiffness='30' damping='4' springlength='.3'><site site='anchor'/>"
    "<site site='upper'/><geom geom='pulley' sidesite='side'/><site site='lower'/>"
    "<pulley divisor='2'/><site site='anchor'/><site site='lower'/></spatial></tendon>",
    "tendon at rest": grip("<site name='anchor' pos='.1 0 0'/>" + ARM)
    + "<tendon><spatial stiffness='90'><site site='anchor'/><site site='lower'/></spatial>"
    "</tendon>",
    "frames": grip(
        f"<frame pos='.02 0 0' axisangle='0 0 1 30'><frame pos='0 0 -.1'>{ROD}"
        f"{rod()}</frame></frame>".replace(ROD, "", 1)
    ),
    "scaled frame": grip(f"<frame scale='.5 .5 .5'>{ARM}</frame>"),
    "replicas": grip(
        "<replicate count='3' offset='.05 0 0'><body><joint axis='0 -1 0' damping='.1'/>"
        "<geom size='.02' mass='.2' pos='0 0 -.2'/></body></replicate>"
    ),
    "weight borne elsewhere": grip(rod("damping='.1'", body="gravcomp='.4'")),
    "mesh": "<asset><mesh name='wedge' inertia='exact' vertex='0 0 0 .1 0 0 0 .1 0 0 0 -.4'/>"
    "</asset>"
    + grip("<body><joint axis='0 -1 0' damping='.1'/><geom type='mesh' mesh='wedge'/></body>"),
    "shells": grip(
        "<body><joint axis='0 -1 0' damping='.1'/><geom type='ellipsoid' size='.02 .03 .2'"
        " pos='0 0 -.2' shellinertia='true' density='50'/></body>"
    ),
    "aligned free joint": grip(ARM).replace(FREE, "<freejoint align='true'/>"),
    "slide": grip(
        "<body><joint type='slide' axis='.6 0 -.8' ref='.02' stiffness='400' damping='1'/>"
        "<geom size='.05' mass='.7' pos='.1 0 0'/></body>"
    ),
}


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "object.xml"
        path.write_text(f"<mujoco>{text}</mujoco>")
        return path

    return write


def held_alone(text):
    """Return the object with its root fixed to the world, as MuJoCo itself compiles it."""
    text = re.sub("<freejoint[^>]*/>", "", text).replace("fusestatic='true'", "")
    with warnings.catch_warnings(action="ignore"):  # of attributes that will be no more
        model = mujoco.MjModel.from_xml_string(f"<mujoco>{text}</mujoco>")
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT  # as on the rig
    return model


def forces(model, data, first):
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return {
        "inertia": inertia[first:, first:],
        "bias": data.qfrc_bias[first:],
        "gravity compensation": data.qfrc_gravcomp[first:],
        "springs": data.qfrc_spring[first:],
        "dampers": data.qfrc_damper[first:],
    }


@pytest.mark.filterwarnings("ignore:compiler attribute:UserWarning")
@pytest.mark.parametrize("name", FILES)
def test_an_object_on_the_rig_is_the_one_that_mujoco_makes_of_its_file(write, name):
    alone = held_alone(FILES[name])
    thing = mjcf_object(write(FILES[name]), grasp_site="grasp")
    assert thing.linear.m_o11[0, 0] == pytest.approx(alone.body_mass.sum())
    rig = thing.rig()
    data, on_rig = mujoco.MjData(alone), mujoco.MjData(rig.model)
    rng = np.random.default_rng(0)
    for _ in range(5):
        z2, rate = rng.uniform(-0.4, 0.4, (2, alone.nv))
        data.qpos[:], data.qvel[:] = z2, rate
        on_rig.qpos[4:], on_rig.qvel[4:] = z2, rate
        expected, found = forces(alone, data, 0), forces(rig.model, on_rig, 4)
        for term, value in expected.items():
            np.testing.assert_allclose(found[term], value, rtol=1e-9, atol=1e-9, err_msg=term)
        np.testing.assert_allclose(on_rig.qacc[4:], data.qacc, rtol=1e-5, atol=1e-5)


@pytest.mark.filterwarnings("ignore:compiler attribute:UserWarning")
@pytest.mark.parametrize("name", FILES)
def test_its_linearization_is_that_of_the_object_alone(write, name):
    alone = held_alone(FILES[name])
    linear = mjcf_object(write(FILES[name]), grasp_site="grasp").linear
    data, unit = mujoco.MjData(alone), np.eye(alone.nv)

    def at(offset, rate):
        data.qpos[:], data.qvel[:] = linear.equilibrium + offset, rate
        return {term: value.copy() for term, value in forces(alone, data, 0).items()}

    rest = at(0.0, 0.0)
    np.testing.assert_allclose(linear.m_o22, rest["inertia"], atol=1e-9)
    balance = rest["bias"] - rest["gravity compensation"] - rest["springs"]
    np.testing.assert_allclose(balance, 0, atol=1e-7)
    for index, direction in enumerate(unit):
        np.testing.assert_allclose(
            linear.d_o22[:, index], -at(0.0, direction)["dampers"], atol=1e-6
        )
        pulls = [at(step * direction, 0.0)["springs"] for step in (-1e-5, 1e-5)]
        np.testing.assert_allclose(
            linear.k_o22[:, index], (pulls[0] - pulls[1]) / 2e-5, rtol=1e-5, atol=1e-5
        )


def test_what_surrounds_the_object_is_left_out_without_a_word(write, capfd):
    text = (
        "<option timestep='.001' integrator='implicitfast' iterations='7'>"
        "<flag contact='disable' sleep='enable'/></option><size memory='1M'/>"
        "<statistic extent='3'/><visual><global fovy='10'/></visual>"
        + grip(rod()).replace(
            "<worldbody>",
            "<worldbody><geom name='floor' type='plane'"
            " size='1 1 .1'/><camera name='view'/><site name='mark'/>",
        )
        + "<contact><exclude body1='grip' body2='rod'/><pair geom1='floor' geom2='fist'/></contact>"
        "<sensor><framepos objtype='site' objname='grasp'/></sensor>"
        "<keyframe><key qpos='0 0 1 1 0 0 0 .1'/></keyframe>"
    )
    with warnings.catch_warnings(action="error"):
        thing = mjcf_object(write(text), grasp_site="grasp")
        ObjectRig(thing.rig(), count=1, num_threads=1)
    assert capfd.readouterr() == ("", "")
    assert thing.linear.m_o11[0, 0] == pytest.approx(1.5)


TENDON = (
    "<tendon><spatial stiffness='1'><site site='nail'/>{}<site site='lower'/></spatial></tendon>"
)
NAILED = grip(ARM).replace(
    "<worldbody>", "<worldbody><site name='nail'/><geom name='post' size='.1'/>"
)
FLEX = (
    "<flexcomp type='grid' count='3 1 1' spacing='.1 .1 .1' mass='.1' name='f' dim='1'>"
    "<edge stiffness='10'/></flexcomp>"
)
REFUSED = {
    "hold on to the world": NAILED + TENDON.format(""),
    "on to the world": NAILED.replace("<site name='nail'/>", "").replace(
        FREE, f"{FREE}<site name='nail'/>"
    )
    + TENDON.format("<geom geom='post'/>"),
    "flex": grip(rod() + FLEX),
    "yield": grip(rod("stiffness='1' springyield='.1'")),
    "compensate gravity": grip(rod("actuatorgravcomp='true'")),
}


@pytest.mark.parametrize("words", REFUSED)
def test_what_the_gripper_would_leave_behind_is_refused(write, words):
    with pytest.raises(ObjectFileError, match=words):
        mjcf_object(write(REFUSED[words]), grasp_site="grasp")


def test_an_object_that_comes_out_differently_is_refused_by_what_differs(write, monkeypatch):
    def careless(rig, carriage, model, **place):
        changed = copy.copy(model)
        changed.body_mass[2] *= 0.9
        changed.dof_damping[0] += 0.1
        add_object(rig, carriage, changed, **place)

    monkeypatch.setattr(object_file, "add_object", careless)
    with pytest.raises(ObjectFileError, match="another mass and another centre.*another damping"):
        mjcf_object(write(grip(rod())), grasp_site="grasp")
