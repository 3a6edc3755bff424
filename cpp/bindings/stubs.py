"""Writes pycraft/_core.pyi from the built module: `python cpp/bindings/stubs.py`. Commit what it writes."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ERRORS = """
class Error(Exception): ...
class SpaceError(Error, TypeError): ...
class ModelError(Error, ValueError): ...
class EvaluationError(Error, ValueError): ...
class SingularHingeError(Error, ArithmeticError): ...
class SingularOperatorError(Error, ArithmeticError): ...
class RefinementError(Error, ArithmeticError): ...
class StaleOperatorError(Error, RuntimeError): ...
"""


def stubs() -> str:
    """The text of the stub file."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, "-m", "pybind11_stubgen", "pycraft._core", "-o", folder, "--exit-code"], check=True, capture_output=True
        )
        text = (Path(folder) / "pycraft" / "_core.pyi").read_text()
    # What the face attaches is found when it is called.
    text = re.sub(r"^_face: dict( = .*)?$", "_face: dict[str, typing.Any]", text, flags=re.MULTILINE)
    text = re.sub(r"^import pycraft\..*\n", "", text, flags=re.MULTILINE)
    # The exceptions live in the core but call themselves pycraft's.
    text = re.sub(r"[ \t]+$", "", text, flags=re.MULTILINE)
    text = re.sub(r"from pycraft import \w+Error\n|from pycraft import Error\n", "", text)
    text = text.replace("class Space:", ERRORS + "class Space:", 1)
    # Comparison with anything is allowed and false.
    return re.sub(r"def __eq__\(self, (\w+): \w+\) -> bool:", r"def __eq__(self, \1: object) -> bool:", text)


if __name__ == "__main__":
    (Path(__file__).parent.parent.parent / "pycraft" / "_core.pyi").write_text(stubs())
