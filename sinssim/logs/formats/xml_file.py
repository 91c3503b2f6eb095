"""XML files of tracks, read without entities, which could blow up a small file."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from sinssim.errors import InputError
from sinssim.system.user_file import open_file


def read_xml(path: Path) -> ElementTree.Element:
    """Return the root of an XML file.

    Raises:
        InputError: the file cannot be read, is not XML, or declares entities.
    """

    def refuse(*_: object) -> None:
        raise InputError(
            f"{path} declares XML entities, which tracks do not need and which may expand without limit: remove its "
            "<!DOCTYPE …>."
        )

    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate(namespace_separator="}")
    parser.buffer_text = True
    parser.StartElementHandler = lambda tag, attributes: builder.start(_named(tag), attributes)
    parser.EndElementHandler = lambda tag: builder.end(_named(tag))
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse  # type: ignore[assignment]
    try:
        with open_file(path) as file:
            parser.ParseFile(file)
        return builder.close()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.") from error
    except expat.ExpatError as error:
        raise InputError(
            f"{path}, line {error.lineno}: {expat.ErrorString(error.code)}; the file is not complete XML."
        ) from error
    except AssertionError as error:
        raise InputError(f"{path} is not complete XML.") from error


def _named(tag: str) -> str:
    """Return an element's name without its namespace, of which the versions of a format differ."""
    return tag.rsplit("}", 1)[-1]


def of_file(path: Path, head: bytes, element: bytes) -> bool:
    """Return whether a file may be XML with a root element."""
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    return start.startswith(b"<") and b"<" + element in start
