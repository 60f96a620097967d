"""What a study may vary in each analytic controller; everything else stays as it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from optuna import Trial

from defmanip_gym.baselines.analytic.field import FieldController, FieldParams
from defmanip_gym.baselines.analytic.lqr import LqrController, LqrParams
from defmanip_gym.baselines.analytic.mpc import MpcController, MpcParams
from defmanip_gym.baselines.analytic.oriented import ORIENTED_PARAMS
from defmanip_gym.baselines.analytic.shaped import ShapedController, ShapedParams
from defmanip_gym.baselines.analytic.tanner import TannerController, TannerParams
from defmanip_gym.baselines.analytic.way_params import WayKind, WayParams
from defmanip_gym.baselines.controller import Controller
from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.theory.control.horizon import HorizonWeights
from defmanip_gym.theory.control.sampled_lqr import LqrWeights


def tanner(trial: Trial) -> Controller:
    """Return the paper's controller with other design choices."""
    return TannerController(params=_cascade(trial, TannerParams()))


def oriented(trial: Trial) -> Controller:
    """Return the same on the oriented field."""
    own = replace(
        ORIENTED_PARAMS,
        turn_radius=trial.suggest_float("turn_radius", 1.0, 4.0, log=True),
        speed_share=trial.suggest_float("speed_share", 0.8, 1.0),
    )
    return TannerController(params=_cascade(trial, own))


def field(trial: Trial) -> Controller:
    """Return field, tracking and observer with other gains and another way."""
    return FieldController(
        params=FieldParams(
            way=replace(
                _way(trial, 0.8, 3.0), speed_share=trial.suggest_float("speed_share", 0.8, 1.0)
            ),
            observer_gain_per_s=trial.suggest_float("observer_gain", 1.0, 15.0, log=True),
            tracking_gain=trial.suggest_float("tracking_gain", 1.0, 8.0, log=True),
            acceleration_bound=trial.suggest_float("acceleration_bound", 0.5, 3.0),
            yaw_rate_bound=trial.suggest_float("yaw_rate_bound", 0.5, 3.0),
            following_rate=trial.suggest_float("following_rate", 0.0, 4.0),
        )
    )


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


def _cascade(trial: Trial, params: TannerParams) -> TannerParams:
    """Return ``params`` with other gains and speeds."""
    return replace(
        params,
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


ANALYTIC_SPACES: dict[str, Callable[[Trial], Controller]] = {
    "field": field,
    "lqr": lqr,
    "mpc": mpc,
    "oriented": oriented,
    "shaped": shaped,
    "tanner": tanner,
}
