"""Episodes of the plant against the set that their certificate lets them reach."""

import numpy as np

from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.plots.phase import reachable_set
from defmanip_gym.evaluation.protection import Certificates
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import suite_named
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.wrappers.nu_max_scaling import nu_max_filter

LAYOUT = ObservationLayout(1)


class Pumping:
    """Pushes backward while the beam swings forward, as hard as it may."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        rate = LAYOUT.part(observation, "swing_rate")
        action = np.zeros((len(observation), 3))
        action[:, :1] = -np.where(rate < 0, -1.0, 1.0)
        return action, state


def test_a_policy_that_pumps_the_swing_stays_in_the_certificates_set():
    scenarios = suite_named("nominal").scenarios[:8]
    certificate = Certificates().named("phase_plane")
    angles, rates = reachable_set(certificate)
    episodes = rollout(
        Entry(suite="nominal", contestant="pumping/phase_plane", family="reference"),
        Pumping(),
        scenarios,
        config=scenarios[0].condition.environment,
        horizon_s=20.0,
        safety_filter=nu_max_filter(scenarios[0].condition.environment, certificate),
        traced=[scenario.name for scenario in scenarios],
    )
    for episode in episodes:
        phi = episode.trace.swing_rad[:, 0]
        rate = episode.trace.swing_rate_rad_s[:, 0]
        outward = np.sign(rate) * phi  # the lower half mirrors the upper one
        assert (np.abs(rate) <= np.interp(outward, angles, rates)).all()
        assert np.abs(phi).max() > 0.5 * certificate.sigma_rad  # it does pump
