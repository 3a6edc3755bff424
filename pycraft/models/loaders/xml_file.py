"""Read an XML file: its root element, numbers from attributes, and errors with file, line and element."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import TypeAlias

from lxml import etree

from ... import _core
from .file_contents import contents

Element: TypeAlias = "etree._Element"
_DECLARATION = re.compile(rb"<\?xml\s[^>]{0,200}?version\s*=\s*([\"'])([^\"'<>]{0,40})\1[^>]{0,200}?\?>")
_FIRST_ELEMENT = re.compile(rb"<[A-Za-z_:]")


class XmlFile:
    """One XML file.

    Parameters
    ----------
    path : path of the file; shown in errors as it was given

    Attributes
    ----------
    path : str
    root : the root element; its local name is `root_name`
    warnings : faults that the parser ignores, each text with file and line

    Raises
    ------
    ModelError
        A missing or unreadable file; XML that is not well formed (with its line); entities of its own.
    """

    def __init__(self, path: str | os.PathLike[str]):
        self.path, data = contents(path)
        self.warnings: list[str] = []
        self.root, parser = self._parse(data)
        self.root_name, self._space = local_name(self.root), _namespace(self.root)
        # Expressions of macros may be in any element and attribute; the bytes show whether there can be any.
        self.may_have_macros = not data.isascii() or any(mark in data for mark in (b"xacro", b"${", b"$(", b"&#", b"\x00"))
        dtd = self.root.getroottree().docinfo.internalDTD
        entities = [entity.name for entity in dtd.iterentities()] if dtd is not None else []
        if entities:
            text = f"the file declares entities ({', '.join(entities)}), which are not expanded; write their text out"
            raise self.error(self.root, text)
        for entry in parser.error_log:  # only a warning if a DOCTYPE refers to external declarations; nothing replaces them
            if "UNDECLARED_ENTITY" in entry.type_name:
                text = f"{entry.message}: entities are not expanded; write its text out"
                raise _core.ModelError(f"{self.path}:{entry.line}: {text}")

    def _parse(self, data: bytes) -> tuple[Element, etree.XMLParser]:
        # Files are untrusted: nothing is fetched, no entity is expanded, the parser's limits on depth and size stay.
        options = dict(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False)
        options |= dict(remove_comments=True, remove_pis=True)
        data = self._repaired(data)
        parser = etree.XMLParser(**options)
        try:
            return etree.fromstring(data, parser), parser
        except etree.XMLSyntaxError as error:
            # Old files use prefixes such as <controller:gazebo_ros> without declaring them, in parts that are not read.
            log = [(entry.domain_name, entry.type_name) for entry in parser.error_log]
            after_root = [entry.line for entry in parser.error_log if entry.type_name == "ERR_DOCUMENT_END"]
            if log and all(domain == "NAMESPACE" or kind == "ERR_DOCUMENT_END" for domain, kind in log):
                if after_root:
                    self.warnings.append(f"{self.path}:{after_root[0]}: what comes after the end of the root element is ignored")
                parser = etree.XMLParser(recover=True, **options)
                return etree.fromstring(data, parser), parser
            line = f":{error.lineno}" if error.lineno else ""
            text = re.sub(r", line \d+, column (\d+)$", r", column \1", error.msg)
            remedy = "; save the file in UTF-8, or declare its encoding in its first line" if "encoding" in text else ""
            raise _core.ModelError(f"{self.path}{line}: not well-formed XML: {text}{remedy}") from None

    def _repaired(self, data: bytes) -> bytes:
        """Return the file in a form that the parser accepts: no text before the XML declaration, and a version that exists."""
        bom = data[:3] if data.startswith(b"\xef\xbb\xbf") else b""
        body = data[len(bom) :]
        declaration = _DECLARATION.search(body)
        first = _FIRST_ELEMENT.search(body)
        if declaration is None or (first is not None and declaration.start() > first.start()):
            if first is not None and (text := body[: first.start()].strip()) and not text.startswith(b"<") and b"\0" not in text:
                self.warnings.append(f"{self.path}:1: text before the root element is ignored")
                start = min(at for at in (first.start(), body.find(b"<!")) if at >= 0)
                return b"\n" * body.count(b"\n", 0, start) + body[start:]
            return data
        before, own, after = body[: declaration.start()], declaration[0], body[declaration.end() :]
        if not re.fullmatch(rb"1\.[0-9]+", version := declaration[2]):
            self.warnings.append(
                f"{self.path}: the file declares XML version {version.decode(errors='replace')!r}, which is none; it is read as XML 1.0"
            )
            own = own[: declaration.start(2) - declaration.start()] + b"1.0" + own[declaration.end(2) - declaration.start() :]
        if before:
            self.warnings.append(
                f"{self.path}:{body.count(10, 0, declaration.start()) + 1}: what comes before the XML declaration is ignored"
            )
            after = b"\n" * before.count(b"\n") + after  # lines keep their numbers
        return bom + own + after

    # ------------------------------------------------------------------ errors
    def at(self, element: Element) -> str:
        """Return the location of an element: file:line."""
        return f"{self.path}:{element.sourceline}"

    def error(self, element: Element, text: str) -> Exception:
        """Return a ModelError to raise: "file:line: text"."""
        return _core.ModelError(f"{self.at(element)}: {text}")

    # ------------------------------------------------------------------ elements
    def children(self, element: Element, name: str) -> list[Element]:
        """Return the children of that name, in the root's namespace (if it has one)."""
        return element.findall(f"{{{self._space}}}{name}" if self._space else name)

    def parts(self, element: Element, names: frozenset[str]) -> dict[str, Element]:
        """Return the children with these names, by name.

        An exact repetition counts once, with a warning; ModelError for different children of one name, since it is unclear which counts.
        """
        found: dict[str, Element] = {child.tag: child for child in element}
        if not self._space and len(found) == len(element):  # most elements have one of each, and a large file has millions
            return found
        found.clear()
        for child in element:
            name = child.tag
            if self._space:
                space, _, name = name[1:].partition("}")
                if space != self._space:
                    continue
            if name in names and (first := found.setdefault(name, child)) is not child:
                if same_elements(first, child):
                    self.warnings.append(
                        f"{self.at(child)}: {label(element)} repeats its <{name}> of line {first.sourceline}; it counts once"
                    )
                    continue
                count = len(self.children(element, name))
                text = f"{label(element)} has {count} elements <{name}> that differ, the first in line {first.sourceline}; keep one"
                raise self.error(child, text)
        return found

    def required(self, parts: dict[str, Element], name: str, element: Element, owner: Element, remedy: str) -> Element:
        """Return this part of an element; ModelError, naming the link or joint `owner`, if there is none."""
        found = parts.get(name)
        if found is None:
            raise self.error(element, f"{label(owner)} has no <{name}>; {remedy}")
        return found

    # ------------------------------------------------------------------ attributes
    def text(self, element: Element, attribute: str, owner: Element | None = None) -> str:
        """Return an attribute that must exist and not be empty."""
        value = (element.get(attribute) or "").strip()
        if not value:
            of = f" of {label(owner)}" if owner is not None else ""
            tag = local_name(element)
            raise self.error(element, f'<{tag}>{of} has no {attribute}; give it one: {attribute}="..."')
        return value

    def numbers(
        self,
        element: Element,
        attribute: str,
        count: int | None,
        owner: Element,
        default: Sequence[float] | None = None,
        infinite: bool = False,
    ) -> Sequence[float]:
        """Return the numbers of an attribute, separated by blanks.

        Parameters
        ----------
        count : required count; None: at least one
        owner : the link or joint that the element belongs to, for the error
        default : returned if the attribute is absent; None: the attribute is required
        infinite : whether "inf" is allowed; "nan" never is

        Raises
        ------
        ModelError
            A wrong count, or a word that is not a finite number: names file, line, owner, element, attribute and the word.
        """
        value = element.get(attribute)
        if value is None and default is not None:
            return default
        numbers = _plain_numbers(value)  # most are valid
        if len(numbers) == count:
            return numbers
        return self._floats(element, attribute, value, count, owner, infinite)

    def number(self, element: Element, attribute: str, owner: Element, default: float | None = None, infinite: bool = False) -> float:
        """Return one number of an attribute: see `numbers`."""
        value = element.get(attribute)
        if value is None and default is not None:
            return default
        numbers = _plain_numbers(value)
        if len(numbers) == 1:
            return numbers[0]
        return self._floats(element, attribute, value, 1, owner, infinite)[0]

    def _floats(
        self, element: Element, attribute: str, value: str | None, count: int | None, owner: Element, infinite: bool
    ) -> list[float]:
        words = value.split() if value is not None else []
        if words and count in (None, len(words)):
            try:
                numbers = list(map(float, words))
            except ValueError:
                numbers = [math.nan]
            # Only Python accepts digits of other scripts and 1_000 as numbers.
            as_written = value is not None and value.isascii() and "_" not in value
            if as_written and (all(map(math.isfinite, numbers)) or (infinite and not any(map(math.isnan, numbers)))):
                return numbers
        raise self._no_numbers(element, attribute, value, words, count, owner, infinite)

    def _no_numbers(
        self, element: Element, attribute: str, value: str | None, words: list[str], count: int | None, owner: Element, infinite: bool
    ) -> Exception:
        """Return the error for an attribute that does not have that many numbers."""
        where = f"{label(owner)}: <{local_name(element)}> {attribute}"
        if value is None:
            return self.error(element, f"{where} is missing; write it")
        many = "numbers separated by blanks"
        wanted = "one number" if count == 1 else many if count is None else f"{count} {many}"
        if not words or count not in (None, len(words)):
            return self.error(element, f'{where}="{value}" has {len(words)} value{"s" * (len(words) != 1)}; write {wanted}')
        word = next(word for word in words if math.isnan(_float(word)) or (math.isinf(_float(word)) and not infinite))
        if math.isinf(_float(word)) or word.strip("+-").lower() == "nan":
            return self.error(element, f'{where}="{value}": {word!r} is not a finite number; write {wanted}')
        return self.error(element, f'{where}="{value}": {word!r} is not a number; write {wanted}, with a decimal point')


@lru_cache(maxsize=1 << 12)  # a large file has millions of numbers, most of them repeated
def _plain_numbers(value: str | None) -> tuple[float, ...]:
    """Return the finite numbers of an attribute; empty if it is absent or any word of it is something else."""
    if value is None:
        return ()
    try:
        numbers = tuple(map(float, value.split()))
    except ValueError:
        return ()
    # Only Python accepts digits of other scripts and 1_000 as numbers.
    return numbers if all(map(math.isfinite, numbers)) and value.isascii() and "_" not in value else ()


def _float(word: str) -> float:
    """Return the number that a word stands for; NaN for none."""
    try:
        return float(word) if word.isascii() and "_" not in word else math.nan
    except ValueError:
        return math.nan


def same_elements(one: Element, other: Element) -> bool:
    """Check that two elements have the same name, attributes and contents, apart from blanks."""
    same = one.tag == other.tag and dict(one.attrib) == dict(other.attrib) and (one.text or "").split() == (other.text or "").split()
    return same and len(one) == len(other) and all(map(same_elements, one, other))


def local_name(element: Element) -> str:
    """Return the tag without its namespace. (QName refuses tags with a prefix that was never declared.)"""
    return element.tag.rpartition("}")[2]


def _namespace(element: Element) -> str:
    return element.tag[1:].partition("}")[0] if element.tag.startswith("{") else ""


def abbreviated(items: Iterable[str], between: str = ", ", most: int = 12) -> str:
    """Return a list for an error: in full if it is short, else its beginning and the number of items."""
    items = list(items)
    return between.join(items if len(items) <= most else [*items[:most], f"... ({len(items)} in all)"])


def label(element: Element) -> str:
    """Return the name of an element in errors: link 'forearm', joint 'elbow', or <robot> without a name."""
    name, kind = element.get("name"), local_name(element)
    return f"{kind} {name!r}" if name else f"<{kind}>"
