"""A self-contained HTML page: frame and style, tables and text."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Sequence

from sinssim.recording.style import GRID, INK, SOFT

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
.pair > div td.text { min-width: 9rem; }
@media screen and (max-width: 820px) { .pair { grid-template-columns: minmax(0, 1fr); } }
.broken { border-left: 5px solid #b03a00; padding: .4rem 1rem; max-width: none; background: var(--head); }
th.group { text-align: center; } .first { border-left: 1px solid var(--line); }
.wide { overflow-x: auto; } svg { max-width: 100%; height: auto; display: block; }
svg text { font-family: system-ui, "Segoe UI", "Liberation Sans", Arial, sans-serif !important; }
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
    + "".join(
        f'svg [style*="{paint}: {color}"] {{ {paint}: var(--{name}) !important; }}\n'
        # the figures of matplotlib are drawn for paper: their paper, ink, axes and grid become those of the page
        for name, color in (("paper", "#ffffff"), ("ink", INK), ("soft", SOFT), ("hair", GRID))
        for paint in ("fill", "stroke")
    )
)


_BLANKS = re.compile(r"[ \t\r\n\f\v]+")


def page(title: str, body: Iterable[str], style: str = "") -> str:
    """Return a whole page: HTML; it refers to nothing outside itself.

    Args:
        title: title in the browser's tab.
    """
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{words(title)}</title><style>{_STYLE}{style}</style></head>\n<body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def words(text: str) -> str:
    """Return a text as HTML with runs of white space reduced to single blanks; a blank that does not break stays."""
    return html.escape(_BLANKS.sub(" ", text).strip(" "))


def verbatim(text: str) -> str:
    """Return a text as HTML, white space unchanged."""
    return html.escape(text, quote=False)


def table(heads: Sequence[str], lines: Iterable[Sequence[str]], names: int = 1, above: str = "") -> str:
    """Return a table.

    Args:
        heads: HTML of the column heads; a complete `<th…>` is used unchanged.
        lines: HTML of the cells, row by row; a complete `<td…>` is used unchanged.
        names: number of columns, from the left, that hold words instead of numbers.
        above: an additional row of heads above, a complete `<tr>`.
    """

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
