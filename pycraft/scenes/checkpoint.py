"""Checkpoints: where a run can go on from."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .. import _core

FORMAT = "pycraft checkpoint 1"


@dataclass(frozen=True)
class Checkpoint:
    """All that a run goes on from: `scene.resume(checkpoint, T)`.

    Numbers are exact sums of doubles, so that nothing is lost in any precision. It pickles, and `save` writes it as text.

    Attributes
    ----------
    t : s, where the resumed run begins: the start of the last step if that was cut short by the end of the run
    model, effects : what the scene was: its model's name, the names of the effects that were on
    integrator, options : what the run was told
    state : for the core
    """

    t: float
    model: str
    effects: tuple[str, ...]
    precision: str
    integrator: str
    options: dict[str, Any]
    state: dict[str, Any]

    def save(self, path: str | Path) -> None:
        """Write it as JSON. OSError where the path cannot be written."""
        Path(path).write_text(json.dumps({"format": FORMAT, **asdict(self)}, indent=1) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | Path) -> Checkpoint:
        """Read what `save` wrote. EvaluationError for a file that is none."""
        try:
            data = json.loads(Path(path).read_text(encoding="utf-8"))
            if data.pop("format") != FORMAT:
                raise KeyError("format")
            data["effects"] = tuple(data["effects"])
            return cls(**data)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise _core.EvaluationError(f"{str(path)!r} holds no checkpoint ({error}); `run.checkpoint().save(path)` writes one") from None

    def __repr__(self) -> str:
        return f"<checkpoint of {self.model!r} at {self.t:g} s, integrator {self.integrator!r}>"
