"""Objects as links: they move as MuJoCo moves them, whatever joints they have."""

import numpy as np
import pytest

from defmanip_gym.errors import ParameterError
from defmanip_gym.objects.internal_forces import InternalForces
from defmanip_gym.objects.mjcf_object import mjcf_object
from defmanip_gym.theory.payload.linkage import LinkageRoom, place, require_linkage
from defmanip_gym.theory.payload.linkage_motion import MotionRoom, along_joint, push

# a slide, two hinges on one body of which one is off its origin, a fixed body, branches, a tendon
BRANCHED = """<mujoco><compiler angle="radian"/><worldbody>
<body pos="1 2 3" euler="0.1 0.2 0.3"><site name="grasp" pos="0.02 0 0.01"/>
  <geom size="0.03" mass="1"/>
  <body pos="0 0.01 -0.02"><joint name="s" type="slide" axis="1 0 0.2" stiffness="80"/>
    <geom type="box" size="0.05 0.04 0.01" mass="0.4"/>
    <body pos="0 0 -0.05" quat="1 0.1 0 0.2"><joint name="p" axis="0 -1 0" pos="0 0 0.01"/>
      <joint name="r" axis="1 0.2 0" stiffness="3" springref="0.05" armature="0.003"/>
      <geom type="cylinder" size="0.03 0.1" pos="0.01 0 -0.2" mass="0.8"/>
      <body pos="0 0 -0.1" euler="0.3 0 0"><geom size="0.04" mass="0.2"/></body>
    </body>
    <body pos="0.04 0 0"><joint name="b" axis="0 -1 0" stiffness="1"/>
      <geom type="capsule" size="0.01" fromto="0 0 0 0 0 -0.2" mass="0.3"/></body>
  </body></body></worldbody>
  <tendon><fixed stiffness="5" springlength="0.02"><joint joint="r" coef="1"/>
    <joint joint="b" coef="-0.5"/></fixed></tendon></mujoco>"""


@pytest.fixture(scope="module")
def thing(tmp_path_factory):
    path = tmp_path_factory.mktemp("linkage") / "branched.xml"
    path.write_text(BRANCHED)
    return mjcf_object(path, grasp_site="grasp")


def test_forces_are_mujocos_at_any_rate_while_the_grasp_accelerates_and_turns(thing):
    linkage, forces = thing.linkage(), InternalForces(thing.object_file)
    links, motion = LinkageRoom.empty(4), MotionRoom.empty(4)
    rng = np.random.default_rng(0)
    for _ in range(10):
        z2, rate, grasp = rng.uniform(-0.5, 0.5, 4), rng.uniform(-3, 3, 4), rng.uniform(-3, 3, 3)
        place(linkage, z2, links)
        push(linkage, links, rate, tuple(grasp), 1.3, 0.0, motion)
        found = linkage.stiffness @ z2 - linkage.preload
        for j in range(4):
            found[j] += along_joint(linkage, j, links, motion.force[j], motion.torque[j])
        expected = forces(z2, rate, acceleration_m_s2=grasp, yaw_rate_rad_s=1.3)
        np.testing.assert_allclose(found, expected, atol=1e-8)


def test_arrays_of_other_sizes_and_orders_are_refused(thing):
    linkage = thing.linkage()
    with pytest.raises(ParameterError, match=r"linkage\.offset"):
        require_linkage("linkage", linkage._replace(offset=np.zeros((3, 3))))
    with pytest.raises(ParameterError, match="after their parents"):
        require_linkage("linkage", linkage._replace(parent=np.array([1, -1, 1, 0])))
