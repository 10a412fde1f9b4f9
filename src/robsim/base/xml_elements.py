"""XML elements with their line numbers, read by the parser of the standard library."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.parsers import expat

from robsim.base.errors import FileError, format_value

LARGEST_FILE = 4_000_000  # bytes, ten times the largest published robots
MOST_XML_PARTS = 100_000  # elements and attributes
DEEPEST_XML = 64  # elements inside each other
ENCODINGS = "utf-8", "us-ascii", "ascii", "iso-8859-1"  # valid declared encodings
UTF16_MARKS = b"\xff\xfe", b"\xfe\xff"  # byte order marks of UTF-16
XML_BLANKS = " \t\r\n"  # white space of XML; Python counts more characters as such


@dataclass(slots=True, eq=False)
class Element:
    """An XML element: its tag, attributes, children and line number."""

    tag: str
    attributes: dict[str, str]
    line: int
    owner: Element | None = None
    text: str = ""  # stripped text outside of the children
    children: list[Element] = field(default_factory=list)

    @property
    def label(self) -> str:
        """The name of the element in messages, such as <joint 'elbow'> <limit>."""
        name = self.attributes.get("name")
        own = f"<{self.tag:.40}>" if name is None else f"<{self.tag:.40} {format_value(name)}>"
        if name is not None or self.owner is None or self.owner.owner is None:
            return own
        return f"{self.owner.label} {own}"


def parse_xml(data: bytes, source: str, expected: str) -> Element:
    """Return the root element of an XML text from `source`.

    Raise FileError if the text is not plain XML, or if it is empty; `expected` describes its
    content.

    >>> parse_xml(b"<robot name='arm'><link/></robot>", "arm.urdf", "a robot").children[0].label
    '<link>'
    """
    if not data.strip():
        raise FileError(f"{source}: empty; expected {expected}")
    builder = _ElementBuilder(source)
    builder.parse(data)
    assert builder.root is not None
    return builder.root


def check_plain_xml(data: bytes, source: str) -> None:
    """Raise FileError unless data are XML in a valid encoding without a DOCTYPE.

    Use it in front of a library that parses XML: entities, which a DOCTYPE defines, could open
    files or exhaust the memory.

    >>> check_plain_xml(b"<!DOCTYPE COLLADA><COLLADA/>", "arm.dae")
    Traceback (most recent call last):
    robsim.base.errors.FileError: arm.dae:1: a DOCTYPE is not allowed, nor are the entities ...
    """
    _PlainXmlParser(source).parse(data)


class _PlainXmlParser:
    """Parser that rejects a DOCTYPE and all encodings but a few."""

    def __init__(self, source: str):
        self.source, self.parser = source, expat.ParserCreate()
        self.parser.XmlDeclHandler = self._check_encoding
        self.parser.StartDoctypeDeclHandler = self._refuse_doctype

    def parse(self, data: bytes) -> None:
        """Parse a whole text; raise FileError if it is not plain XML."""
        if data.startswith(UTF16_MARKS) or b"\0" in data[:4]:
            raise FileError(f"{self.source}:1: not UTF-8, but UTF-16 or similar; save it as UTF-8")
        try:
            self.parser.Parse(data, True)
        except expat.ExpatError as error:
            reason = expat.ErrorString(error.code)
            raise FileError(f"{self.source}:{error.lineno}: not valid XML: {reason}") from None

    def _check_encoding(self, version: str, encoding: str | None, standalone: int) -> None:
        if encoding is not None and encoding.lower() not in ENCODINGS:
            self._raise_error(
                f"encoding {format_value(encoding)}; expected one of {', '.join(ENCODINGS)}"
            )

    def _refuse_doctype(self, *_: object) -> None:
        self._raise_error("a DOCTYPE is not allowed, nor are the entities that it could define")

    def _raise_error(self, text: str) -> None:
        raise FileError(f"{self.source}:{self.parser.CurrentLineNumber}: {text}")


class _ElementBuilder(_PlainXmlParser):
    """Builder of the tree of elements from the events of the parser."""

    def __init__(self, source: str):
        super().__init__(source)
        self.root: Element | None = None
        self.open: list[Element] = []
        self.texts: list[list[str]] = []  # pieces of the texts of the open elements
        self.parts = 0
        self.parser.buffer_text = True
        self.parser.CharacterDataHandler = self._add_text
        self.parser.StartElementHandler = self._open_element
        self.parser.EndElementHandler = self._close_element

    def _add_text(self, text: str) -> None:
        if self.texts:
            self.texts[-1].append(text)

    def _open_element(self, tag: str, attributes: dict[str, str]) -> None:
        owner = self.open[-1] if self.open else None
        element = Element(tag, attributes, self.parser.CurrentLineNumber, owner)
        self.parts += 1 + len(attributes)
        if self.parts > MOST_XML_PARTS:
            self._raise_error(f"more than {MOST_XML_PARTS} elements and attributes")
        if len(self.open) >= DEEPEST_XML:
            self._raise_error(f"elements are nested more than {DEEPEST_XML} deep")
        if owner is None:
            self.root = element
        else:
            owner.children.append(element)
        self.open.append(element)
        self.texts.append([])

    def _close_element(self, tag: str) -> None:
        self.open.pop().text = "".join(self.texts.pop()).strip(XML_BLANKS)
