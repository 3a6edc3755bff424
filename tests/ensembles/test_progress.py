"""Bars of runs and sweeps: what they say, and that they are silent where nobody looks or nothing takes long."""

import io

import pytest
import rich.console

import pycraft as pc
from pycraft import progress_bar
from pycraft.ensembles.progress import SweepProgress
from pycraft.progress_bar import RunProgress, StepProgress


@pytest.fixture
def screen(monkeypatch):
    """Return the text sent to a terminal of 100 columns."""
    written, Console = io.StringIO(), rich.console.Console
    monkeypatch.setattr(rich.console, "Console", lambda **_: Console(file=written, force_terminal=True, width=100))
    monkeypatch.setattr(progress_bar, "SECONDS", -1.0)
    return written


def test_a_run(screen):
    with RunProgress(1.0, 5.0) as bar:
        bar(3.0)
        assert bar._bar.tasks[0].completed == 2 and bar._bar.tasks[0].total == 4
        assert bar._bar.tasks[0].fields["at"] == "3 of 5 s" and bar._bar.tasks[0].fields["rate"].endswith(" s/s")
    assert "3 of 5 s" in screen.getvalue()


def test_a_sweep(screen):
    """Runs finished before count as done, but not for the rate."""
    with SweepProgress(10, 4) as bar:
        bar.add(2, 0)
        bar.add(2, 1)
        assert bar._bar.tasks[0].completed == 8 and bar._bar.tasks[0].fields["at"] == "8 of 10 runs, 1 failed"
    assert "8 of 10 runs, 1 failed" in screen.getvalue()


@pytest.mark.parametrize("make", [lambda wanted: RunProgress(0.0, 1.0, wanted), lambda wanted: SweepProgress(2, 0, wanted)])
def test_silence(make, screen, monkeypatch):
    def go(bar):
        with bar:
            bar(0.5) if isinstance(bar, RunProgress) else bar.add(1, 0)
        return screen.getvalue()

    assert go(make(False)) == ""
    monkeypatch.setattr(progress_bar, "SECONDS", 3600.0)
    assert go(make(True)) == ""
    monkeypatch.setattr(progress_bar, "SECONDS", -1.0)
    monkeypatch.setattr(rich.console, "Console", lambda **_: type("Pipe", (), {"is_terminal": False, "is_jupyter": False})())
    assert go(make(True)) == ""


def test_named_steps(screen):
    with StepProgress(4, "theorems") as bar:
        for name in ("first", "second", "x" * 100):
            bar(name)
        assert bar._bar.tasks[0].completed == 2 and bar._bar.tasks[0].total == 4
        assert bar._bar.tasks[0].fields["at"] == f"2 of 4 theorems: {'x' * progress_bar.WIDEST}"
    assert "2 of 4 theorems: x" in screen.getvalue()


@pytest.mark.parametrize("progress", [False, None, True])
def test_a_function_is_called_in_place_of_the_bar(progress, screen):
    told = []
    with StepProgress(2, "models", told.append) as bar:
        bar("one")
        bar("two")
    assert told == ["one", "two"] and screen.getvalue() == ""
    with StepProgress(2, "models", progress) as bar:
        bar("one")
    assert (screen.getvalue() == "") == (progress is False)


def test_long_calls_show_how_far_they_are(screen):
    model = pc.chain(2)
    model.soa.check(states=0)
    assert "theorems: " in screen.getvalue()
    before = len(screen.getvalue())
    model.soa.check(states=0, progress=False)
    assert len(screen.getvalue()) == before
    pc.truth("HG == I", smallest_case=False)
    assert "cells of the truth map" in screen.getvalue()


def test_a_notebook_has_one_line_that_is_empty_in_the_end(monkeypatch):
    """Its outputs are stored: no bar stays in them."""
    shown = []

    class Handle:
        def update(self, data, raw):
            shown.append(data["text/plain"])

    display = pytest.importorskip("IPython.display")
    import IPython.display as module

    monkeypatch.setattr(module, "display", lambda *_, **__: Handle())
    monkeypatch.setattr(progress_bar, "SECONDS", -1.0)
    monkeypatch.setattr(rich.console, "Console", lambda **_: type("Cell", (), {"is_terminal": False, "is_jupyter": True})())
    with StepProgress(4, "theorems") as bar:
        bar("first")
        bar("second")
    assert (
        display
        and shown[0].startswith("0 of 4 theorems: first (0 %")
        and shown[1].startswith("1 of 4 theorems: second (25 %")
        and shown[-1] == ""
    )
