"""Contestants that a factory makes: the analytic ladder, and anybody's controller."""

from __future__ import annotations

from defmanip_gym.baselines.registry import inner_loop_of, is_reference, summary_of
from defmanip_gym.evaluation.colours import contestant_colour
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
    alone = Made(reference).build(())  # one that cannot be made shows before anything runs
    inner_loop = inner_loop_of(reference, alone)
    protection = protection_named(method, certificates, inner_loop)
    certificate = None if protection is None else protection.certificate
    description = f"{summary_of(reference)}{inside(method)}"
    if certificate is not None:
        description += f": grasp acceleration within {certificate.acceleration_bound:.2g} m/s²"
    made = Made(reference, certificate if base in _BOUNDED else None)
    knows = "what its maker gave it" if is_reference(base) else "nominal robot and beam"
    knows = getattr(alone, "knows", knows)
    return Contestant(
        name=f"{base}/{method}" if method else base,
        family="guest" if is_reference(base) else "analytic",
        description=f"{description}.",
        privileged="; ".join((knows, *known_below(inner_loop), *known_inside(method))),
        colour=contestant_colour(base, method),
        members=(Member(name=SOLE_MEMBER, controller=made),),
        protection=protection,
        inner_loop=inner_loop,
    )
