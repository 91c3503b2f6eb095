"""Short texts for objects that hold arrays, on the console and in notebooks: shapes and spans instead of numbers."""

from __future__ import annotations

import dataclasses
import html
import inspect
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sinssim.errors import shortened

C = TypeVar("C", bound=type)

_FEW, _WIDTH, _LINES = 4, 100, 10
_NAME = re.compile(r"^    ((?:\w+, )*\w+): (.*)$")


def short_repr(kind: C) -> C:
    """Give a dataclass a short `repr`, and a table for notebooks with the meaning of each attribute from its
    docstring."""
    for name, function in (("__repr__", _repr), ("_repr_html_", _html)):
        if name not in vars(kind) or name == "__repr__":
            setattr(kind, name, function)
    return kind


def described(value: Any) -> str:
    """Return a value in a few words: for an array its shape and span, such as "1201 × 3 array, -0.5 … 2"; for a short
    one its numbers."""
    match value:
        case np.ndarray():
            return _array(value)
        case bool() | None:
            return str(value)
        case int() | float() | np.generic():
            return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)
        case str() | Path():
            return shortened(repr(str(value)), 60)
        case Mapping():
            return f"{{{_items([repr(key) for key in value])}}}"
        case tuple() | list():
            if any(dataclasses.is_dataclass(item) or hasattr(type(item), "model_fields") for item in value):
                kinds = sorted({type(item).__name__ for item in value})
                return f"{len(value)} × {' or '.join(kinds)}"
            return f"({_items([described(item) for item in value])})"
    name = type(value).__name__
    plain = inspect.getattr_static(value, "__repr__", None) is object.__repr__
    if dataclasses.is_dataclass(value) or hasattr(type(value), "model_fields") or plain:
        return f"{name}(…)"
    return shortened(repr(value).replace("\n", " "), 60)


def html_table(title: str, rows: Sequence[tuple[str, ...]], heads: tuple[str, ...] = ()) -> str:
    """Return a table for a notebook."""

    def row(cells: tuple[str, ...], tag: str) -> str:
        shown = (f'<{tag} style="text-align: left">{html.escape(cell)}</{tag}>' for cell in cells)
        return f"<tr>{''.join(shown)}</tr>"

    lines = [row(heads, "th")] if heads else []
    return f"<b>{html.escape(title)}</b><table>{''.join([*lines, *(row(item, 'td') for item in rows)])}</table>"


def html_lines(lines: Iterable[str]) -> str:
    """Return lines of text for a notebook, with their columns."""
    return f"<pre>{html.escape(chr(10).join(lines))}</pre>"


def _array(value: Any) -> str:
    if value.ndim <= 1 and value.size <= _FEW:
        return (
            f"[{', '.join(described(item) for item in np.atleast_1d(value).tolist())}]"
            if value.ndim
            else described(value.item())
        )
    shape = " × ".join(map(str, value.shape))
    if value.dtype.kind not in "fiu" or not value.size:
        return f"{shape} array"
    if value.dtype.kind == "f":
        there = value[np.isfinite(value)]
        if not there.size:
            return f"{shape} array, no finite number"
        value = there
    return f"{shape} array, {value.min():.6g} … {value.max():.6g}"


def _items(texts: list[str]) -> str:
    return ", ".join([*texts[:_FEW], *([f"… {len(texts)} in all"] if len(texts) > _FEW else [])])


def _fields(item: Any) -> Iterator[tuple[str, str]]:
    for field in dataclasses.fields(item):
        if field.repr and not field.name.startswith("_"):
            yield field.name, described(getattr(item, field.name))


def _repr(self: Any) -> str:
    text = ", ".join(f"{name}={value}" for name, value in _fields(self))
    lines = textwrap.wrap(f"{type(self).__name__}({text})", _WIDTH, subsequent_indent="    ", break_long_words=False)
    if len(lines) > _LINES:
        lines = [*lines[: _LINES - 1], "    …)"]
    return "\n".join(lines)


def _html(self: Any) -> str:
    meanings = _meanings(type(self))
    return html_table(type(self).__name__, [(name, value, meanings.get(name, "")) for name, value in _fields(self)])


def _meanings(kind: type) -> dict[str, str]:
    """Return what the attributes of a class are, from its docstring."""
    texts: dict[str, str] = {}
    names: list[str] = []
    _, _, attributes = (inspect.getdoc(kind) or "").partition("Attributes:\n")
    for line in attributes.splitlines():
        if match := _NAME.match(line):
            names = match[1].split(", ")
            texts |= dict.fromkeys(names, match[2])
        elif not line.strip():
            break
        else:
            texts |= {name: f"{texts[name]} {line.strip()}" for name in names}
    return texts
