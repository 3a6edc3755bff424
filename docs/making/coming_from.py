"""The table of docs/coming_from.md: `PYTHONPATH=docs python -m making.coming_from` writes it again from pycraft/other_names.csv."""

from pathlib import Path

from pycraft.other_names import PACKAGES, rows

PAGE = Path(__file__).parents[1] / "coming_from.md"


def _code(names: str) -> str:
    return ", ".join(f"`{each.strip()}`" for each in names.split(",")) if names else ""


def table() -> str:
    """Return the rows as Markdown: the subject, its name here, and its names in each package."""
    lines = ["| | here | " + " | ".join(PACKAGES) + " |", "|---|---|" + "---|" * len(PACKAGES)]
    lines += [f"| {row.what} | `{row.call}` | " + " | ".join(_code(names) for names in row.names) + " |" for row in rows()]
    return "\n".join(lines)


def main() -> None:
    """Replace the table of the page."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    of_table = [i for i, line in enumerate(lines) if line.startswith("|")]
    lines[of_table[0] : of_table[-1] + 1] = table().splitlines()
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
