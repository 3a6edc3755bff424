"""Another package's forward dynamics of one of our models, and its refusal of a model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .. import _core

Vector = np.ndarray


class PeerRefusal(_core.ModelError):
    """Another package refuses this model; the text gives the reason, in the package's own words if available."""


@dataclass(frozen=True)
class Peer:
    """Another package's forward dynamics of one model: `forward_dynamics(q, v, tau)` takes (nq,), (nv,), (nv,), ours, and returns (nv,).

    `said` collects its warnings.
    """

    name: str
    forward_dynamics: Callable[[Vector, Vector, Vector], Vector]
    said: list[str] = field(default_factory=list)
