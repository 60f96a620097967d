"""Plans with gains for any state: stored ones where the state is known, else solved for."""

from __future__ import annotations

from dataclasses import dataclass, field

from defmanip_gym.planning.limits import Margins
from defmanip_gym.planning.model import Array
from defmanip_gym.planning.plan_file import shipped_plans
from defmanip_gym.planning.search import SearchParams, best_plan
from defmanip_gym.planning.setting import PlanningSetting
from defmanip_gym.planning.stored import StoredPlans
from defmanip_gym.planning.tracking import Track, TrackingWeights, track_of

# sensors may be noisy, and no two stored starts differ in the swing alone
_SWING_TOLERANCE_RAD = 0.2
_MOST_TRACKS = 2000  # that are kept, of a few dozen kB each


@dataclass(frozen=True, kw_only=True)
class Tracks:
    """Makes what following a plan takes, once for each state.

    Attributes:
        setting: robot, beam and task.
        stored: plans that are known beforehand.
        margins: of the others.
        search: how thoroughly those are searched for.
        weights: of the regulation about all of them.
    """

    setting: PlanningSetting
    stored: StoredPlans
    margins: Margins
    search: SearchParams
    weights: TrackingWeights
    _made: dict[bytes, Track] = field(default_factory=dict, repr=False)

    def of(self, state: Array) -> Track:
        """Return the plan from a state, (11,), in samples and with gains.

        Raises:
            InstallationError: no stored plan begins there, and CasADi is not installed.
            ParameterError: there is no plan.
        """
        key = state.tobytes()
        if key not in self._made:
            if len(self._made) >= _MOST_TRACKS:
                self._made.clear()
            model, period_s = self.setting.model, self.setting.task.control_period_s
            known = self.stored.find_state(state, swing_tolerance_rad=_SWING_TOLERANCE_RAD)
            if known is not None:
                plan = known.drive
            else:
                limits = self.setting.limits(self.margins)
                plan = best_plan(model, limits, state, self.search)
            self._made[key] = track_of(model, plan, period_s, self.weights)
        return self._made[key]


def fitting_plans(setting: PlanningSetting) -> StoredPlans:
    """Return the package's plans, or none where they were made for something else."""
    stored, own = shipped_plans(), setting.identity
    fits = all(stored.made_with.get(key) == value for key, value in own.items())
    return stored if fits else StoredPlans(made_with=own)
