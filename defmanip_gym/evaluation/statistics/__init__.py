"""Statistics of a comparison, from records alone; NumPy and SciPy do the mathematics.

Reading order: ``episode_table`` (records as arrays), ``intervals``, ``aggregates``, ``resampling``
(the two bootstraps), ``improvement``, ``profiles``, ``scores``, ``paired``, ``verdicts``,
``summary``, ``condition_estimates``, ``filter_effects``.
"""

from defmanip_gym.evaluation.statistics.aggregates import interquartile_mean
from defmanip_gym.evaluation.statistics.intervals import wilson_interval

__all__ = ["interquartile_mean", "wilson_interval"]
