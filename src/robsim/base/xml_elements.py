"""The elements of an XML text with their line numbers, by the parser of the standard library."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.parsers import expat

from robsim.base.errors import FileError, format_value

LARGEST_FILE = 4_000_000  # bytes; the largest published robots take a tenth of it
MOST_XML_PARTS = 100_000  # elements and attributes
DEEPEST_XML = 64  # elements inside each other
ENCODINGS = "utf-8", "us-ascii", "iso-8859-1"  # that a file may declare
UTF16_MARKS = b"\xff\xfe", b"\xfe\xff"  # that files begin with that are not in them
XML_BLANKS = " \t\r\n"  # what separates in XML; Python takes other characters for blanks, too


@dataclass(slots=True, eq=False)
class Element:
    """An XML element: its tag, attributes, children and line number."""

    tag: str
    attributes: dict[str, str]
    line: int
    owner: Element | None = None
    text: str = ""  # all that is no child of it, without white space around
    children: list[Element] = field(default_factory=list)

    @property
    def label(self) -> str:
        """The name of the element in messages, as in <joint 'elbow'> <limit>."""
        name = self.attributes.get("name")
        own = f"<{self.tag:.40}>" if name is None else f"<{self.tag:.40} {format_value(name)}>"
        if name is not None or self.owner is None or self.owner.owner is None:
            return own
        return f"{self.owner.label} {own}"


def parse_xml(data: bytes, source: str, expected: str) -> Element:
    """Return the root element of an XML text that was read from `source`.

    FileError: it is empty, where `expected` says what it should be, or is not plain XML.

    >>> parse_xml(b"<robot name='arm'><link/></robot>", "arm.urdf", "a robot").children[0].label
    '<link>'
    """
    if not data.strip():
        raise FileError(f"{source}: empty; expected {expected}")
    if data.startswith(UTF16_MARKS) or b"\0" in data[:4]:
        raise FileError(f"{source}:1: not UTF-8, but UTF-16 or the like; save it as UTF-8")
    parser = expat.ParserCreate()
    builder = _ElementBuilder(source, parser)
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code)
        raise FileError(f"{source}:{error.lineno}: not valid XML: {what}") from None
    assert builder.root is not None
    return builder.root


class _ElementBuilder:
    """A builder of the tree of elements from the events of the parser."""

    def __init__(self, source: str, parser: expat.XMLParserType):
        self.source, self.parser = source, parser
        self.root: Element | None = None
        self.open: list[Element] = []
        self.texts: list[list[str]] = []  # of the open elements, in the pieces as they come
        self.parts = 0
        parser.buffer_text = True
        parser.XmlDeclHandler = self._declared
        parser.CharacterDataHandler = self._text
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.StartDoctypeDeclHandler = self._doctype

    def _declared(self, version: str, encoding: str | None, standalone: int) -> None:
        if encoding is not None and encoding.lower() not in ENCODINGS:
            self._refuse(
                f"encoding {format_value(encoding)}; expected one of {', '.join(ENCODINGS)}"
            )

    def _text(self, text: str) -> None:
        if self.texts:
            self.texts[-1].append(text)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        owner = self.open[-1] if self.open else None
        element = Element(tag, attributes, self.parser.CurrentLineNumber, owner)
        self.parts += 1 + len(attributes)
        if self.parts > MOST_XML_PARTS:
            self._refuse(f"more than {MOST_XML_PARTS} elements and attributes")
        if len(self.open) >= DEEPEST_XML:
            self._refuse(f"elements are nested more than {DEEPEST_XML} deep")
        if owner is None:
            self.root = element
        else:
            owner.children.append(element)
        self.open.append(element)
        self.texts.append([])

    def _end(self, tag: str) -> None:
        self.open.pop().text = "".join(self.texts.pop()).strip(XML_BLANKS)

    def _doctype(self, *_: object) -> None:
        self._refuse("a DOCTYPE is not allowed, nor are the entities that it could define")

    def _refuse(self, text: str) -> None:
        raise FileError(f"{self.source}:{self.parser.CurrentLineNumber}: {text}")
