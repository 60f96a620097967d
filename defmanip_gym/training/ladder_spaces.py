"""What a study may vary in ``lqr``, ``shaped`` and ``mpc``; everything else stays as it is."""

from __future__ import annotations

from optuna import Trial

from defmanip_gym.baselines.analytic.lqr import LqrController, LqrParams
from defmanip_gym.baselines.analytic.mpc import MpcController, MpcParams
from defmanip_gym.baselines.analytic.shaped import ShapedController, ShapedParams
from defmanip_gym.baselines.analytic.way_params import WayKind, WayParams
from defmanip_gym.baselines.controller import Controller
from defmanip_gym.theory.control.horizon import HorizonWeights
from defmanip_gym.theory.control.sampled_lqr import LqrWeights


def lqr(trial: Trial) -> Controller:
    """Return the regulator with other weights and another way."""
    return LqrController(
        params=LqrParams(
            weights=LqrWeights(
                position=trial.suggest_float("position", 1.0, 200.0, log=True),
                velocity=trial.suggest_float("velocity", 0.1, 50.0, log=True),
                swing=trial.suggest_float("swing", 0.1, 200.0, log=True),
                swing_rate=trial.suggest_float("swing_rate", 0.01, 20.0, log=True),
            ),
            way=_way(trial, 1.0, 6.0),
            acceleration_m_s2=trial.suggest_float("acceleration", 1.0, 6.0, log=True),
        )
    )


def shaped(trial: Trial) -> Controller:
    """Return the shaper with another way and other feedback."""
    return ShapedController(
        params=ShapedParams(
            way=_way(trial, 1.0, 10.0, "normalized"),
            acceleration_m_s2=trial.suggest_float("acceleration", 1.0, 10.0, log=True),
            position_gain=trial.suggest_float("position_gain", 1.0, 20.0, log=True),
            velocity_gain=trial.suggest_float("velocity_gain", 1.0, 10.0, log=True),
        )
    )


def mpc(trial: Trial) -> Controller:
    """Return the receding horizon with other weights and another way."""
    return MpcController(
        params=MpcParams(
            weights=HorizonWeights(
                position=trial.suggest_float("position", 2.0, 50.0, log=True),
                velocity=trial.suggest_float("velocity", 0.05, 5.0, log=True),
                swing=trial.suggest_float("swing", 0.003, 0.3, log=True),
                swing_rate=trial.suggest_float("swing_rate", 0.001, 0.1, log=True),
                heading=trial.suggest_float("heading", 0.3, 30.0, log=True),
                terminal_s=trial.suggest_float("terminal", 0.0, 2.0),
            ),
            way=_way(trial, 2.0, 10.0),
        )
    )


def _way(trial: Trial, low: float, high: float, kind: WayKind = "oriented") -> WayParams:
    """Return a way with decelerations between ``low`` and ``high`` m/s²."""
    if kind == "oriented":
        turns = {
            "turn_radius_m": trial.suggest_float("turn_radius", 1.5, 8.0, log=True),
            "yaw_rate_rad_s": trial.suggest_float("yaw_rate", 1.0, 2.5),
        }
    else:
        turns = {}
    return WayParams(
        velocity_field=kind,
        **turns,
        deceleration_m_s2=trial.suggest_float("deceleration", low, high, log=True),
        vertical_deceleration_m_s2=trial.suggest_float("vertical", 0.3, 3.0, log=True),
        approach_rate_per_s=trial.suggest_float("approach_rate", 1.0, 15.0, log=True),
    )
