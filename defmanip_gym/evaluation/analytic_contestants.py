"""Contestants that a factory makes: the analytic ladder, and anybody's controller."""

from __future__ import annotations

from defmanip_gym.baselines.factories import is_reference, summary_of
from defmanip_gym.baselines.registry import told_by
from defmanip_gym.evaluation.colours import contestant_colour
from defmanip_gym.evaluation.conditions import NOMINAL
from defmanip_gym.evaluation.contestant import Contestant, Member
from defmanip_gym.evaluation.controllers import Made
from defmanip_gym.evaluation.entry import SOLE_MEMBER
from defmanip_gym.evaluation.options import inside, known_below, known_inside
from defmanip_gym.evaluation.protection import Certificates, protection_named

# controllers that keep to a certificate's bounds by themselves
_BOUNDED = ("tanner",)


def controller_contestant(
    base: str, reference: str, method: str, certificates: Certificates
) -> Contestant:
    """Return a controller, alone or inside a filter.

    Args:
        base: its name.
        reference: ``module:factory``.
        method: names the filter; empty for none.
        certificates: where certificates come from.

    Raises:
        ControllerError: the reference leads to no controller.
    """
    told = told_by(reference, NOMINAL.environment)  # who cannot be made shows before anything runs
    protection = protection_named(method, certificates, told.inner_loop)
    certificate = None if protection is None else protection.certificate
    description = f"{summary_of(reference)}{inside(method)}"
    if certificate is not None:
        description += f": grasp acceleration within {certificate.acceleration_bound:.2g} m/s²"
    made = Made(reference, certificate if base in _BOUNDED else None)
    unsaid = "what its maker gave it" if is_reference(base) else "nominal robot and beam"
    knows = unsaid if told.knows is None else told.knows
    return Contestant(
        name=f"{base}/{method}" if method else base,
        family="guest" if is_reference(base) else "analytic",
        description=f"{description}.",
        privileged="; ".join((knows, *known_below(told.inner_loop), *known_inside(method))),
        colour=contestant_colour(base, method),
        members=(Member(name=SOLE_MEMBER, controller=made),),
        protection=protection,
        inner_loop=told.inner_loop,
    )
