"""Warnings for motion with steps limited by stability, not by accuracy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

TAKE = "Use integrator='rosenbrock4', or 'auto', which uses it where the motion is stiff"
TAKE_DOUBLE = "Use integrator='rosenbrock4' in precision='double', or a softer law"


def stiffness_text(of: str, integrator: str, found: Mapping[str, Any], remedy: str) -> str:
    """Return the text of a warning.

    Parameters
    ----------
    of : the stiff system, as "the scene of 'arm'"
    found : from the core: t and step (s), left (steps of that size to the end), rate (1/s, negative; 0 if only the stages of the method's
        steps show it), the effect with forces of that decay rate and the coordinate on which they act ("" if unknown)
    remedy : a sentence
    """
    what = "the motion decays faster than that"
    if found["rate"]:
        by = f"effect '{found['effect']}' damps" if found["effect"] else "the equations damp"
        what = f"{by} coordinate '{found['coordinate']}' at a rate of {-found['rate']:.2g} /s"
    return (
        f"{of} is stiff: integrator {integrator!r} takes steps of {found['step']:.2g} s at t = {found['t']:.3g} s, "
        f"limited by stability and not by accuracy, {found['left']:.2g} of them to the end; {what}. {remedy}"
    )
