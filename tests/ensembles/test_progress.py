"""Bars of runs and sweeps: what they say, and that they are silent where nobody looks or nothing takes long."""

import io

import pytest
import rich.console

from pycraft.ensembles.progress import SweepProgress
from pycraft.scenes import progress_bar
from pycraft.scenes.progress_bar import RunProgress


@pytest.fixture
def screen(monkeypatch):
    """What a terminal of 100 columns is sent."""
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
    """What was finished before counts as done, and not for the rate."""
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
