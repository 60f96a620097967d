"""What a study may vary in each analytic controller: as many values as in a recipe, or fewer."""

from __future__ import annotations

from collections.abc import Callable

from optuna import Trial

from defmanip_gym.baselines.analytic.tanner import TannerController, TannerParams
from defmanip_gym.baselines.controller import Controller
from defmanip_gym.theory.control.control_laws import ForceLoopGains


def tanner(trial: Trial) -> Controller:
    """Return the paper's controller."""
    return TannerController(
        params=TannerParams(
            acceleration_bound=trial.suggest_float("acceleration_bound", 0.5, 3.0),
            approach_rate=trial.suggest_float("approach_rate", 0.3, 6.0, log=True),
            deceleration_share=trial.suggest_float("deceleration_share", 0.1, 0.8),
            tracking_gain=trial.suggest_float("tracking_gain", 1.0, 8.0, log=True),
            yaw_rate_bound=trial.suggest_float("yaw_rate_bound", 0.5, 3.0),
            gains=ForceLoopGains(
                k1=trial.suggest_float("k1", 0.0, 0.9),
                k2=trial.suggest_float("k2", 0.2, 10.0, log=True),
            ),
        )
    )


ANALYTIC_SPACES: dict[str, Callable[[Trial], Controller]] = {
    "tanner": tanner,
}
