"""The canvas of all figures: one style, and files that are whole."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import LineCollection

import sinssim
from sinssim.charts import Axis, Chart, Charts, Dots, Line
from sinssim.errors import InputError
from sinssim.recording import style
from sinssim.recording.figures import figure_of, new_figure, save, styled, to_png
from sinssim.units import fixed

PACKAGE = Path(sinssim.__file__).parent
DRAWING = sorted(
    file
    for file in (*(PACKAGE / "recording").glob("*.py"), *(PACKAGE.parent / "scenarios").rglob("*.py"))
    if "new_figure(" in file.read_text("utf-8")
)


@styled
def drawn():
    figure = new_figure(3.0, 2.0)
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0])
    axes.set(title="title", xlabel="time [s]")
    return figure


def test_the_style_is_that_of_the_reports_plots_and_stays_in_the_figure() -> None:
    (axes,) = drawn().axes
    (line,) = axes.lines
    assert line.get_linewidth() == style.LINE
    assert axes.title.get_fontsize() == axes.xaxis.label.get_fontsize() == style.TEXT
    assert axes.get_xgridlines()[0].get_color() == style.GRID
    assert not axes.spines["top"].get_visible()
    assert matplotlib.rcParams["axes.titleweight"] != "bold"


def test_error_bars_are_in_the_unit_of_their_axis() -> None:
    dots = Dots(x=np.array([2000.0]), y=np.array([0.5]), error=np.array([300.0]))
    chart = Chart(key="k", x=Axis(units=fixed("km", 1e3)), y=Axis(), marks=(dots,))
    (axes,) = figure_of(Charts("k", ((chart,),), (3.0, 2.0))).axes
    (bars,) = (part for part in axes.collections if isinstance(part, LineCollection))
    np.testing.assert_allclose(bars.get_segments(), [[[1.7, 0.5], [2.3, 0.5]]], rtol=1e-14)


def test_dots_have_their_diameter_and_lines_their_weight() -> None:
    """The size of a dot is the square of its diameter in points; a usual line is 1.5 px = 1.125 points wide."""
    ends, weights = np.array([0.0, 1.0]), {"broad": 6.75, "wide": 3.9375, "bold": 2.25, "line": 1.125, "thin": 0.8}
    dots = Dots(x=ends, y=ends, size=3.0)
    lines = (Line(x=ends, y=ends, weight=weight, marker="o") for weight in weights)  # type: ignore[arg-type]
    chart = Chart(key="k", x=Axis(), y=Axis(), marks=(dots, *lines))
    (axes,) = figure_of(Charts("k", ((chart,),), (3.0, 2.0))).axes
    assert [part.get_sizes().tolist() for part in axes.collections] == [[9.0]]
    assert [line.get_linewidth() for line in axes.lines] == pytest.approx([*weights.values()])
    assert {line.get_markersize() for line in axes.lines} == {5.0}


def test_one_figure_as_svg_png_and_pdf(tmp_path: Path) -> None:
    for suffix, begin in (("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")):
        save(drawn(), tmp_path / "new" / f"line.{suffix}")
        assert (tmp_path / "new" / f"line.{suffix}").read_bytes().startswith(begin)
    assert to_png(drawn()).startswith(b"\x89PNG")
    assert ">time [s]<" in (tmp_path / "new" / "line.svg").read_text(encoding="utf-8")


def test_pictures_of_known_size_without_a_date(tmp_path: Path) -> None:
    """3 in by 2 in at 150 points an inch, in every form; two files of one figure have the same bytes."""
    save(drawn(), tmp_path / "line.png")
    for data in (to_png(drawn()), (tmp_path / "line.png").read_bytes()):
        assert struct.unpack(">II", data[16:24]) == (450, 300)  # of the header of a PNG file
    for name in ("one.svg", "two.svg"):
        save(drawn(), tmp_path / name)
    one, two = ((tmp_path / name).read_text(encoding="utf-8") for name in ("one.svg", "two.svg"))
    assert one == two
    assert "dc:date" not in one
    assert 'width="216pt" height="144pt"' in one
    for wrong in ("line.gif", "line"):
        with pytest.raises(InputError, match=r"must end in \.svg, \.png, \.pdf"):
            save(drawn(), tmp_path / wrong)


@pytest.mark.parametrize("file", DRAWING, ids=lambda file: file.stem)
def test_every_figure_takes_its_style_from_one_place(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    own = re.findall(r"fontsize=\d|linewidths?=\d|\blw=\d|#[0-9a-fA-F]{6}|Figure\(figsize|axes\.grid\(True", text)
    one_place = {"Figure(figsize"} if file.name == "figures.py" else set()
    assert set(own) <= {"lw=0", *one_place}  # the edge of a band has none
    labels = re.findall(r'label="([^"]*)"', text)
    units = ("arcmin", "arcsec", "°", "s", "m", "Hz", "deg/s")
    assert not [label for label in labels if label.rpartition(", ")[2] in units and ", " in label]
