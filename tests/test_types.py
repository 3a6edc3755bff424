"""Annotations are right: what editors and checkers tell users of the package."""

import re
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
    """An ignored rule is named, and beside it stands why."""
    for path in (*(ROOT / "pycraft").rglob("*.py"), *(ROOT / "tests").rglob("*.py")):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            for mark, reason in (("  # no" + "qa", r": [A-Z]+\d+ - \S"), ("  # type: " + "ignore", r"\[[a-z-]+\]  # \S")):
                assert mark not in line or re.search(mark + reason, line), (path.name, number, line)
