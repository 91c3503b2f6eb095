"""Reading a TOML file into a typed model, with every mistake named by file, line and key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from sinssim.errors import InputError
from sinssim.scenario.mistakes import describe, key_lines

Model = TypeVar("Model", bound=BaseModel)

_SHOWN = 12  # mistakes listed at once


def read_toml(file: Path) -> tuple[str, dict[str, Any]]:
    """Read a TOML file.

    Args:
        file: the file.

    Returns:
        Its text and its contents.

    Raises:
        InputError: it cannot be read, or is not TOML; the message shows the line.
    """
    try:
        text = file.read_text(encoding="utf-8")
        return text, tomllib.loads(text)
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{file} is not a text file in UTF-8: byte {error.start} is not valid.") from error
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        lines = text.splitlines()
        place = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)", message)
        what = message[: place.start()] if place else message
        line = int(place[1]) if place and place[1] else len(lines)
        column = f", column {place[2]}" if place and place[2] else ""
        shown = lines[line - 1].strip() if 0 < line <= len(lines) else ""
        raise InputError(f"{file}, line {line}{column}: TOML syntax: {what}, in:  {shown}") from error


def validate(
    model: type[Model], data: dict[str, Any], text: str, source: str, overridden: Collection[str] = ()
) -> Model:
    """Check the contents of a TOML file.

    Args:
        model: what the file is to hold.
        data: its contents.
        text: its text, for line numbers.
        source: what to call the file in messages.
        overridden: paths of the keys that were set from outside the file.

    Returns:
        The contents as a model.

    Raises:
        InputError: there are mistakes; the message lists them, each with its line, key and what would be right.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        mistakes = describe(error.errors(), model, key_lines(text), overridden)
        raise InputError(_report(source, mistakes)) from error


def _report(source: str, mistakes: list[str]) -> str:
    sentences = [text if text.endswith(("?", ".")) else text + "." for text in dict.fromkeys(mistakes)]
    if len(sentences) == 1:
        return f"{source}{', ' if sentences[0].startswith('line ') else ': '}{sentences[0]}"
    more = [f"… and {len(sentences) - _SHOWN} more."] if len(sentences) > _SHOWN else []
    return "\n  - ".join([f"{source}: {len(sentences)} mistakes:", *sentences[:_SHOWN], *more])
