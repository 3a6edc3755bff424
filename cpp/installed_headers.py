"""Copy headers for C++ users: python cpp/installed_headers.py SOURCE TARGET FOLDER ...

The headers of each folder of SOURCE go to TARGET/pycraft, and what they include of each other is named as users name it:
`#include "model/body.h"` becomes `#include "pycraft/model/body.h"`, so that two packages with a `model` folder do not collide.
"""

import re
import sys
from pathlib import Path


def installed(text: str, folders: list[str]) -> str:
    """Return a header with its includes of these folders under pycraft/."""
    return re.sub(rf'(#\s*include\s+")((?:{"|".join(map(re.escape, folders))})/)', r"\1pycraft/\2", text)


def main(source: Path, target: Path, folders: list[str]) -> None:
    """Write the headers of these folders."""
    for folder in folders:
        for header in sorted((source / folder).rglob("*.h")):
            copy = target / "pycraft" / header.relative_to(source)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_text(installed(header.read_text(encoding="utf-8"), folders), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
