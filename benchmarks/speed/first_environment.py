"""What the first environment costs with and without kept machine code, in CPU and clock time.

Another checkout (``--against``) takes turns with this one: ratios are of the same minutes.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

EPISODE = """
import gymnasium
env = gymnasium.make("defmanip_gym:DeformTransport-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
"""


def process_s(checkout: Path, kept: str) -> tuple[float, float]:
    """Return CPU time and duration of a process from its start to the first step."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "NUMBA_CACHE_DIR": kept}
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, "-c", EPISODE], env=environment, check=True, cwd=kept)
    duration, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, duration


def main() -> None:
    """Print one line for each checkout and round."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--against", type=Path, help="another checkout")
    arguments = parser.parse_args()
    here = Path(__file__).resolve().parents[2]
    checkouts = [here] if arguments.against is None else [arguments.against.resolve(), here]
    for _ in range(arguments.rounds):
        for checkout in checkouts:
            with tempfile.TemporaryDirectory() as kept:
                (cold, cold_clock), (warm, warm_clock) = (
                    process_s(checkout, kept) for _ in range(2)
                )
            print(
                f"{checkout.name}: cold {cold:.2f} s of CPU ({cold_clock:.2f} s), "
                f"warm {warm:.2f} s ({warm_clock:.2f} s)",
                flush=True,
            )


if __name__ == "__main__":
    main()
