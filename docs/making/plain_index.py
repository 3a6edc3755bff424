"""llms.txt: every page of the site with its address, its title and its first sentence, in plain text."""

import re

from . import contents


def title_and_sentence(written: str) -> tuple[str, str]:
    """Return the title of a page, and the first sentence below it, without markup."""
    title = re.search(r"^# +(.*)$", written, re.M)
    if title is None:
        raise ValueError(f"a page without a title, which begins {written[:60]!r}: add a heading")
    for paragraph in written[title.end() :].split("\n\n"):
        plain = " ".join(paragraph.split())
        if plain and not re.match(r"#|\||>|:::|```|\$|!|- ", plain):
            plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", plain)
            # a full stop and a space end a sentence, except after "e.g." and initials
            end = re.search(r"(?<![A-Z])(?<!e\.g)[.:?](?= +[A-Z`*(ℳφ])|[.:]$", plain)
            return plain_text(title.group(1)), plain_text(plain[: end.end()] if end else plain)
    return plain_text(title.group(1)), ""


def plain_text(markup: str) -> str:
    return re.sub(r"[`]|\*\*", "", markup).strip()


def plain_index(generated: dict[str, str]) -> str:
    """Return the file, with pages in the order of the table of contents; `generated` has the text of generated pages."""
    lines = ["# PyCraft", ""]
    for page in contents.listed():
        written = generated[page] if page in contents.GENERATED else contents.text(contents.source(page))
        title, sentence = title_and_sentence(written)
        lines.append(f"- [{title}]({page}.html): {sentence}".removesuffix(": "))
    return "\n".join(lines) + "\n"
