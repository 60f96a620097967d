"""The ladder as text and numbers."""

from __future__ import annotations

import math
from typing import Any

from rich import box
from rich.table import Table

from defmanip_gym.attack.result import AttackResult
from defmanip_gym.certification.config import CertifyConfig
from defmanip_gym.certification.filter_table import filter_numbers, filter_remarks
from defmanip_gym.certification.ladder import Ladder
from defmanip_gym.theory.certificates import CERTIFICATE_METHODS, PHASE_PLANE, Certificate
from defmanip_gym.theory.certificates.conditions import EXACT_PARAMETERS
from defmanip_gym.version import __version__

_NONE = "–"
PROOFS = {
    "nonlinear": "the nonlinear object",
    "linear": "the linear object",
    "none": "nothing",
}


def ladder_table(ladder: Ladder) -> Table:
    """Return the table for the terminal."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("method", no_wrap=True)
    for heading in ("ν_max\nm/s²", "times\ntanner", "bound\nm/s²", "tightness"):
        table.add_column(heading, justify="right")
    table.add_column("proven for\nthe object")
    reference = ladder.certificates.get("tanner")
    for method in CERTIFICATE_METHODS:
        certificate = ladder.certificates.get(method)
        if certificate is None and method in ladder.refusals:
            table.add_row(method, *[_NONE] * 4, _refusal(ladder, method))
        if certificate is None:
            continue
        table.add_row(
            method,
            f"{certificate.nu_max:.3e}",
            _times(certificate, reference),
            f"{certificate.acceleration_bound:.3e}",
            tightness_in_words(ladder.tightness(certificate)),
            f"[bold red]{certificate.proof}, broken[/]"
            if ladder.is_broken(certificate)
            else certificate.proof,
        )
    return table


def remarks(ladder: Ladder) -> list[str]:
    """Return what has to be said beside the table."""
    certificate = ladder.tightest
    if certificate is None:
        return [
            "No bound on the acceleration holds for ever: a small periodic motion drives an "
            "undamped object to any swing.",
            *filter_remarks(ladder),
        ]
    lines = [
        f"Each internal coordinate stays within σ = {certificate.sigma_rad:.4g} under "
        f"{_conditions(ladder)}.",
        *_intervals(certificate),
        "tanner and tanner_printed share ν_max between speed and acceleration, as the paper does.",
        _nonlinear_remark(certificate),
        f"A forward sinusoid of {ladder.resonant_limit:.4g} m/s² at resonance takes the linear "
        "object to σ from rest.",
    ]
    if ladder.attack is not None:
        attack = ladder.attack
        lines.append(
            f"Attack on {certificate.method}: {attack.peak_at_bound / attack.sigma:.1%} of σ at "
            f"its bound; smallest bound broken {attack.violating_bound:.4g} m/s² ({attack.method}, "
            f"{attack.coordinate}, {attack.cpu_seconds:.0f} s)."
        )
        if attack.is_broken:
            lines.append(_broken_remark(certificate, ladder.withstanding))
    return [*lines, *filter_remarks(ladder)]


def _broken_remark(broken: Certificate, lowered: Certificate | None) -> str:
    words = [
        f"[bold red]BROKEN[/]: {broken.method} is no certificate for this object. Its bound of "
        f"{broken.acceleration_bound:.4g} m/s² is proven for {PROOFS[broken.proof]} alone; do not "
        "rely on it."
        if broken.proof == "linear"
        else f"[bold red]BROKEN[/] although proven for {PROOFS[broken.proof]}: do not rely on "
        "this certificate, and please report it.",
        "Attacks broke all smaller bounds that were tried."
        if lowered is None
        else f"The largest bound that withstood an attack is {lowered.acceleration_bound:.4g} "
        "m/s², which proves nothing.",
    ]
    return " ".join(words)


def numbers(config: CertifyConfig, ladder: Ladder) -> dict[str, Any]:
    """Return everything as JSON values."""
    return {
        "command": config.command,
        "version": __version__,
        "sigma": ladder.sigma,
        "conditions": vars(ladder.conditions),
        "intervals": vars(config.intervals),
        "coordinates": list(ladder.linear.coordinates),
        "equilibrium": ladder.linear.equilibrium.tolist(),
        "resonant_limit_m_s2": ladder.resonant_limit,
        "certificates": {
            method: _certificate_numbers(ladder, certificate)
            for method, certificate in ladder.certificates.items()
        },
        "refusals": ladder.refusals,
        "filters": filter_numbers(ladder),
        "attack": _attack_numbers(ladder),
    }


def _certificate_numbers(ladder: Ladder, certificate: Certificate) -> dict[str, Any]:
    speed = certificate.speed_bound
    return {
        "nu_max_m_s2": certificate.nu_max,
        "acceleration_bound_m_s2": certificate.acceleration_bound,
        "speed_bound_m_s": None if math.isinf(speed) else speed,
        "vertical_acceleration_bound_m_s2": certificate.vertical_acceleration_bound,
        "proof": certificate.proof,
        "nonlinear_limit_m_s2": certificate.nonlinear_limit,
        "worst_factors": list(certificate.worst_factors),
        "tightness": ladder.tightness(certificate),
        "is_broken": ladder.is_broken(certificate),
    }


def _attack_numbers(ladder: Ladder) -> dict[str, Any] | None:
    attack, tightest = ladder.attack, ladder.tightest
    if attack is None or tightest is None:
        return None
    violating = attack.violating_bound
    return {
        "on": tightest.method,
        "peak_share_of_sigma": attack.peak_at_bound / attack.sigma,
        "violating_bound_m_s2": violating if math.isfinite(violating) else None,
        "method": attack.method,
        "coordinate": attack.coordinate,
        "is_broken": attack.is_broken,
        "withstood_bound_m_s2": _withstood_bound(ladder, attack),
    }


def _refusal(ladder: Ladder, method: str) -> str:
    if ladder.tightest is None:
        return "needs damping"
    if method == PHASE_PLANE and ladder.tightest.nonlinear_limit is None:
        return "needs a beam"
    return "no room left"


def _withstood_bound(ladder: Ladder, attack: AttackResult) -> float | None:
    if not attack.is_broken:
        return attack.certified_bound
    return None if ladder.withstanding is None else ladder.withstanding.acceleration_bound


def _nonlinear_remark(certificate: Certificate) -> str:
    limit = certificate.nonlinear_limit
    if limit is None:
        return (
            "Of an object from a file only the linearization is known: nothing is proven beyond "
            "it, and phase_plane has no curve to follow."
        )
    if limit == 0:
        return "Nothing is proven for the nonlinear object under these conditions."
    exact = " (exact)" if certificate.coordinate_count == 1 else ""
    return f"Proven for the nonlinear object: accelerations up to {limit:.4g} m/s²{exact}."


def _conditions(ladder: Ladder) -> str:
    conditions = ladder.conditions
    said = [
        text.format(value)
        for text, value in (
            ("vertical acceleration up to {:g} m/s²", conditions.vertical_acceleration_m_s2),
            ("yaw rates up to {:g} rad/s", conditions.yaw_rate_rad_s),
            ("starts up to {:g} rad off rest", conditions.initial_swing_rad),
            ("and up to {:g} rad/s fast", conditions.initial_swing_rate_rad_s),
            ("accelerations off by up to {:g} m/s²", conditions.acceleration_error_m_s2),
        )
        if value > 0
    ]
    return ", ".join(["horizontal acceleration within the bound", *said]) + (
        "" if said else " alone: from rest, level, without turning"
    )


def _intervals(certificate: Certificate) -> list[str]:
    if certificate.intervals == EXACT_PARAMETERS:
        return []
    damping, stiffness = certificate.worst_factors
    return [
        f"Damping may be {_interval(certificate.intervals.damping)} and elastic stiffness "
        f"{_interval(certificate.intervals.stiffness)} times the object's; the bound is smallest "
        f"near {damping:.3g} and {stiffness:.3g}."
    ]


def _interval(interval: tuple[float, float]) -> str:
    return f"[{interval[0]:g}, {interval[1]:g}]"


def _times(certificate: Certificate, reference: Certificate | None) -> str:
    if reference is None:
        return _NONE
    return f"{certificate.nu_max / reference.nu_max:.3g}"


def tightness_in_words(value: float | None) -> str:
    """Return a tightness as text; one that is not 1 never reads as 1."""
    if value is None:
        return _NONE
    if value < 0.9:
        return f"{value:.2g}"
    thousandths = math.ceil(1000 * value) if value > 1 else math.floor(1000 * value)
    return f"{thousandths / 1000:.3f}"
