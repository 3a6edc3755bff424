"""Prints the build requirements of pyproject.toml, one a line: the environment installs them once and builds without isolation."""

import re
from pathlib import Path

text = (Path(__file__).parent.parent / "pyproject.toml").read_text()
print("\n".join(re.findall(r'"([^"]+)"', re.search(r"^requires = \[(.*?)\]", text, re.S | re.M).group(1))))
