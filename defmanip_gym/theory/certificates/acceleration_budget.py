"""How ν_max is shared between speed, feedback and acceleration: (19), (31), Remark IV.1, [19].

Every ‖·‖ is one norm throughout; with L = −ε I the largest component serves, as in Section III.
"""

from __future__ import annotations

import numpy as np

from defmanip_gym.errors import CertificateError
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.validation import require_non_negative, require_positive


def acceleration_share(nu_max: float, speed_bound: float, mu: float = 0.0) -> float:
    """Return s = ν_max − sup‖ż1‖∞ − μ of Eq. (19): what is left for ‖u_o‖.

    Args:
        nu_max: ν_max of Eq. (18), or any other bound on sup‖ν‖∞, m/s².
        speed_bound: sup‖ż1‖∞, m/s; 0 where speed does not excite the object.
        mu: μ, bound on ‖Hη‖, m/s²; 0 for an object with Hurwitz A_u.

    Raises:
        CertificateError: nothing is left.
    """
    speed_bound = require_non_negative("speed_bound", speed_bound, "m/s")
    mu = require_non_negative("mu", mu, "m/s²")
    share = nu_max - speed_bound - mu
    if not share > 0:
        raise CertificateError(
            "acceleration_share",
            share,
            "s > 0 in Eq. (19)",
            f"ν_max = {nu_max:.4g} leaves no room; lower the speed bound {speed_bound:.4g} or "
            f"μ = {mu:.4g}.",
        )
    return share


def semiglobal_gain(share: float, largest_error: float) -> float:
    """Return the largest ε, 1/s, with which L = −ε I keeps ‖L ė_z1‖ ≤ s, after [19].

    ë_z1 = −ε ė_z1 lets the error only shrink, so it is largest at the start.

    Args:
        share: s of Eq. (19), m/s².
        largest_error: bound on ‖ė_z1(0)‖, m/s.
    """
    share = require_positive("share", share, "m/s²")
    largest_error = require_positive("largest_error", largest_error, "m/s")
    return share / largest_error


def largest_field_speed(nu_max: float, mu: float, speed_bound: float, gain: float) -> float:
    """Return the bound on k‖∇φ‖ of Eq. (31), (ν_max − μ − (1 + ‖L‖) sup‖ż1‖) / ‖L‖, m/s.

    It keeps ‖L ė_z1‖ within s of Eq. (19) *given* sup‖ż1‖, which it does not itself ensure: for
    that k‖∇φ‖ has to stay below the speed bound as well.

    Args:
        nu_max: m/s².
        mu: μ, m/s².
        speed_bound: sup‖ż1‖∞, m/s.
        gain: ‖L‖ = ε, 1/s.

    Raises:
        CertificateError: no field is slow enough for this gain.
    """
    gain = require_positive("gain", gain, "1/s")
    speed = acceleration_share(nu_max, speed_bound, mu) / gain - speed_bound
    if not speed > 0:
        raise CertificateError(
            "gain", gain, "‖L‖ sup‖ż1‖ < s, so that Eq. (31) has room", "Lower ε."
        )
    return speed


def margin_scaling(nu_max: float, mu: float, speed: Array) -> Array:
    """Return tanh((ν_max − μ − ‖ż1‖) / ν_max), the factor of Remark IV.1 corrected, (...).

    The print, 1 − tanh(margin), is largest where the margin is 0. Below it the factor stays 0: a
    negative one would turn the feedback round.

    Args:
        nu_max: m/s².
        mu: μ, m/s².
        speed: ‖ż1‖∞, (...) m/s.
    """
    return np.tanh(np.maximum(nu_max - mu - speed, 0.0) / nu_max)
