"""Images of a batch from its one renderer against as many renderers as episodes.

python benchmarks/speed/images.py --num-envs 64 --size 84
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.envs.rendering.renderer import TransportRenderer
from defmanip_gym.envs.rendering.view_params import ViewParams
from resident_memory import resident_mib
from turns import Candidate, take_turns


def first_images(name: str, draw: Callable[[], object]) -> None:
    """Print what the first image of each episode takes, in time and memory."""
    before, start = resident_mib(), time.perf_counter()
    draw()
    duration = time.perf_counter() - start
    print(f"{name}: {duration:.2f} s and {resident_mib() - before:.0f} MiB for the first images")


def main() -> None:
    """Print time and memory of the first images, and the ratio of times from then on."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--num-envs", type=int, default=64)
    parser.add_argument("--size", type=int, default=84)
    parser.add_argument("--rounds", type=int, default=11)
    arguments = parser.parse_args()
    count, view = arguments.num_envs, ViewParams(width=arguments.size, height=arguments.size)
    engine = TransportEngine(TransportConfig(), count)
    engine.reset(seeds=list(range(count)))
    TransportRenderer(engine, view).images(ids=[0])  # what a process loads once
    shared = TransportRenderer(engine, view)
    own = [TransportRenderer(engine, view) for _ in range(count)]

    def draw_own() -> None:
        for i, renderer in enumerate(own):
            renderer.images(ids=[i])

    first_images("one renderer", shared.images)
    first_images(f"{count} renderers", draw_own)
    times = take_turns(
        [
            Candidate(name="one renderer", step=shared.images, num_envs=count),
            Candidate(name=f"{count} renderers", step=draw_own, num_envs=count),
        ],
        rounds=arguments.rounds,
        turn_s=0.5,
    )
    speed = times.speed("one renderer", f"{count} renderers")
    print(f"{speed.name}: {speed.value:.2f} ({speed.low:.2f}–{speed.high:.2f}) {speed.unit}")
    rate = times.rate("one renderer")
    print(f"one renderer: {rate.value:.0f} ({rate.low:.0f}–{rate.high:.0f}) images/s")


if __name__ == "__main__":
    main()
