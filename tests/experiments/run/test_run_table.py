"""The table of a run's errors."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sinssim.cli import app as cli
from sinssim.experiments.run.error_exhibits import error_text
from sinssim.experiments.run.parts.imu_mounting import Rotation


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1852.0, "1852"),
        (123456.7, "123457"),
        (0.0123456, "0.01235"),
        (1.23456, "1.235"),
        (-12.3456, "-12.35"),
        (1.24e-7, "1.2e-07"),
        (float("inf"), "inf"),
    ],
)
def test_numbers(value: float, text: str) -> None:
    assert error_text(value) == text


def test_the_console_has_the_comparisons_of_the_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The rotating IMU with and without rotation; the sentence is the same in both."""
    short = ("--set", "great_circle.duration_s=600.0", "--set", 'recording.keep="report"')
    with pytest.raises(SystemExit) as stopped:
        cli.main(["run", "rotating_unit", *short, "-o", str(tmp_path / "made")])
    assert stopped.value.code in (0, None)
    out = capsys.readouterr().out
    summary = json.loads((tmp_path / "made" / "summary.json").read_text(encoding="utf-8"))
    report = (tmp_path / "made" / "report.html").read_text(encoding="utf-8")
    (said,) = Rotation(None, entry=summary["rotation"]).brief(summary["algorithms"])  # type: ignore[arg-type]
    sentence = said.text  # type: ignore[union-attr]
    without = summary["rotation"]["without_rotation"]["max_horizontal_error_m"]
    assert f"without the rotation it reaches {without:.4g}" in sentence
    assert " ".join(sentence.split()) in " ".join(out.split())
    assert sentence in report
