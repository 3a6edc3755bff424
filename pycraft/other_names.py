"""Names of other packages and what they are called here, for errors and for docs/coming_from.md."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

PACKAGES = ("Pinocchio", "MuJoCo", "Drake", "roboticstoolbox", "Simbody")

OWNERS = {"pycraft": "", "Multibody": "model.", "Scene": "scene.", "Run": "run."}
"""The classes that own a thing, and how a call of it begins."""


@dataclass(frozen=True)
class Row:
    """One thing and its names: here, in each of `PACKAGES` (several separated by commas), and other words that users try.

    Attributes
    ----------
    what : the thing
    here : its name here, as a call
    of : the class that has it: "Multibody", "Scene", "Run" or "pycraft"
    names : the names in PACKAGES, in their order; "" where there is none
    words : further names that users look for and that belong to no package
    """

    what: str
    here: str
    of: str
    names: tuple[str, str, str, str, str]
    words: str = ""

    @property
    def call(self) -> str:
        """Return the call as a user writes it: each of several names with its owner."""
        if "(" in self.here.partition(",")[0] or not OWNERS[self.of]:
            return OWNERS[self.of] + self.here
        return ", ".join(OWNERS[self.of] + each for each in self.here.split(", "))

    def asked(self) -> Iterator[str]:
        """Yield the identifiers under which users may look for it: the last part of each dotted name."""
        for text in (*self.names, self.words):
            for name in text.split(","):
                if last := name.strip().rpartition(".")[2].partition("(")[0]:
                    yield last


def _read() -> tuple[Row, ...]:
    with Path(__file__).with_suffix(".csv").open(encoding="utf-8", newline="") as file:
        rows = csv.reader(file, delimiter="|", quoting=csv.QUOTE_NONE)
        if (head := next(rows)) != ["what", "here", "of", *PACKAGES, "words"]:
            raise ValueError(f"other_names.csv has the columns {head}")
        return tuple(Row(what, here, of, (a, b, c, d, e), words) for what, here, of, a, b, c, d, e, words in rows)


@lru_cache(maxsize=1)
def rows() -> tuple[Row, ...]:
    """Return the table of other_names.csv. Read once, on first use."""
    return _read()


@lru_cache(maxsize=1)
def _by_name() -> dict[tuple[str, str], Row]:
    found: dict[tuple[str, str], Row] = {}
    for row in rows():
        for name in row.asked():
            found.setdefault((row.of, name), row)
    return found


def remedy(of: str, name: str) -> str:
    """Return "; here that is ..." for a name of another package or of the trade, and "" for any other.

    of : the class on which it is read, as `Row.of`; a name read on the module may belong to any class
    """
    kinds = OWNERS if of == "pycraft" else {of: ""}
    row = next((found for kind in kinds if (found := _by_name().get((kind, name)))), None)
    return "" if row is None else f"; here that is {row.call} (docs/coming_from.md)"


class Renamed:
    """A class that answers a missing attribute with its name here."""

    _of = ""

    def __getattr__(self, name: str) -> object:
        """Raise an AttributeError that gives the name here. Called only for missing names."""
        text = f"{type(self).__name__!r} object has no attribute {name!r}"
        raise AttributeError(text if name.startswith("_") else text + remedy(self._of, name), name=name, obj=self)
