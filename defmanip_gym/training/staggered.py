"""Episodes of a batch that do not all run in step."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback


class StaggeredEpisodes(BaseCallback):
    """Spreads the first episodes' time limits evenly, so that later ones begin one after another.

    Where all episodes begin together, and end by their time limit as they do at first, every
    rollout sees one phase of them only, for most of the time what comes after the goal was missed:
    what was learned about the other phases is forgotten in between.
    """

    def _on_training_start(self) -> None:
        if self.num_timesteps > 0:  # a resumed run goes on with its episodes
            return
        face: Any = self.training_env.unwrapped
        batch = face.env.unwrapped
        behind = np.arange(batch.num_envs) * batch.max_episode_steps // batch.num_envs
        batch.engine.count_from(behind)

    def _on_step(self) -> bool:
        return True
