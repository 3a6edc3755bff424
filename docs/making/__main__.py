"""Build the site: `python -m making build/docs`; its first page is build/docs/html/index.html."""

import subprocess
import sys
from pathlib import Path

from . import contents, generated, offline
from .plain_index import plain_index

FORWARD = '<!doctype html><meta charset="utf-8"><title>PyCraft</title><meta http-equiv="refresh" content="0; url=docs/index.html">\n'


def written(path: Path, text: str) -> None:
    """Write a text unless the file has it already: Sphinx reads newer files again."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def assembled(folder: Path) -> dict[str, str]:
    """Write the sources of the site into one folder; return the text of the generated pages."""
    texts = {folder / path.relative_to(contents.ROOT): path.read_text(encoding="utf-8") for path in contents.committed()}
    made = generated.pages()
    texts |= {folder / f"{page}.md": text for page, text in made.items()}
    for path, text in texts.items():
        written(path, text)
    for copy in folder.rglob("*"):
        if copy.suffix in (".md", ".ipynb") and copy not in texts:
            copy.unlink()  # a page that no longer exists
    generated.pictures(folder)
    return made


def main(folder: Path) -> int:
    made = assembled(folder / "source")
    site, here = folder / "html", Path(__file__).parent
    built = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-c", here, "-d", folder / "doctrees", folder / "source", site]
    )
    if built.returncode:
        return built.returncode
    written(site / "index.html", FORWARD)
    for page in generated.playing(folder / "source"):
        written(site / page.relative_to(folder / "source"), page.read_text(encoding="utf-8"))
    written(site / "llms.txt", plain_index(made))
    asked = offline.not_offline(site)
    for line in asked:
        print(f"would ask the network: {line}", file=sys.stderr)
    print(f"{len(list(site.rglob('*.html')))} pages: {site / 'index.html'}")
    return 1 if asked else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m making FOLDER; the site is written to FOLDER/html")
    sys.exit(main(Path(sys.argv[1]).resolve()))
