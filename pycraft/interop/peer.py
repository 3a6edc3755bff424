"""Another package's forward dynamics of a model of ours, and its refusal of a model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .. import _core

Vector = np.ndarray


class PeerRefusal(_core.ModelError):
    """Another package does not take this model; the text says why, in the package's own words where it has some."""


@dataclass(frozen=True)
class Peer:
    """Another package's forward dynamics of one model: `forward_dynamics(q, v, tau)` takes (nq,), (nv,), (nv,), ours, and gives (nv,).

    `said` collects the warnings that it gives beside its values.
    """

    name: str
    forward_dynamics: Callable[[Vector, Vector, Vector], Vector]
    said: list[str] = field(default_factory=list)
