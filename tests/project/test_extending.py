"""The page on extending: every file that it names for an example is there and speaks of the example."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "extending.md").read_text()
EXAMPLES = {"X_world": 7, "universal": 3, "screw": 7, "Eφ = φ-I": 1, "CoulombFriction": 7, "lyapunov_blocks": 5}
"""The examples, and the number of their files."""


def files_of(example):
    """The first cells of the tables between the paragraph that brings the example up and the next one that brings another."""
    parts = re.split(r"^(?:[^|\n]*?)[`*](" + "|".join(map(re.escape, EXAMPLES)) + r")[`*](?:, [^\n]*)?:\n", PAGE, flags=re.M)
    return re.findall(r"^\| `([^`]+)` \|", parts[parts.index(example) + 1], re.M)


@pytest.mark.parametrize("example", EXAMPLES)
def test_its_files_speak_of_it(example):
    named = files_of(example)
    assert len(named) == len(set(named)) == EXAMPLES[example]
    for name in named:
        assert example in (ROOT / name).read_text(), name


def test_other_files_of_the_page_are_there():
    for name in re.findall(r"`((?:cpp|pycraft|tests|docs)/[\w/.]+)`", PAGE):
        assert (ROOT / name).exists(), name
