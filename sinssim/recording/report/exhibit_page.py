"""Exhibits as a self-contained HTML page."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from itertools import groupby

from sinssim.charts import Charts
from sinssim.exhibits import Beside, Diagram, Exhibits, Item, Picture, Points, Section, Sentence, Table, Verbatim
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
    """Return the page of a result: HTML; it refers to nothing outside itself."""
    body = [f"<h1>{words(exhibits.heading or exhibits.title)}</h1>", *parts_of(exhibits.items, 2)]
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
                text = f"<pre>{verbatim(item.text)}</pre>"
                yield f"<details><summary>{words(item.title)}</summary>{text}</details>" if item.title else text
            case Picture():
                yield item.svg
            case Points():
                yield f"<ul>{''.join(f'<li>{_marked(text)}</li>' for text in item.texts)}</ul>"
            case Diagram():
                from sinssim.recording import diagrams, figures

                yield figures.to_svg(getattr(diagrams, item.name)(), item.key)
            case Beside():
                inside = "".join(f"<div>{''.join(parts_of([exhibit], level))}</div>" for exhibit in item.items)
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
    """Return a text as HTML, with its lines, bold parts, commands and subscripts, `x_{n}`."""
    if "\n" in text:
        return "<br>".join(map(_marked, text.split("\n")))
    word, colon, rest = text.partition(": ")
    if kind := _MARKS.get(word.lower()):
        return f'<span class="{kind}">{word.lower()}</span>{colon}{_marked(rest)}'
    text = re.sub(r"_\{(.+?)\}", r"<sub>\1</sub>", words(text))
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", text))


def _table(item: Table) -> str:
    columns, _, rows = item.shown("page")
    names, above, begins = _heads(item)

    def cell(tag: str, text: str, number: int, color: str = "") -> str:
        column = columns[number]
        long = column.words and max(map(len, text.split("\n"))) > _LONG
        kinds = ["text" if long else "name"] if column.words else []
        kinds += ["first"] if number in begins else []
        kind = "" if not kinds else f" class={kinds[0]}" if len(kinds) == 1 else f' class="{" ".join(kinds)}"'
        return f"<{tag}{kind}>{swatch(color) if color else ''}{_marked(text)}</{tag}>"

    paint = [css_of(color) for color in item.colors] or [""] * len(rows)
    named = next((k for k, column in enumerate(columns) if column.words), 0)  # the colour stands beside the name
    lines = [
        [cell("td", text, k, color if k == named else "") for k, text in enumerate(row)]
        for row, color in zip(rows, paint, strict=True)
    ]
    if item.shaded:
        _shade(lines, rows, item)
    title = f"<p class=note>{words(item.title)}</p>" if item.title else ""
    note = f'<p class="note">{_marked(item.note)}</p>' if item.note else ""
    return title + page.table([cell("th", name, k) for k, name in enumerate(names)], lines, above=above) + note


def _shade(lines: list[list[str]], rows: list[list[str]], item: Table) -> None:
    """Give the cells of positive numbers a green background, deepest for the least."""
    places = [k for k, column in enumerate(item.columns) if "page" in column.on]
    numbers = {(i, j): float(row[k]) for i, row in enumerate(item.rows) for j, k in enumerate(places)
               if not isinstance(row[k], str) and math.isfinite(row[k]) and row[k] > 0.0}  # type: ignore[arg-type,operator]  # fmt: skip
    low, high = (math.log10(end(numbers.values(), default=1.0)) for end in (min, max))
    for (i, j), value in numbers.items():
        depth = 0.45 * (1.0 - (math.log10(value) - low) / max(high - low, 1e-9))
        lines[i][j] = f'<td style="background:rgba(0,158,115,{depth:.2f})">{rows[i][j]}</td>'


def _heads(item: Table) -> tuple[list[str], str, set[int]]:
    """Return the heads of the columns, the row of common heads above them, and the first columns of groups."""
    columns, heads, _ = item.shown("page")
    names: list[str] = []
    above, begins = "", set[int]()
    for group, pairs in groupby(zip(columns, heads, strict=True), lambda pair: pair[0].group):
        within = [head for _, head in pairs]
        common = {unit for _, unit in within} if group else set()
        shared = f"{group} [{unit}]" if len(common) == 1 and (unit := common.pop()) else group
        begins |= {len(names)} if group else set()
        kind = ' class="group first"' if group else ""
        above += f"<th{kind}{f' colspan={len(within)}' if len(within) > 1 else ''}>{words(shared)}</th>"
        names += [head if shared != group else ", ".join(filter(None, (head, unit))) for head, unit in within]
    return names, f"<tr>{above}</tr>" if begins else "", begins
