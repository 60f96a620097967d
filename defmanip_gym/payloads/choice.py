"""Which payload the arguments of an environment ask for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams, BeamRanges
from defmanip_gym.payloads.mjcf import MjcfPayload
from defmanip_gym.payloads.payload import Payload
from defmanip_gym.payloads.rod import RodPayload
from defmanip_gym.validation import require_params


def payload_of(
    payload: Payload | Mapping[str, Any] | None,
    *,
    beam: BeamParams | Mapping[str, Any],
    beam_ranges: BeamRanges | Mapping[str, Any],
    nominal_beam: BeamParams | Mapping[str, Any] | None,
) -> Payload:
    """Return the payload, a rod of the other arguments if it is None.

    Args:
        payload: or its fields, as the JSON of a specification holds them.
        beam: true beam.
        beam_ranges: what each episode draws of it.
        nominal_beam: what a feedback linearization believes.

    Raises:
        ParameterError: a payload beside a beam, or something that is none.
    """
    if payload is None:
        rod = {"beam": beam, "beam_ranges": beam_ranges, "nominal_beam": nominal_beam}
        return require_params("payload", rod, RodPayload)
    for name, value, default in (
        ("beam", beam, BeamParams()),
        ("beam_ranges", beam_ranges, BeamRanges()),
        ("nominal_beam", nominal_beam, None),
    ):
        if value != default:
            raise ParameterError(
                name,
                value,
                f"{default!r} beside a payload: beam, beam_ranges and nominal_beam make a rod",
                "Pass either a payload or a rod's arguments; ids that draw rods need "
                "beam_ranges=BeamRanges().",
            )
    return require_payload("payload", payload)


def require_payload(name: str, value: object) -> Payload:
    """Return a payload, or the one whose fields a mapping holds: with a path, from a file.

    Raises:
        ParameterError: neither of them.
    """
    if isinstance(value, Mapping):
        if set(value) <= {field.name for field in fields(RodPayload)}:
            return require_params(name, value, RodPayload)
        return require_params(name, value, MjcfPayload)
    if not isinstance(value, Payload):
        raise ParameterError(
            name, value, "a Payload or its fields", "As in MjcfPayload(path=..., grasp_site=...)."
        )
    return value
