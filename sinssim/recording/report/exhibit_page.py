"""Exhibits as a self-contained HTML page."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator

from sinssim.charts import Charts
from sinssim.exhibits import Beside, Diagram, Exhibits, Item, Points, Section, Sentence, Table, Verbatim
from sinssim.recording.report import page
from sinssim.recording.report.page import swatch, verbatim, words
from sinssim.recording.report.svg_chart import STYLE, html_of
from sinssim.recording.style import css_of

_CLASSES = {"lead": ' class="lead"', "note": ' class="note"', "warning": ' class="broken"', "strong": "", "": ""}
_LONG = 48
"""Characters from which the words of a cell are broken into lines."""
_MARKS = {
    "met": "met", "not met": "missed", "undecided": "undecided", "confirmed": "met", "partly": "partly",
    "refuted": "missed",
}  # fmt: skip
"""Class of each verdict."""


def page_of(exhibits: Exhibits) -> str:
    """Return the page of a result.

    Returns:
        HTML; it refers to nothing outside itself.
    """
    body = [f"<h1>{words(exhibits.title)}</h1>", *parts_of(exhibits.items, 2)]
    return page.page(exhibits.title, body, STYLE)


def parts_of(items: Iterable[Item], level: int) -> Iterator[str]:
    """Yield exhibits as HTML.

    Args:
        level: of the headings of their sections, 2 below the title of a page.
    """
    for item in items:
        if "page" not in item.on:
            continue
        match item:
            case Charts():
                yield html_of(item)
            case Sentence():
                yield _sentence(item)
            case Table():
                yield _table(item)
            case Verbatim():
                yield f"<details><summary>{words(item.title)}</summary><pre>{verbatim(item.text)}</pre></details>"
            case Points():
                yield f"<ul>{''.join(f'<li>{_marked(text)}</li>' for text in item.texts)}</ul>"
            case Diagram():
                from sinssim.recording import diagrams, figures

                yield figures.to_svg(getattr(diagrams, item.name)(), item.key)
            case Beside():
                inside = "".join(f"<div>{''.join(parts_of([one], level))}</div>" for one in item.items)
                yield f'<div class="pair">{inside}</div>'
            case Section() if item.fold:
                opened = " open" if item.fold == "open" else ""
                inside = "".join(parts_of(item.items, level + 1))
                yield f"<details{opened}><summary>{words(item.title)}</summary>{inside}</details>"
            case Section():
                if item.title:
                    mark = f': <span class="{_MARKS[item.verdict]}">{item.verdict}</span>' if item.verdict else ""
                    yield f"<h{level}>{words(item.title)}{mark}</h{level}>"
                yield from parts_of(item.items, level + 1)


def _sentence(item: Sentence) -> str:
    text = _marked(item.text)
    return f"<p{_CLASSES[item.kind]}>{f'<strong>{text}</strong>' if item.kind == 'strong' else text}</p>"


def _marked(text: str) -> str:
    """Return a text as HTML, with its bold parts, commands and subscripts, `x_{n}`."""
    word, colon, rest = text.partition(": ")
    if kind := _MARKS.get(word.lower()):
        return f'<span class="{kind}">{word.lower()}</span>{colon}{_marked(rest)}'
    text = re.sub(r"_\{(.+?)\}", r"<sub>\1</sub>", words(text))
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", text))


def _table(item: Table) -> str:
    columns, heads, rows = item.shown("page")

    def cell(tag: str, text: str, left: bool) -> str:
        kind = " class=text" if left and len(text) > _LONG else " class=name" if left else ""
        return f"<{tag}{kind}>{_marked(text)}</{tag}>"

    names = [
        cell("th", ", ".join(filter(None, head)), column.words) for column, head in zip(columns, heads, strict=True)
    ]
    lines = [[cell("td", text, column.words) for column, text in zip(columns, row, strict=True)] for row in rows]
    for line, color in zip(lines, item.colors, strict=False):
        line[0] = line[0].replace(">", f">{swatch(css_of(color))}", 1)
    if item.shaded:
        _shade(lines, rows, item)
    title = f"<p class=note>{words(item.title)}</p>" if item.title else ""
    note = f'<p class="note">{_marked(item.note)}</p>' if item.note else ""
    return title + page.table(names, lines) + note


def _shade(lines: list[list[str]], rows: list[list[str]], item: Table) -> None:
    """Give the cells of positive numbers a green background, deepest for the least."""
    places = [k for k, column in enumerate(item.columns) if "page" in column.on]
    numbers = {(i, j): float(row[k]) for i, row in enumerate(item.rows) for j, k in enumerate(places)
               if not isinstance(row[k], str) and math.isfinite(row[k]) and row[k] > 0.0}  # type: ignore[arg-type,operator]  # fmt: skip
    low, high = (math.log10(end(numbers.values(), default=1.0)) for end in (min, max))
    for (i, j), value in numbers.items():
        depth = 0.45 * (1.0 - (math.log10(value) - low) / max(high - low, 1e-9))
        lines[i][j] = f'<td style="background:rgba(0,158,115,{depth:.2f})">{rows[i][j]}</td>'
