"""The gallery: every script of docs/gallery with the picture that it draws and the page that it leaves, made when the site is."""

import ast
from pathlib import Path
from typing import Any

from .contents import ROOT

SCRIPTS = sorted((ROOT / "docs" / "gallery").glob("*.py"))


def said(script: Path) -> str:
    """The sentence that a script begins with."""
    return ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""


def plays(script: Path) -> bool:
    """Whether a script leaves a page that plays: what it calls `page`."""
    tree = ast.parse(script.read_text(encoding="utf-8"))
    return any(isinstance(node, ast.Name) and node.id == "page" and isinstance(node.ctx, ast.Store) for node in ast.walk(tree))


def draw(script: Path, picture: Path) -> None:
    """Runs a script and saves the last figure that it left, one that leaves none is an error; and its page beside it, if it leaves one."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.close("all")
    left: dict[str, Any] = {"__name__": "__main__"}
    exec(compile(script.read_text(encoding="utf-8"), str(script), "exec"), left)
    if not plt.get_fignums():
        raise ValueError(f"{script.name} leaves no figure: every example of the gallery draws one")
    picture.parent.mkdir(parents=True, exist_ok=True)
    if plays(script):
        left["page"].save(picture.with_suffix(".html"))
    plt.gcf().savefig(picture, dpi=110, bbox_inches="tight")
    plt.close("all")


def pages() -> dict[str, str]:
    """The page; its pictures are named as the scripts are."""
    parts = [
        "# Gallery",
        f"{len(SCRIPTS)} examples, each whole, with what it draws; what they call `page` plays here, and turns by the mouse.",
    ]
    for script in SCRIPTS:
        title = script.stem.replace("_", " ").capitalize()
        code = script.read_text(encoding="utf-8").partition('"""\n\n')[2].strip()
        parts += [f"## {title}", said(script), f"![{title}](gallery/{script.stem}.png)"]
        if plays(script):
            frame = f'<iframe src="gallery/{script.stem}.html" title="{title}, playing" loading="lazy" class="plays"></iframe>'
            parts.append(f"```{{raw}} html\n{frame}\n```")
        parts.append(f"```python\n{code}\n```")
    return {"docs/gallery": "\n\n".join(parts) + "\n"}
