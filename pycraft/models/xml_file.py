"""An XML file being read: its root element, numbers from attributes, and errors that say file, line and element."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from lxml import etree

from .. import _core

Element: TypeAlias = "etree._Element"


class XmlFile:
    """One XML file.

    Parameters
    ----------
    path : path of the file; shown in errors as it was given

    Attributes
    ----------
    path : str
    root : the root element; its local name is `root_name`

    Raises
    ------
    ModelError
        A file that is not there or cannot be read; XML that is not well formed (with its line); entities of its own.
    """

    def __init__(self, path: str | os.PathLike[str]):
        self.path = os.fspath(path)
        try:
            with open(self.path, "rb") as file:
                data = file.read()
        except OSError as error:
            raise _core.ModelError(f"{self.path}: cannot be read: {error.strerror or error}") from None
        self.root = self._parse(data)
        self.root_name = etree.QName(self.root).localname
        self._space = etree.QName(self.root).namespace
        dtd = self.root.getroottree().docinfo.internalDTD
        entities = [entity.name for entity in dtd.iterentities()] if dtd is not None else []
        if entities:
            text = f"the file declares entities ({', '.join(entities)}), which are not expanded; write their text out"
            raise self.error(self.root, text)

    def _parse(self, data: bytes) -> Element:
        # Files come from anywhere: nothing is fetched, no entity is expanded, the parser's limits on depth and size stay.
        options = dict(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False)
        options |= dict(remove_comments=True, remove_pis=True)
        parser = etree.XMLParser(**options)
        try:
            return etree.fromstring(data, parser)
        except etree.XMLSyntaxError as error:
            # Old files use prefixes such as <controller:gazebo_ros> without declaring them, in parts that are not read.
            if len(parser.error_log) and all(entry.domain_name == "NAMESPACE" for entry in parser.error_log):
                return etree.fromstring(data, etree.XMLParser(recover=True, **options))
            line = f":{error.lineno}" if error.lineno else ""
            raise _core.ModelError(f"{self.path}{line}: not well-formed XML: {error.msg}") from None

    # ------------------------------------------------------------------ errors
    def at(self, element: Element) -> str:
        """Where an element is: file:line."""
        return f"{self.path}:{element.sourceline}"

    def error(self, element: Element, text: str) -> Exception:
        """A ModelError to raise: "file:line: text"."""
        return _core.ModelError(f"{self.at(element)}: {text}")

    # ------------------------------------------------------------------ elements
    def children(self, element: Element, name: str) -> Iterator[Element]:
        """Children of that name, in the root's namespace (if it has one)."""
        return element.iterchildren(f"{{{self._space}}}{name}" if self._space else name)

    def child(self, element: Element, name: str) -> Element | None:
        """The one child of that name, None if there is none; ModelError if there are several: which one counts is not clear."""
        found = list(self.children(element, name))
        if len(found) > 1:
            first = f"the first in line {found[0].sourceline}"
            raise self.error(found[1], f"{label(element)} has {len(found)} elements <{name}>, {first}; keep one")
        return found[0] if found else None

    def required(self, element: Element, name: str, owner: Element, remedy: str) -> Element:
        """The one child of that name; ModelError, naming the link or joint `owner`, if there is none."""
        found = self.child(element, name)
        if found is None:
            raise self.error(element, f"{label(owner)} has no <{name}>; {remedy}")
        return found

    # ------------------------------------------------------------------ attributes
    def text(self, element: Element, attribute: str, owner: Element | None = None) -> str:
        """An attribute that must be there and not empty."""
        value = (element.get(attribute) or "").strip()
        if not value:
            of = f" of {label(owner)}" if owner is not None else ""
            tag = etree.QName(element).localname
            raise self.error(element, f'<{tag}>{of} has no {attribute}; give it one: {attribute}="..."')
        return value

    def numbers(
        self,
        element: Element,
        attribute: str,
        count: int | None,
        owner: Element,
        default: np.ndarray | None = None,
        infinite: bool = False,
    ) -> np.ndarray:
        """Numbers of an attribute, separated by blanks.

        Parameters
        ----------
        count : how many there must be; None: at least one
        owner : the link or joint that the element belongs to, for the error
        default : returned where the attribute is absent; with None it must be there
        infinite : whether "inf" is a number; "nan" never is

        Raises
        ------
        ModelError
            A wrong count, or a word that is no finite number: says file, line, owner, element, attribute and the word.
        """
        where = f"{label(owner)}: <{etree.QName(element).localname}> {attribute}"
        value = element.get(attribute)
        if value is None:
            if default is not None:
                return default
            raise self.error(element, f"{where} is missing; write it")
        words = value.split()
        many = "numbers separated by blanks"
        wanted = "one number" if count == 1 else many if count is None else f"{count} {many}"
        if not words or count not in (None, len(words)):
            raise self.error(element, f'{where}="{value}" has {len(words)} values; write {wanted}')
        return np.array([self._number(element, where, value, word, wanted, infinite) for word in words])

    def number(self, element: Element, attribute: str, owner: Element, default: float | None = None, infinite: bool = False) -> float:
        """One number of an attribute: see `numbers`."""
        fallback = None if default is None else np.array([default])
        return float(self.numbers(element, attribute, 1, owner, fallback, infinite)[0])

    def _number(self, element: Element, where: str, value: str, word: str, wanted: str, infinite: bool) -> float:
        try:
            number = float(word) if "_" not in word else None  # Python alone reads 1_000 as a number
        except ValueError:
            number = None
        if number is None:
            raise self.error(element, f'{where}="{value}": {word!r} is not a number; write {wanted}, with a decimal point')
        if math.isnan(number) or (math.isinf(number) and not infinite):
            raise self.error(element, f'{where}="{value}": {word!r} is not a finite number; write {wanted}')
        return number


def label(element: Element) -> str:
    """How errors call an element: link 'forearm', joint 'elbow', or <robot> where it has no name."""
    name, kind = element.get("name"), etree.QName(element).localname
    return f"{kind} {name!r}" if name else f"<{kind}>"
