"""What the bound of the linear object, and the one proven beyond it, are worth on nonlinear beams.

Draws beams, certifies each with ``l1`` and with what of it is proven for the nonlinear object
(``Certificate.proven``), and attacks both on the MuJoCo plant. Lines go to a file as they are made;
a broken proof is a problem and ends the study with 1.

    python benchmarks/attacks/nonlinearity.py --beams 100
    python benchmarks/attacks/nonlinearity.py --beams 20 --sigma 0.25 --segments 2
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from defmanip_gym.attack.certificate import attack_certificate
from defmanip_gym.attack.target import beam_target
from defmanip_gym.errors import CertificateError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify

Row = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class StudyConfig:
    """Which beams, and how hard they are attacked."""

    beams: int = 40
    """How many, for each σ."""
    segments: tuple[int, ...] = (1, 2, 3, 4)
    """Numbers of segments to draw from."""
    sigma: tuple[float, ...] = (0.25, math.pi / 6, 0.8, 1.0)
    """Admissible deformations, rad."""
    seed: int = 0
    """Of the draw."""
    longest_s: float = 20.0
    """Longest attack, simulated seconds."""
    iterations: int = 2
    """Steps of adjoint ascent at each level."""
    output: Path = Path("results/nonlinearity.jsonl")
    """One line per beam."""


def drawn_beam(rng: np.random.Generator, segments: Sequence[int]) -> BeamParams:
    """Return a beam, its numbers log-uniform: 0.1 to 1.2 m, 0.5 to 10 kg, damping 0.01 to 3."""

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    count, length_m = int(rng.choice(segments)), between(0.1, 1.2)
    return BeamParams(
        segment_count=count,
        length_m=length_m,
        radius_m=min(0.02, length_m / count / 4),
        mass_kg=between(0.5, 10.0),
        damping=between(0.01, 3.0),
        joint_stiffness=between(0.01, 30.0),
        joint_damping=between(0.001, 1.0),
    )


def studied(beam: BeamParams, sigma: float, config: StudyConfig) -> Row:
    """Return what certificates and attacks say about one beam."""
    linear, target = certify(beam, sigma_rad=sigma), beam_target(beam)
    row: Row = {"beam": vars(beam), "sigma": sigma, "proof": linear.proof}
    certificates = {"l1": linear}
    if linear.nonlinear_limit:
        certificates["proven"] = linear.proven()
    for name, certificate in certificates.items():
        if name == "proven" and certificate is linear:
            row[name] = row["l1"]
            continue
        result = attack_certificate(
            certificate, target=target, longest_s=config.longest_s, iterations=config.iterations
        )
        row[name] = {
            "bound": certificate.acceleration_bound,
            "is_broken": result.is_broken,
            "tightness": result.tightness,
            "peak_share": result.peak_at_bound / sigma,
        }
    return row | {"transport_share": transport_share(beam, sigma)}


def transport_share(beam: BeamParams, sigma: float) -> float | None:
    """Return how much of l1 is proven under ``TRANSPORT_CONDITIONS``; None if l1 has no room."""
    try:
        transport = certify(beam, sigma_rad=sigma, conditions=TRANSPORT_CONDITIONS)
        return transport.proven().acceleration_bound / transport.acceleration_bound
    except CertificateError as error:
        return 0.0 if error.name == "nonlinear_limit" else None


def rows(config: StudyConfig) -> Iterator[Row]:
    """Yield a row for each beam that has a certificate."""
    rng = np.random.default_rng(config.seed)
    for _ in range(config.beams):
        beam = drawn_beam(rng, config.segments)
        for sigma in config.sigma:
            try:
                yield studied(beam, sigma, config)
            except CertificateError:
                continue  # hardly damped: there is nothing to attack


def table(found: Sequence[Row]) -> Table:
    """Return a line for each number of segments and σ."""
    lines = Table(title="Bounds on nonlinear beams, attacked", title_justify="left")
    for heading in (
        "segments",
        "σ",
        "beams",
        "l1 broken",
        "largest tightness",
        "proven / l1, median",
        "proven broken",
        "proven for transport",
    ):
        lines.add_column(heading, justify="right")
    keys = sorted({(row["beam"]["segment_count"], row["sigma"]) for row in found})
    for segments, sigma in keys:
        own = [r for r in found if (r["beam"]["segment_count"], r["sigma"]) == (segments, sigma)]
        proven = [r["proven"] for r in own if "proven" in r]
        shares = [r["proven"]["bound"] / r["l1"]["bound"] if "proven" in r else 0.0 for r in own]
        lines.add_row(
            str(segments),
            f"{sigma:.3g}",
            str(len(own)),
            str(sum(r["l1"]["is_broken"] for r in own)),
            f"{max(r['l1']['tightness'] for r in own):.4f}",
            f"{np.median(shares):.2f}",
            str(sum(each["is_broken"] for each in proven)),
            str(sum(bool(r["transport_share"]) for r in own)),
        )
    return lines


def main(config: StudyConfig) -> int:
    """Run the study, print its table, return the exit code."""
    console, found = Console(width=120), []
    config.output.parent.mkdir(parents=True, exist_ok=True)
    with config.output.open("w", encoding="utf-8") as file:
        for row in rows(config):
            found.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
    console.print(table(found))
    return int(any("proven" in row and row["proven"]["is_broken"] for row in found))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(StudyConfig, description=__doc__)))
