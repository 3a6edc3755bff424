"""Warnings for motion with steps limited by stability, not by accuracy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

TAKE = "Take integrator='rosenbrock4', or 'auto', which takes it where the motion is stiff"
SHORTER = "Take a shorter step, or integrator='rosenbrock4'"
TAKE_DOUBLE = "Take integrator='rosenbrock4' in precision='double', or a softer law"


def stiffness_text(of: str, integrator: str, found: Mapping[str, Any], remedy: str) -> str:
    """Return the text of a warning.

    Parameters
    ----------
    of : the stiff system, as "the scene of 'arm'"
    found : from the core: t and step (s), left (steps of that size to the end), rate (1/s, negative; 0 if only the stages of the method's
        steps show it), the effect with forces that change so fast and the coordinate on which they act ("" if unknown); longest (s; for
        constant steps, which are unstable beyond it, else 0)
    remedy : a sentence
    """
    if found["longest"]:
        of_it = f", of coordinate '{found['coordinate']}'" + (f" under effect '{found['effect']}'" if found["effect"] else "")
        return (
            f"steps of {found['step']:.2g} s by {integrator!r} are unstable for {of} at t = {found['t']:.3g} s: an oscillation from "
            f"step to step grows{of_it}. There steps shorter than {found['longest']:.2g} s are stable. {remedy}"
        )
    what = "the motion decays faster than that"
    if found["rate"]:
        by = f"effect '{found['effect']}' damps" if found["effect"] else "the equations damp"
        what = f"{by} coordinate '{found['coordinate']}' at a rate of {-found['rate']:.2g} /s"
    return (
        f"{of} is stiff: integrator {integrator!r} takes steps of {found['step']:.2g} s at t = {found['t']:.3g} s, "
        f"limited by stability and not by accuracy, {found['left']:.2g} of them to the end; {what}. {remedy}"
    )
