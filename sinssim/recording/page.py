"""Exhibits as a self-contained HTML page: frame and style, text, tables and sections."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from sinssim.charts import Charts
from sinssim.exhibits import Beside, Exhibits, Interactive, Item, Picture, Points, Section, Sentence, Table, Verbatim
from sinssim.recording.live_chart import interactive, policy, with_scripts
from sinssim.recording.style import GRID, INK, SOFT, css_of
from sinssim.recording.svg import words
from sinssim.recording.svg_chart import STYLE, html_of

_STYLE = (
    f"""
:root {{ color-scheme: light dark; --paper: #fff; --ink: {INK}; --soft: {SOFT}; --line: #ccc; --hair: {GRID};
  --head: #f4f4f4; --good: #00735a; --bad: #b03a00; --fair: #8a6100; }}
"""
    + """\
@media (prefers-color-scheme: dark) { :root { --paper: #16181b; --ink: #e6e6e6; --soft: #a6a9ad; --line: #4a4d52;
  --hair: #303338; --head: #22252a; --good: #4cc9a0; --bad: #ff9462;
  --fair: #e0b44c; } }
@media print { :root { color-scheme: light; --paper: #fff; --ink: #000; --soft: #444; --line: #bbb; --hair: #ddd;
  --head: #f2f2f2; --good: #00735a; --bad: #b03a00; --fair: #8a6100; } }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, -apple-system, "Segoe UI", "Liberation Sans", Arial, sans-serif; color: var(--ink);
  background: var(--paper); max-width: 1180px; margin: 2rem auto 5rem; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem; } h2 { margin-top: 3rem; border-bottom: 1px solid var(--line); }
h3 { margin: 1.8rem 0 .4rem; font-size: 1.02rem; }
pre { background: var(--head); padding: .8rem 1rem; font-size: .78rem; line-height: 1.45; columns: 3 19rem;
  white-space: pre-wrap; overflow-wrap: anywhere; }
summary { margin: 1rem 0 .2rem; font-weight: 600; cursor: pointer; }
p { max-width: 52rem; } .lead { font-size: 1.08rem; } .note { color: var(--soft); font-size: .9rem; }
table { border-collapse: collapse; font-size: .82rem; margin: .6rem 0 1.2rem; font-variant-numeric: tabular-nums; }
th, td { padding: .18rem .6rem; text-align: right; border-bottom: 1px solid var(--hair); white-space: nowrap; }
th { background: var(--head); font-weight: 600; white-space: normal; } td.name, th.name { text-align: left; }
td.text, td.text ul { text-align: left; white-space: normal; } td.text { min-width: 16rem; }
td.text ul { margin: .2rem 0; padding-left: 1.1rem; }
code { font-family: ui-monospace, "Liberation Mono", monospace; font-size: .92em; overflow-wrap: anywhere; }
.pair { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 1.2rem 1.4rem; align-items: start; }
.pair > div > table:first-child, .pair .wide:first-child table { margin-top: 0; }
.pair > div td.text { min-width: 9rem; } .pair td, .pair th { white-space: normal; padding: .18rem .4rem; }
.pair td.name:first-child { min-width: 8.5rem; }
@media screen and (max-width: 900px) { .pair { grid-template-columns: minmax(0, 1fr); }
  .pair svg[role] { width: 100%; max-width: 44rem; } }
.broken { border-left: 5px solid #b03a00; padding: .4rem 1rem; max-width: none; background: var(--head); }
th.group { text-align: center; } .first { border-left: 1px solid var(--line); }
.wide { overflow-x: auto; } .wide:focus-visible { outline: 2px solid var(--soft); }
svg { max-width: 100%; height: auto; display: block; }
svg text { font-family: system-ui, "Segoe UI", "Liberation Sans", Arial, sans-serif; }
.met { color: var(--good); font-weight: 600; } .missed { color: var(--bad); font-weight: 600; }
.partly { color: var(--fair); font-weight: 600; } .undecided { font-weight: 600; }
ul { max-width: 60rem; margin: .3rem 0; } li { margin: .15rem 0; }
.swatch { display: inline-block; width: .7rem; height: .7rem; border-radius: 2px; margin-right: .4rem;
  print-color-adjust: exact; -webkit-print-color-adjust: exact; }
@page { margin: 14mm; }
@media print { body { max-width: none; margin: 0; padding: 0; font-size: 10pt; } h2 { margin-top: 1.6rem; }
  pre { font-size: 7pt; columns: 2; } .wide { overflow: visible; } h2, h3 { break-after: avoid; }
  svg, tr { break-inside: avoid; } }
"""
)


def page(title: str, body: Iterable[str], style: str = "", *, asks: bool = False) -> str:
    """Return a whole page, HTML, with its title in the browser's tab; it refers to nothing outside itself. Its script
    may ask the server of the page if it `asks`."""
    parts = list(body)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy(parts, asks=asks)}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{words(title)}</title><style>{_STYLE}{style}</style></head>\n<body><main>\n"
        + "\n".join(parts)
        + "\n</main></body></html>\n"
    )


def verbatim(text: str) -> str:
    """Return a text as HTML, white space unchanged."""
    return html.escape(text, quote=False)


def table(heads: Sequence[str], lines: Iterable[Sequence[str]], names: int = 1, above: str = "") -> str:
    """Return a table of HTML heads and cells, of which a complete `<th…>` or `<td…>` is used unchanged; the first
    `names` columns hold words instead of numbers, and `above` is an additional row of heads, a complete `<tr>`."""

    def cells(tag: str, values: Sequence[str]) -> str:
        return "".join(
            value if value.startswith(f"<{tag}") else f"<{tag}{' class=name' if i < names else ''}>{value}</{tag}>"
            for i, value in enumerate(values)
        )

    rows = "\n".join(f"<tr>{cells('td', line)}</tr>" for line in lines)
    return (
        f'<div class="wide"><table><thead>{above}<tr>{cells("th", heads)}</tr></thead><tbody>\n'
        f"{rows}\n</tbody></table></div>"
    )


def swatch(color: str) -> str:
    """Return a small square of a colour, to be placed before a name."""
    return f'<span class="swatch" style="background:{color}"></span>'


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
    return page(exhibits.title, with_scripts(body), STYLE)


def parts_of(items: Iterable[Item], level: int) -> Iterator[str]:
    """Yield exhibits as HTML. `level`: of the headings of their sections, 2 below the title of a page."""
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
                yield item.draw()
            case Interactive():
                yield interactive(item)
            case Points():
                yield f"<ul>{''.join(f'<li>{_marked(text)}</li>' for text in item.texts)}</ul>"
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
    return title + table([cell("th", name, k) for k, name in enumerate(names)], lines, above=above) + note


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
