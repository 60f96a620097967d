"""What a contestant can run inside, as the part of its name after the slash."""

from __future__ import annotations

from defmanip_gym.envs.config import InnerLoopKind
from defmanip_gym.params import DESIGN_DAMPING
from defmanip_gym.theory.filters.family import REFERENCE_FILTERS, STORAGE_FILTERS

# the filter that every controller gets
FILTER_OPTION = "storage"
CERTIFICATES = ("phase_plane", "l1", "tanner")
OPTIONS = (*STORAGE_FILTERS, *REFERENCE_FILTERS, *CERTIFICATES)
# before the slash: an inner loop that a contestant was not made for
INNER_LOOP_MARK = "@"
OTHER_INNER_LOOP = f"{INNER_LOOP_MARK}measured_force"

_INSIDE = {
    "": "",
    "storage": "inside the storage filter: Lemma III.1's V kept below V_σ",
    "backup": "inside the backup filter: what a rollout shows to be safe",
    "cbf_qp": "inside the literature's filter: a barrier by quadratic program",
    "phase_plane": "under the largest bound that the nonlinear nominal beam allows",
    "l1": "under the exact bound of the linear model of the nominal beam",
    "tanner": "under the paper's own bound, Eq. (18), for its design damping of "
    f"{DESIGN_DAMPING:g} N·m·s/rad (not proven for less)",
}
_CERTIFICATE_KNOWS = "the filter knows the nominal beam"
_FILTER_KNOWS = f"{_CERTIFICATE_KNOWS}, how far others may differ, and noise and delay"


def inside(method: str) -> str:
    """Return what an option adds to a contestant's description; nothing without one."""
    return f", {_INSIDE[method]}" if method else ""


def known_below(inner_loop: InnerLoopKind) -> tuple[str, ...]:
    """Return what the inner loop knows, if it is not the environment's own."""
    return ("the inner loop feels the grasp force",) if inner_loop == "measured_force" else ()


def known_inside(method: str) -> tuple[str, ...]:
    """Return what the filter of an option knows beyond the observation, if there is one."""
    if not method:
        return ()
    if method == "tanner":
        return (f"{_CERTIFICATE_KNOWS}, with a damping that is not the plant's",)
    return (_CERTIFICATE_KNOWS if method in CERTIFICATES else _FILTER_KNOWS,)
