"""What is said of a run whose steps are held by stability, not by accuracy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..dynamics.stiff_motion import TAKE, TAKE_DOUBLE, stiffness_text
from ..models.warning import warn


def warn_of_stiffness(scene: Any, integrator: str, found: Mapping[str, Any]) -> None:
    """Warn, once for each scene, that the motion is stiff, of what, and which integrator to take."""
    if scene._stiffness_said:
        return
    scene._stiffness_said = True
    remedy = TAKE if scene._how[3] == "double" else TAKE_DOUBLE
    if scene._keeps_loops():
        remedy = "Take integrator='rosenbrock4' with the loops held by springs (Loop(method='penalty')), or a softer law"
    warn(stiffness_text(f"the scene of {scene.model.name!r}", integrator, found, remedy))
