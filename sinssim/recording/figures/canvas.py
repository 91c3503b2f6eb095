"""The canvas of every figure: one style, and the ways to write it (SVG, PNG, PDF)."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from sinssim.errors import InputError, RunError
from sinssim.recording import style
from sinssim.system.drafts import draft

_P = ParamSpec("_P")
_R = TypeVar("_R")

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".svg", ".png", ".pdf")
"""File formats of figures."""


_STYLE: dict[str, Any] = {
    "font.size": style.TEXT,
    "axes.titlesize": style.TEXT,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": style.TEXT,
    "figure.titlesize": style.TEXT,
    "figure.titleweight": "bold",
    "xtick.labelsize": style.TEXT,
    "ytick.labelsize": style.TEXT,
    "legend.fontsize": style.SMALL,
    "legend.frameon": False,
    "text.color": style.INK,
    "axes.titlecolor": style.INK,
    "axes.labelcolor": style.SOFT,
    "axes.edgecolor": style.SOFT,
    "xtick.color": style.SOFT,
    "ytick.color": style.SOFT,
    "axes.linewidth": style.HAIR,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.grid.which": "major",
    "grid.color": style.GRID,
    "grid.linewidth": style.HAIR,
    "lines.linewidth": style.LINE,
    "lines.markersize": 5.0,
    "savefig.dpi": 150,
    "svg.fonttype": "none",
}


def styled(draw: Callable[_P, _R]) -> Callable[_P, _R]:
    """Make a function draw in the style of all figures."""

    @wraps(draw)
    def drawn(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        import matplotlib

        with matplotlib.rc_context(_STYLE):
            return draw(*args, **kwargs)

    return drawn


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure; no display is needed.

    Args:
        width, height: inches.

    Returns:
        The figure; its layout is computed when it is written.
    """
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def check_format(path: Path) -> None:
    """Refuse an unknown file format before the figure is drawn.

    Raises:
        InputError: the file has another format.
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: the file name of a figure must end in {', '.join(FORMATS)}.")


def save(figure: Figure, path: Path) -> None:
    """Write a figure to a temporary file and rename it into place.

    Raises:
        InputError: the file has another format.
        RunError: the file cannot be written.
    """
    check_format(path)
    import matplotlib

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        stamp: dict[str, Any] = {"Date": None} if path.suffix.lower() == ".svg" else {}
        with draft(path) as beside, matplotlib.rc_context({**_STYLE, "svg.hashsalt": "sinssim"}):
            figure.savefig(beside, format=path.suffix[1:].lower(), metadata=stamp or None)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error


def to_svg(figure: Figure, name: str) -> str:
    """Return a figure as an SVG element for an HTML page.

    Args:
        name: a name unique on the page, from which the element's inner references are made.

    Returns:
        The element; it refers to nothing outside the page.
    """
    import matplotlib

    text = io.StringIO()
    with matplotlib.rc_context({**_STYLE, "svg.hashsalt": name}):
        figure.savefig(text, format="svg")
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    used = set(re.findall(r'(?:href="|url\()#([^")]+)', svg))
    # Unreferenced identifiers are the same in every figure.
    svg = re.sub(r'\bid="([^"]*)"', lambda match: match[0] if match[1] in used else "", svg)
    return svg.replace("'DejaVu Sans', ", "").replace("DejaVu Sans, ", "")


def to_png(figure: Figure) -> bytes:
    """Return a figure as a picture."""
    import matplotlib

    data = io.BytesIO()
    with matplotlib.rc_context(_STYLE):
        figure.savefig(data, format="png")
    return data.getvalue()
