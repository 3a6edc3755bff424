"""A sweep in a folder: finished outcomes are on disk and may be larger than memory.

sweep.json          identity of the sweep: number of samples, and digests that tell it from another sweep
samples.parquet     the samples
parts/*.parquet     outcomes in order of completion, some thousands of rows each
journal.sqlite      outcomes that are not in a part yet; after a process is killed, the next one reads them
"""

from __future__ import annotations

import json
import pickle
import re
import sqlite3
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..scenes.scene import Scene
from .samples import Samples
from .stores import Shapes, empty_column
from .work import Outcome

FORMAT = "pycraft sweep 1"
OWN = re.compile(r"sweep\.json(\.new)?|samples\.parquet|parts|(journal|lock)\.sqlite.*")
"""Names of the sweep's own files."""
ROWS = 65536
"""Largest number of rows of a part."""
NUMBERS = 4_000_000
"""Largest number of values of a part: some tens of megabytes."""


class Folder:
    """Outcomes in a folder. With samples, a sweep begins or continues there; without samples, the folder is only read.

    Raises
    ------
    EvaluationError
        The folder holds another sweep; the message names the differences.
    OSError
        The folder cannot be written, holds other files, or holds no sweep to read.
    """

    def __init__(self, path: str | Path, samples: Samples | None = None, work: Any = None, overwrite: bool = False):
        self._arrow, self.path = _pyarrow(), Path(path)
        self._lock: Any = None
        self._waiting = 0  # rows in the journal
        if samples is None:
            self._about = self._read_about()
            self.samples = self._read_samples()
        elif (self.path / "sweep.json").is_file() and not overwrite:
            self._about, self.samples = self._read_about(), samples
            self._refuse_another(samples, work)
            self._lock = self._locked()
        else:
            self.samples = samples
            self._refuse_other_files()
            self._about = self._begin(work)
        self._journal = sqlite3.connect(self.path / "journal.sqlite", check_same_thread=False)
        self._journal.execute("PRAGMA journal_mode=WAL")
        self._journal.execute("CREATE TABLE IF NOT EXISTS finished (rows BLOB NOT NULL)")
        self.shapes = Shapes(self._about["values"])
        self.finished = np.zeros(self.samples.count, bool)
        self.seconds = np.full(self.samples.count, np.nan)
        self.errors: dict[int, str] = {}
        for table in [self._part(part, ["sample", "error", "seconds"]) for part in self._parts()] + self._unparted():
            self._mark(table)

    # ------------------------------------------------------------------ identity of the sweep
    def _refuse_other_files(self) -> None:
        """Refuse a folder with other files. Files of a sweep that was killed at its start are not other files."""
        if self.path.is_file() or self.path.is_dir() and any(not OWN.fullmatch(each.name) for each in self.path.iterdir()):
            raise FileExistsError(f"output {str(self.path)!r} is a file, or a folder with other files; give a new or an empty folder")

    def _locked(self) -> sqlite3.Connection:
        """Return the lock held while a sweep writes here; it is released when the process dies."""
        lock = sqlite3.connect(self.path / "lock.sqlite", timeout=1.0, check_same_thread=False, isolation_level=None)
        try:
            lock.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError:
            raise _core.EvaluationError(f"output {str(self.path)!r}: another sweep is writing to this folder") from None
        return lock

    def _begin(self, work: Any) -> dict[str, Any]:
        try:
            (self.path / "parts").mkdir(parents=True, exist_ok=True)
            self._lock = self._locked()
            for old in (self.path / "sweep.json", *self.path.glob("parts/*"), *self.path.glob("journal.sqlite*")):
                old.unlink(missing_ok=True)
            self._write_samples()
            about = {"format": FORMAT, "count": self.samples.count, "digests": _digests(self.samples, work), "values": {}}
            self._write_about(about)
        except OSError as error:
            raise type(error)(f"output {str(self.path)!r} cannot be written: {error.strerror or error}") from None
        return about

    def _write_about(self, about: Mapping[str, Any]) -> None:
        fresh = self.path / "sweep.json.new"
        fresh.write_text(json.dumps(about, indent=1), encoding="utf-8")
        fresh.replace(self.path / "sweep.json")

    def _read_about(self) -> dict[str, Any]:
        try:
            about = json.loads((self.path / "sweep.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            raise FileNotFoundError(f"{str(self.path)!r} holds no sweep") from None
        if about.get("format") != FORMAT:
            raise _core.EvaluationError(
                f"{str(self.path)!r} holds a sweep in the format {about.get('format')!r}; this version reads {FORMAT!r}"
            )
        return about

    def _refuse_another(self, samples: Samples, work: Any) -> None:
        digests = _digests(samples, work)
        if other := [name for name in {**digests, **self._about["digests"]} if digests.get(name) != self._about["digests"].get(name)]:
            raise _core.EvaluationError(
                f"output {str(self.path)!r} holds another sweep, with other {', '.join(other)}; give another folder, or overwrite=True"
            )

    def _write_samples(self) -> None:
        columns = {name: self._numbers(x) if isinstance(x, np.ndarray) else list(map(_label, x)) for name, x in self.samples.items()}
        shapes = {name: list(x.shape[1:]) for name, x in self.samples.items() if isinstance(x, np.ndarray)}
        table = self._arrow.table(columns).replace_schema_metadata({"shapes": json.dumps(shapes)})
        self._arrow.parquet.write_table(table, self.path / "samples.parquet")

    def _read_samples(self) -> Samples:
        table = self._arrow.parquet.read_table(self.path / "samples.parquet")
        shapes = json.loads(table.schema.metadata[b"shapes"])
        return Samples({name: _array(table.column(name), shapes[name]) if name in shapes else table.column(name).to_pylist()
                        for name in table.column_names})  # fmt: skip

    # ------------------------------------------------------------------ outcomes
    def add(self, outcomes: list[Outcome]) -> None:
        """Store some outcomes; they are on disk when this returns."""
        before = dict(self.shapes.known)
        checked = [self.shapes.checked(each, self.samples) for each in outcomes]
        if self.shapes.known != before:
            self._about["values"] = self.shapes.known
            self._write_about(self._about)
        table = self._table(checked)
        sink = self._arrow.BufferOutputStream()
        with self._arrow.ipc.new_stream(sink, table.schema) as writer:
            writer.write_table(table)
        with self._journal:
            self._journal.execute("INSERT INTO finished VALUES (?)", (sink.getvalue().to_pybytes(),))
        self._mark(table)
        self._waiting += len(checked)
        if self._waiting >= self._rows_of_a_part():
            self._to_parts()

    def _rows_of_a_part(self) -> int:
        width = sum(int(np.prod(shape)) for shape in self.shapes.known.values() if isinstance(shape, list))
        return max(1, min(ROWS, NUMBERS // max(width, 1)))

    def _table(self, outcomes: list[Outcome]) -> Any:
        columns: dict[str, Any] = {
            "sample": np.array([each.sample for each in outcomes], np.int64),
            "error": self._arrow.array([each.error for each in outcomes], self._arrow.string()),
            "seconds": np.array([each.seconds for each in outcomes]),
        }
        for name, shape in self.shapes.known.items():
            values = [None if each.values is None else each.values[name] for each in outcomes]
            if isinstance(shape, list):
                numbers = empty_column(shape, len(outcomes))
                for i, value in enumerate(values):
                    if value is not None:
                        numbers[i] = value
                columns[name] = self._numbers(numbers)
            else:
                columns[name] = self._arrow.array(values, self._arrow.bool_() if shape == "truth" else self._arrow.string())
        return self._arrow.table(columns)

    def _numbers(self, x: np.ndarray) -> Any:
        """Return a column of doubles, or of lists of doubles of one length."""
        flat = self._arrow.array(np.ascontiguousarray(x, float).ravel())
        return flat if x.ndim == 1 else self._arrow.FixedSizeListArray.from_arrays(flat, int(np.prod(x.shape[1:])))

    def _mark(self, table: Any) -> None:
        at = table.column("sample").to_numpy()
        self.finished[at], self.seconds[at] = True, table.column("seconds").to_numpy()
        errors = table.column("error").to_pylist()
        self.errors |= {int(sample): error for sample, error in zip(at, errors, strict=True) if error is not None}

    def _unparted(self) -> list[Any]:
        """Return the tables in the journal."""
        rows = self._journal.execute("SELECT rows FROM finished ORDER BY rowid").fetchall()
        tables = [self._arrow.ipc.open_stream(each).read_all() for (each,) in rows]
        self._waiting = sum(len(table) for table in tables)
        return tables

    def _to_parts(self) -> None:
        """Move the journal to a new part. A kill between the two steps leaves the same rows in both, which is harmless."""
        tables = self._unparted()
        if tables:
            number = 1 + max((int(part.stem) for part in self._parts()), default=-1)
            fresh = self.path / "parts" / f"{number:06}.new"
            self._arrow.parquet.write_table(self._arrow.concat_tables(tables, promote_options="default"), fresh)
            fresh.replace(fresh.with_suffix(".parquet"))
            with self._journal:
                self._journal.execute("DELETE FROM finished")
            self._waiting = 0

    def _parts(self) -> list[Path]:
        return sorted((self.path / "parts").glob("*.parquet"))

    def _part(self, part: Path, columns: list[str]) -> Any:
        there = [name for name in self._arrow.parquet.read_schema(part).names if name in columns]
        return self._arrow.parquet.read_table(part, columns=there)

    def column(self, name: str) -> np.ndarray:
        """Return one value of all runs, reading only this column of the parts."""
        shape = self.shapes.known[name]
        column = empty_column(shape, self.samples.count)
        for table in [self._part(part, ["sample", name]) for part in self._parts()] + self._unparted():
            if name in table.column_names:
                at, values = table.column("sample").to_numpy(), table.column(name)
                column[at] = _array(values, shape) if isinstance(shape, list) else np.array(values.to_pylist(), object)
        return column

    def flush(self) -> None:
        """Move the journal to a part and release the lock on the folder."""
        self._to_parts()
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def close(self) -> None:
        """Close the folder."""
        self._journal.close()


def _array(column: Any, shape: list[int]) -> np.ndarray:
    """Return an Arrow column as an array (n, *shape)."""
    if not shape:
        return column.to_numpy().astype(float)
    flat = column.combine_chunks().flatten() if column.num_chunks != 1 else column.chunk(0).flatten()
    return flat.to_numpy(zero_copy_only=False).astype(float).reshape(len(column), *shape)


def _label(value: Any) -> str:
    return str(getattr(value, "name", value))


def _digests(samples: Samples, work: Any) -> dict[str, str]:
    """Return the digests that identify a sweep."""
    parts = {"samples": samples, **work.parts()}
    return {name: sha256(pickle.dumps(_told(part), protocol=4)).hexdigest() for name, part in parts.items()}


def _told(value: Any) -> Any:
    """Return plain data, the same in every process; functions are given by their names."""
    if hasattr(value, "description"):
        return _told(value.description())
    if isinstance(value, Scene):
        entries = [(name, type(effect).__name__, _told(effect.parameters()), on) for name, (effect, on) in value._entries.items()]
        return [_told(value.model), *value._how, *entries]
    if isinstance(value, Mapping):
        return [(str(key), _told(each)) for key, each in value.items()]
    if isinstance(value, (list, tuple)):
        return [_told(each) for each in value]
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    if callable(value) and hasattr(value, "__qualname__"):
        return f"{value.__module__}.{value.__qualname__}"
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    try:
        return pickle.dumps(value, protocol=4)
    except (pickle.PicklingError, AttributeError, TypeError):
        return repr(value)


def _pyarrow() -> Any:
    try:
        import pyarrow
        import pyarrow.ipc
        import pyarrow.parquet
    except ImportError:
        raise ImportError(
            "output= needs pyarrow to write the folder: install the extra [data], or leave output out to keep the sweep in memory"
        ) from None
    return pyarrow
