"""The paper's cascade on the oriented field: from everywhere, with any heading, by short ways."""

from __future__ import annotations

from defmanip_gym.baselines.analytic.gains import gains_for
from defmanip_gym.baselines.analytic.tanner import TannerController, TannerParams
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.theory.control.control_laws import ForceLoopGains

# Braking from the speed limit takes about one swing of the reference beam, which then rests.
ORIENTED_PARAMS = TannerParams(
    velocity_field="oriented",
    tracking_gain=4.0,
    approach_rate=7.0,
    gains=ForceLoopGains(k1=0.0, k2=9.4),
    force_law_damping=-0.076,  # less than none: the force loop damps the swing
    yaw_rate_bound=1.5,
    bound_share=0.7,
    deceleration_share=0.5,
    speed_share=0.975,
)


def make_controller(
    config: TransportConfig, certificate: Certificate | None = None
) -> TannerController:
    """The paper's cascade on streamlines that all arrive along +x, with gains for the object."""
    robot, task = config.believed_robot, config.task
    return TannerController(
        beam=config.beam,
        robot=robot,
        task=task,
        certificate=certificate,
        params=gains_for(config.beam, robot=robot, task=task, params=ORIENTED_PARAMS),
    )
