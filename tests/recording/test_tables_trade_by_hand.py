"""The tables of a trade study on the console, from numbers written by hand: which ones, their order, whole lines."""

from __future__ import annotations

from pathlib import Path

from sinssim.experiments.studies.trade_exhibits import exhibits_of
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_run import TradeMedia
from sinssim.recording.console import show
from tests.experiments.studies.trades_by_hand import ASK, OTHER, RISING, UNITS, made, without
from tests.recording.by_hand import plain_text, printed


def test_grids_cells_and_requirements(tmp_path: Path) -> None:
    """A grid of each drawn quantity, all cells at the end and at 30 s, the requirements, the definitions."""
    result = without(made(tmp_path, draw=("r95(end)", "cep(30 s)")), 5)
    lines = printed(lambda console: show(exhibits_of(result), console))
    heads = "gyro bias σ CEP R95 rate v north v east tilt n tilt e heading"
    units = "cell unit deg/h m m nmi/h mm/s mm/s arcsec arcsec arcsec"
    numbers = {
        1: "50.0 100 0.100 1.00 2.00 3.00 4.00 10.0", 6: "300 600 0.600 6.00 12.0 18.0 24.0 60.0",
    }  # fmt: skip
    assert lines[0].startswith("small: 6 covariance budgets of standing.toml: 2 values of unit × 3 values of gyro bias")
    assert lines[1:9] == [
        f"R95 at the end, m; * meets {ASK[0]}", "unit \\ gyro bias σ, deg/h 0.02 0.01 0.05", "A 100 * 200 * 300 *",
        "B 400 failed 600", "CEP at 30 s, m", "unit \\ gyro bias σ, deg/h 0.02 0.01 0.05", "A 16.7 33.3 50.0",
        "B 66.7 failed 100",
    ]  # fmt: skip
    start = lines.index("At the end")
    assert lines[start + 1 : start + 4] == [heads, units, f"1 A 0.02 {numbers[1]}"]
    assert lines[start + 7 : start + 9] == ["5 B 0.01 failed", f"6 B 0.05 {numbers[6]}"]
    verdicts = lines.index("Verdicts")
    assert lines[verdicts + 8] == "6 B 0.05 NOT MET NOT MET: 200 m at 30 s NOT MET: 60.0 arcsec at 45 s"
    one = made(tmp_path, draw=("r95(end)",))
    few = TradeResult(one.study.model_copy(update={"require": ASK[:1]}), one.cells, media=TradeMedia())
    lines = printed(lambda console: show(exhibits_of(few), console))
    start = lines.index("At the end")
    assert lines[start + 1 : start + 4] == [f"{heads} r95(end)", f"{units} <= 0.3 km", f"1 A 0.02 {numbers[1]} met"]
    lines = printed(lambda console: show(exhibits_of(result), console))
    later = lines.index("At 30 s")
    assert lines[later + 1 : later + 4] == [heads, units, "1 A 0.02 16.7 33.3 0.0333 0.333 0.667 1.00 1.33 3.33"]
    assert lines[later + 9].startswith(f"{ASK[0]}: met in 3 of 5 cells (")
    assert lines[later + 13] == "cell 5, unit B, gyro bias σ 0.01 deg/h: failed: it fell."
    assert lines[later + 14] == "CEP, R95: radius of the circle that contains half, or 95 %, of all runs."


def test_at_most_four_grids_and_none_that_is_too_wide(tmp_path: Path) -> None:
    """Two grids of each of three quantities: four are shown; an axis of eleven values has none."""
    asked = ("r95(end)", "cep(end)", "rate(end)")
    lines = printed(lambda console: show(exhibits_of(made(tmp_path, (OTHER, UNITS, RISING), draw=asked)), console))
    titles = [line for line in lines if ": accel bias σ " in line and " at the end, " in line]
    assert titles == [f"R95 at the end, m: accel bias σ 10 µg; * meets {ASK[0]}",
                      f"R95 at the end, m: accel bias σ 25 µg; * meets {ASK[0]}",
                      "CEP at the end, m: accel bias σ 10 µg", "CEP at the end, m: accel bias σ 25 µg"]  # fmt: skip
    many = {"key": RISING["key"], "values": tuple(k / 100.0 for k in range(1, 12))}
    wide = printed(lambda console: show(exhibits_of(made(tmp_path, (UNITS, many))), console))
    assert not any("\\" in line for line in wide)
    ten = printed(
        lambda console: show(exhibits_of(made(tmp_path, (UNITS, many | {"values": many["values"][:10]}))), console)
    )
    assert any("\\" in line for line in ten)


def test_verdicts_have_a_table_of_their_own_where_there_is_no_room(tmp_path: Path) -> None:
    text = plain_text(lambda console: show(exhibits_of(made(tmp_path)), console))
    lines = [" ".join(line.split()) for line in text.splitlines()]
    start = lines.index("Verdicts")
    assert lines[start + 2] == "gyro bias σ r95(end) r95(30 s) heading(run)"
    assert lines[start + 3] == "cell unit deg/h <= 0.3 km <= 100 m <= 30 arcsec"
    assert lines[start + 5] == "1 A 0.02 met met: 33.3 m at 30 s met: 10.0 arcsec at 45 s"
