"""Where Eigen's headers are."""

import sys
import sysconfig
from pathlib import Path


def eigen_headers():
    """The folder of Eigen's headers, from the build requirement."""
    for root in {sysconfig.get_paths()["purelib"], *sys.path}:
        for folder in ("cmeel.prefix/include/eigen3", "include/eigen3"):
            if (Path(root) / folder / "Eigen" / "Dense").exists():
                return Path(root) / folder
    return next((p for p in (Path("/usr/include/eigen3"), Path("/usr/local/include/eigen3")) if p.exists()), None)
