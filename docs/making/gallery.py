"""The gallery: every script of docs/gallery with the picture that it draws, made when the site is."""

import ast
from pathlib import Path

from .contents import ROOT

SCRIPTS = sorted((ROOT / "docs" / "gallery").glob("*.py"))


def said(script: Path) -> str:
    """The sentence that a script begins with."""
    return ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""


def draw(script: Path, picture: Path) -> None:
    """Runs a script and saves the last figure that it left; one that leaves none is an error."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.close("all")
    exec(compile(script.read_text(encoding="utf-8"), str(script), "exec"), {"__name__": "__main__"})
    if not plt.get_fignums():
        raise ValueError(f"{script.name} leaves no figure: every example of the gallery draws one")
    picture.parent.mkdir(parents=True, exist_ok=True)
    plt.gcf().savefig(picture, dpi=110, bbox_inches="tight")
    plt.close("all")


def pages() -> dict[str, str]:
    """The page; its pictures are named as the scripts are."""
    parts = ["# Gallery", f"{len(SCRIPTS)} examples, each whole, with what it draws."]
    for script in SCRIPTS:
        title = script.stem.replace("_", " ").capitalize()
        code = script.read_text(encoding="utf-8").partition('"""\n\n')[2].strip()
        parts += [f"## {title}", said(script), f"![{title}](gallery/{script.stem}.png)", f"```python\n{code}\n```"]
    return {"docs/gallery": "\n\n".join(parts) + "\n"}
