"""The tables of a trade study on the console."""

from __future__ import annotations

import re
from pathlib import Path

from sinssim.experiments.studies.trade_exhibits import exhibits_of
from sinssim.recording.console import show
from tests.experiments.studies.test_trade_figure import made
from tests.experiments.studies.trade_examples import ACCEL, AXES, BIAS
from tests.recording.by_hand import plain_text


def test_grid_cells_and_requirements(tmp_path: Path) -> None:
    text = plain_text(lambda console: show(exhibits_of(made(tmp_path, *AXES)), console))
    assert re.search(r"laser-navigation +10\.0 \* +20\.0 \* +30\.0 \*", text)
    assert re.search(r"^ 4 +laser-standard +0\.001 .* NOT MET", text, re.MULTILINE)
    assert "r95(end) <= 35.0 m: met in 3 of 6 cells" in text
    assert "…" not in text


def test_no_digit_is_cut_off(tmp_path: Path) -> None:
    """Wide tables widen the console; verdicts get a table of their own."""
    wide = ({"key": BIAS, "values": (0.01, 0.02), "labels": ("a very long name of a unit", "another very long name")},
            {"key": ACCEL, "values": (10.0, 20.0), "label": "an accelerometer's bias of unusual size"})  # fmt: skip
    text = plain_text(lambda console: show(exhibits_of(made(tmp_path, *wide)), console))
    assert "…" not in text
    assert text.count("a very long name of a unit") >= 5
    assert "Verdicts" in text


def test_many_cells_are_counted(tmp_path: Path) -> None:
    many = ({"key": BIAS, "values": tuple(k / 100.0 for k in range(1, 51))},)
    text = plain_text(lambda console: show(exhibits_of(made(tmp_path, *many)), console))
    assert "… and 10 more cells, in summary.md and report.html." in text
    assert "numbers 1–3" not in text  # three are named by their values
    assert "met in 3 of 50 cells (gyro bias σ 0.01 deg/h; " in text
