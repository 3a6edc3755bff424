"""Every notebook runs from top to bottom, carries no stored output, and says what it should."""

import re
import time
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from making.offline import asked_of_others

FOLDER = Path(__file__).parents[2] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
LONGEST = 120.0
"""Seconds that a reader waits, on a busy machine with two cores."""


def test_there_are_notebooks():
    assert [n.name[:2] for n in NOTEBOOKS] == ["00", "01", "02", "03", "04", "05", "06", "07", "08"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_no_stored_outputs(path):
    notebook = nbformat.read(path, as_version=4)
    assert all(not cell.get("outputs") and cell.get("execution_count") is None for cell in notebook.cells if cell.cell_type == "code")


def shown(cells):
    """All that cells show, by kind: ("text/html", "...")."""
    outputs = [output for cell in cells for output in cell.outputs if output.output_type in ("display_data", "execute_result")]
    return [(kind, "".join(data)) for output in outputs for kind, data in output.data.items()]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebook_runs(path):
    """In two minutes, with something asserted and a picture to remember; what it shows needs no JupyterLab and nothing from elsewhere."""
    notebook = nbformat.read(path, as_version=4)
    begin = time.perf_counter()
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(FOLDER)}}).execute()
    assert time.perf_counter() - begin < LONGEST
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(code) >= 5
    assert all(cell.execution_count for cell in code)
    assert any(re.search(r"^\s*assert ", cell.source, re.M) for cell in code)
    found = shown(code)
    assert any(kind.startswith("image/") or (kind == "text/html" and "<svg" in data) for kind, data in found), "no picture"
    for kind, data in found:
        if kind == "text/html":
            assert not asked_of_others(data) and not re.search(r"\brequire(js)?\b|data-main", data), data[:300]
        assert kind.split("/")[0] in ("text", "image"), kind  # no kind that one program alone can show


def test_notebooks_begin_with_their_story():
    """A title, and what it is about, before any code."""
    for path in NOTEBOOKS:
        first = nbformat.read(path, as_version=4).cells[0]
        assert first.cell_type == "markdown" and first.source.startswith("# ") and len(first.source.split()) > 15, path.stem
        assert sum(line.startswith("# ") for cell in nbformat.read(path, as_version=4).cells for line in _prose(cell)) == 1, path.stem


def _prose(cell):
    return cell.source.splitlines() if cell.cell_type == "markdown" else []
