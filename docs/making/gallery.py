"""The gallery: every script of docs/gallery with its figure and its page, drawn when the site is built."""

import ast
import warnings
from pathlib import Path
from typing import Any

from pycraft.models.warning import ModelWarning

from .contents import ROOT
from .dark import darken

SCRIPTS = sorted((ROOT / "docs" / "gallery").glob("*.py"))


def said(script: Path) -> str:
    """Return the first sentence of a script."""
    return ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""


def plays(script: Path) -> bool:
    """Check that a script leaves an animated page, in a variable `page`."""
    tree = ast.parse(script.read_text(encoding="utf-8"))
    return any(isinstance(node, ast.Name) and node.id == "page" and isinstance(node.ctx, ast.Store) for node in ast.walk(tree))


def title(script: Path) -> str:
    """Return the title of an example, from the name of its script."""
    return script.stem.replace("_", " ").capitalize()


def draw(script: Path, picture: Path) -> None:
    """Run a script and save its last figure, for light and for dark pages, and its animated page, if it has one.

    ValueError for a script that leaves no figure.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.close("all")
    left: dict[str, Any] = {"__name__": "__main__"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        exec(compile(script.read_text(encoding="utf-8"), str(script), "exec"), left)
    if not plt.get_fignums():
        raise ValueError(f"{script.name} leaves no figure: every example of the gallery must draw one")
    picture.parent.mkdir(parents=True, exist_ok=True)
    if plays(script):
        left["page"].save(picture.with_suffix(".html"))
    plt.gcf().savefig(picture, dpi=110, bbox_inches="tight")
    darken(plt.gcf())
    plt.gcf().savefig(picture.with_name(f"{picture.stem}_dark.png"), dpi=110, bbox_inches="tight")
    plt.close("all")


def pages() -> dict[str, str]:
    """Return the gallery as thumbnails, and a page for each example; pictures have the names of the scripts."""
    cards = []
    for script in SCRIPTS:
        cards.append(
            f":::{{grid-item-card}} {title(script)}\n:link: {script.stem}\n:link-type: doc\n:class-card: example\n\n"
            f"![{title(script)}]({script.stem}.png){{.only-light}}\n![{title(script)}]({script.stem}_dark.png){{.only-dark}}\n\n"
            f"{said(script)}\n:::"
        )
    tree = "```{toctree}\n:hidden:\n\n" + "\n".join(script.stem for script in SCRIPTS) + "\n```"
    grid = "::::{grid} 1 2 3 3\n:gutter: 3\n\n" + "\n\n".join(cards) + "\n::::"
    playing = ", ".join(f"[{title(script)}]({script.stem}.md)" for script in SCRIPTS if plays(script))
    first = f"# Gallery\n\n{len(SCRIPTS)} short, complete examples, each with its figure. These are animated: {playing}."
    return {"docs/gallery/index": f"{first}\n\n{grid}\n\n{tree}\n"} | {f"docs/gallery/{script.stem}": example(script) for script in SCRIPTS}


def example(script: Path) -> str:
    """Return the page of one example: its description, its animation, its figure, its code."""
    code = script.read_text(encoding="utf-8").partition('"""\n\n')[2].strip()
    parts = [f"# {title(script)}", said(script)]
    if plays(script):
        frame = f'<iframe src="{script.stem}.html" title="{title(script)}, playing" class="plays"></iframe>'
        parts.append(f"```{{raw}} html\n{frame}\n```")
    parts.append(f"![{title(script)}]({script.stem}.png){{.only-light}}\n![{title(script)}]({script.stem}_dark.png){{.only-dark}}")
    parts.append(f"```python\n{code}\n```")
    return "\n\n".join(parts) + "\n"
