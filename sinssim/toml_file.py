"""Reads a TOML file into a typed model."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from sinssim.errors import InputError, shortened
from sinssim.system.files import read_text
from sinssim.toml_mistakes import Table, key_parts, report

Model = TypeVar("Model", bound=Table)
_DEEPEST = 20  # nesting depth of tables and arrays; a scenario needs six
_MOST_DOTS = 100  # of a key; more than `_DEEPEST`, because such dots may also lie in a text
_DOTTED, _ENDS, _BLANKS = re.compile(r"[\w\"'-]\.(?=[\w\"'-])"), re.compile(r"[,=\n]"), str.maketrans("", "", " \t\r")
_TOO_DEEP = f"tables or arrays are nested more than {_DEEPEST} deep; a scenario needs six levels."


def read_toml(file: Path) -> tuple[str, dict[str, Any]]:
    """Read a TOML file; return its text and its contents."""
    try:
        text = read_text(file, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{file} is not a text file in UTF-8: byte {error.start} is not valid.") from error
    return text, parse_toml(text, str(file))


def parse_toml(text: str, source: str) -> dict[str, Any]:
    """Return the contents of a TOML text; `source` names it in errors."""
    try:
        if any(len(_DOTTED.findall(part)) > _MOST_DOTS for part in _ENDS.split(text.translate(_BLANKS))):
            raise RecursionError  # tomllib takes the square of the time for a key of so many parts
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{source}: {_TOO_DEEP}") from None
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        lines = text.splitlines()
        place = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)", message)
        what = message[: place.start()] if place else message
        line = int(place[1]) if place and place[1] else len(lines)
        column = f", column {place[2]}" if place and place[2] else ""
        shown = shortened(lines[line - 1].strip()) if 0 < line <= len(lines) else ""
        raise InputError(f"{source}, line {line}{column}: TOML syntax: {shortened(what)}, in:  {shown}") from error
    except ValueError as error:  # an integer of thousands of digits, a 30th of February
        raise InputError(f"{source} cannot be read: {error}.") from error


def validate(
    model: type[Model], data: dict[str, Any], text: str, source: str, overridden: Collection[str] = ()
) -> Model:
    """Check the contents of a TOML file."""
    _check_depth(data, source)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise InputError(report(error, model, key_lines(text), overridden, source)) from error


def _check_depth(data: dict[str, Any], source: str) -> None:
    """Refuse tables nested deeper than the schema allows, before any recursion into them."""
    here: list[Any] = [data]
    for _ in range(_DEEPEST):
        inside = [table.values() if isinstance(table, dict) else table for table in here]
        here = [inner for values in inside for inner in values if isinstance(inner, dict | list | tuple)]
        if not here:
            return
    raise InputError(f"{source}: {_TOO_DEEP}")


_HEADER = re.compile(r"\s*(\[\[?)\s*([\w.\-\s\"']+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"\s*([\w.\-\"']+(?:\s*\.\s*[\w\-\"']+)*)\s*=")


def key_lines(text: str) -> dict[tuple[str, ...], int]:
    """Find the lines of the keys and tables of a TOML text: line number, from 1, by path; tables in an array are
    counted from 1.

    Keys inside inline tables and arrays are not searched; the line of their table is used.
    """
    numbers: dict[tuple[str, ...], int] = {}
    counts: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    inside = ""  # the quotes of the current multi-line string
    for number, line in enumerate(text.splitlines(), start=1):
        if not inside:
            if header := _HEADER.match(line):
                table = ()
                names = key_parts(header[2])
                for index, name in enumerate(names, start=1):
                    table += (name,)
                    if header[1] == "[[" and index == len(names):
                        counts[table] = counts.get(table, 0) + 1
                    if table in counts:
                        table += (str(counts[table]),)
                numbers.setdefault(table, number)
            elif key := _KEY.match(line):
                numbers.setdefault(table + key_parts(key[1]), number)
        for quotes in re.findall(r'"""|\'\'\'', line):
            inside = "" if inside == quotes else inside or quotes
    return numbers
