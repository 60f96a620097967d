"""What surrounds the slow transport: wrong damping in the force law, ``l1``, the physics step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np

from defmanip_gym.baselines.analytic.tanner import GENTLE_PARAMS, TannerController
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.evaluation.conditions import Condition
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.suites import Scenario
from defmanip_gym.params import PAPER_DISTURBANCE, BeamParams
from defmanip_gym.payloads.rod import RodPayload
from defmanip_gym.reproduction.course import POSITION
from defmanip_gym.reproduction.parts import Numbers, Part
from defmanip_gym.reproduction.setting import PLANT_DAMPING, SIGMA_RAD, paper_setting
from defmanip_gym.reproduction.transport import run_transport
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, Certificate, certify
from defmanip_gym.theory.control.stability import SampledLoop
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.wrappers.nu_max_scaling import nu_max_filter

ASSUMED_DAMPINGS = (0.1, 0.0, 1.0)

_STUDY_S = 20.0
_FIRST_SWING_RAD = 0.02
_L1_HORIZON_S = 60.0
_SHORT_PIECE_S = 200.0
_RINGING_RAD_S = (2.0, 8.0)  # the swing's own 4.95 rad/s, and what a wrong damping makes of it
_LARGEST_LINEAR = 0.4  # beyond this amplitude (rad · rad/s) the swing is not exponential any more


def damping_study(max_duration_s: float) -> Part:
    """Let a beam of damping 0.1 swing at the goal under force laws that assume other dampings."""
    config = TransportConfig(
        constraint_mode="cost",
        sigma_rad=SIGMA_RAD,
        payload=RodPayload(beam=BeamParams(damping=PLANT_DAMPING)),
    )
    numbers: list[Numbers] = []
    arrays: dict[str, Array] = {}
    for index, assumed in enumerate(ASSUMED_DAMPINGS):
        controller = TannerController(
            beam=config.beam,
            params=replace(GENTLE_PARAMS, force_law_damping=assumed),
            require_stability=False,  # the last one is not stable: that is what is to be seen
        )
        loop = replace(controller.sampled_loop(), linearization_beam=config.believed_beam)
        rate, frequency = swing_mode(loop)
        time_s, swing, swing_rate = _swing(config, controller, min(_STUDY_S, max_duration_s))
        amplitude = np.hypot(frequency * swing, swing_rate)
        numbers.append(
            {
                "assumed_damping": assumed,
                "effective_damping": effective_damping(PLANT_DAMPING, assumed),
                "predicted_growth_per_s": rate,
                "measured_growth_per_s": _growth(time_s, amplitude),
                "spectral_radius": controller.sampled_loop().spectral_radius(),
                "largest_swing_rad": float(np.abs(swing).max()),
                "duration_s": float(time_s[-1]),
            }
        )
        arrays |= {f"time_s_{index}": time_s, f"swing_{index}": swing}
    return Part(numbers={"cases": numbers}, arrays=arrays)


def effective_damping(true: float, assumed: float) -> float:
    """Return D_eff of a uniform rod under exact force tracking (Γ = 3), N·m·s/rad."""
    return true - 3.0 * (assumed - true)


def swing_mode(loop: SampledLoop) -> tuple[float, float]:
    """Return growth (1/s) and frequency (rad/s) of the swing in a sampled loop."""
    eigenvalues = np.linalg.eigvals(loop.transition_matrix())
    frequency = np.abs(np.angle(eigenvalues)) / loop.period_s
    ringing = (frequency > _RINGING_RAD_S[0]) & (frequency < _RINGING_RAD_S[1])
    index = int(np.where(ringing, np.abs(eigenvalues), -1.0).argmax())
    return math.log(abs(eigenvalues[index])) / loop.period_s, float(frequency[index])


def _swing(
    config: TransportConfig, controller: TannerController, duration_s: float
) -> tuple[Array, Array, Array]:
    """Return time, φ and φ̇ from a small swing at the goal, until σ is left or time is up."""
    engine = TransportEngine(config, num_envs=1, num_threads=1)
    start = (*config.task.goal[:5], _FIRST_SWING_RAD)
    observation, _ = engine.reset(options={"start": start})
    rows, memory, period = [], None, config.task.control_period_s
    for step in range(round(duration_s / period) + 1):
        plant = engine.plant_state
        rows.append((step * period, plant.swing[0, 0], plant.swing_rate[0, 0]))
        if engine.largest_swing_rad[0] > SIGMA_RAD:
            break
        action, memory = controller.predict(observation, memory)
        observation = engine.step(action).observations
    time_s, swing, swing_rate = np.array(rows).T
    return time_s, swing, swing_rate


def _growth(time_s: Array, amplitude: Array) -> float:
    """Return the exponential rate after the first moments, while the swing is small."""
    linear = np.flatnonzero(amplitude > _LARGEST_LINEAR)
    end = int(linear[0]) if linear.size else len(amplitude)
    settled = slice(min(75, end // 3), end)
    return float(np.polyfit(time_s[settled], np.log(amplitude[settled]), 1)[0])


def l1_certificate() -> Certificate:
    """Return the certificate of the plant's beam for the transport."""
    return certify(
        BeamParams(damping=PLANT_DAMPING),
        sigma_rad=SIGMA_RAD,
        method="l1",
        conditions=TRANSPORT_CONDITIONS,
    )


def l1_transport(max_duration_s: float) -> Part:
    """Make the same transport, disturbances included, under the ``l1`` certificate."""
    certificate = l1_certificate()
    beam = BeamParams(damping=PLANT_DAMPING)
    config = TransportConfig(
        constraint_mode="cost",
        sigma_rad=SIGMA_RAD,
        payload=RodPayload(beam=beam),
        disturbance=PAPER_DISTURBANCE,
    )
    scenario = Scenario(
        name="paper",
        seed=0,
        start=config.task.start.center,
        condition=Condition(name="paper", disturbance=PAPER_DISTURBANCE),
    )
    (episode,) = rollout(
        Entry(suite="reproduction", contestant="tanner/l1", family="analytic"),
        TannerController(beam=beam, certificate=certificate, params=GENTLE_PARAMS),
        [scenario],
        config=config,
        horizon_s=min(_L1_HORIZON_S, max_duration_s),
        safety_filter=nu_max_filter(config, certificate),
        traced=[scenario.name],
    )
    record, trace = episode.record, episode.trace
    assert trace is not None
    numbers: Numbers = {
        "acceleration_bound_m_s2": certificate.acceleration_bound,
        "outcome": record.outcome,
        "duration_s": record.duration_s,
        "largest_swing_rad": float(trace.largest_swing_rad.max()),
        "final_position_m": trace.position_m[-1].tolist(),
        "final_heading_rad": float(trace.heading_rad[-1]),
        "interventions": record.interventions,
    }
    arrays = {name: getattr(trace, name) for name in ("time_s", "position_m", "heading_rad")}
    return Part(numbers=numbers, arrays=arrays | {"swing_rad": trace.swing_rad[:, 0]})


def physics_step_study(max_duration_s: float) -> Part:
    """Make the beginning of the slow transport with two physics steps."""
    rows = []
    for physics_period_s in (0.005, 0.005 / 3):
        setting = paper_setting(
            max_duration_s=min(_SHORT_PIECE_S, max_duration_s), physics_period_s=physics_period_s
        )
        course = run_transport(setting, lambda time_s: None)
        rows.append(
            {
                "physics_period_s": physics_period_s,
                "duration_s": float(course.time_s[-1]),
                "position_m": course.last[-1, POSITION].tolist(),
                "largest_swing_rad": float(course.largest_swing_rad[0]),
            }
        )
    positions = np.array([row["position_m"] for row in rows])
    shift = float(np.linalg.norm(positions[1] - positions[0]))
    return Part(numbers={"runs": rows, "position_difference_m": shift}, arrays={})


def settings_of_studies() -> Numbers:
    """Return what the studies depend on besides the package version."""
    return {
        "dampings": ASSUMED_DAMPINGS,
        "params": asdict(GENTLE_PARAMS),
        "certificate": asdict(l1_certificate()),
        "durations_s": (_STUDY_S, _L1_HORIZON_S, _SHORT_PIECE_S),
        "first_swing_rad": _FIRST_SWING_RAD,
    }


StudyMaker = Callable[[float], Part]
STUDIES: dict[str, StudyMaker] = {
    "damping_study": damping_study,
    "l1": l1_transport,
    "physics_step": physics_step_study,
}
