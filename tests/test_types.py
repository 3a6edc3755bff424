"""Annotations are right: what editors and checkers tell users of the package."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.mark.slow
def test_the_type_checker_finds_nothing():
    pytest.importorskip("mypy")
    done = subprocess.run([sys.executable, "-m", "mypy"], cwd=ROOT, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout


def test_nothing_is_ignored_without_a_reason():
    """`noqa` names its rule, and says why where another reader would ask; types are ignored by their code."""
    for path in (ROOT / "pycraft").rglob("*.py"):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            assert "# noqa" not in line or "# noqa: F401" in line, (path.name, number, line)
            assert "type: ignore" not in line or "type: ignore[" in line, (path.name, number, line)
