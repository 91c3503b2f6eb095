"""Tables and sentences of an ensemble's report from numbers that are chosen."""

from __future__ import annotations

from math import nan
from typing import Any

import pytest

from sinssim.experiments.ensembles import ensemble_report as report
from tests.recording.made_ensemble import ARCMIN, NUMBERS, Result
from tests.recording.spies import cells, read

RESULT: Any = Result()


def test_circles_and_rates() -> None:
    """Lengths in the given unit, here half a metre; rates in nmi/h."""
    assert cells(report.headline(NUMBERS, ("halves", 0.5))) == [
        ["", "CEP, 50 % of the runs (95 % band)", "R95, 95 % of the runs (95 % band)"],
        ["horizontal error at 60 s, halves", "9.00 (6.00 … 17.0)", "26.0 (20.0 … 34.0)"],
        ["horizontal error at the end, halves", "84.0 (70.0 … 120)", "180 (150 … ∞)"],
        ["rate, line through the origin Σ t r / Σ t², nmi/h", "0.270 (0.220 … 0.330)", "0.580 (0.480 … 0.730)"],
        ["rate at the end r(T) / T, nmi/h", "0.370 (0.320 … 0.430)", "0.680 (0.610 … 0.830)"],
        ["circle of a normal distribution with the covariance at the end, halves", "88.0", "191"],
    ]


def test_the_regulation() -> None:
    assert report.regulation(NUMBERS) == (
        "14 CFR Part 121: met, with 95 % confidence. Rate of all: 0.270 (0.220 … 0.330), limit 2.5; CEP: 1.50 (1.25 … "
        "1.75), limit 4."
    )
    for verdict, words in (
        ("not met", "not met, with 95 % confidence."),
        ("undecided", "undecided: the limit lies within the confidence interval; more runs narrow it."),
        ("does not apply", "it does not apply, because it is short."),
    ):
        part = {"rule": "R", "verdict": verdict, "quantities": {}, "reason": "it is short"}
        assert report.regulation({"part_121": part}) == f"R: {words}"


def test_what_the_ensemble_is_of() -> None:
    assert report.opening(RESULT, NUMBERS) == (
        "Solution: aided. Seed 17. Each run lasts 300 s; its errors are kept at 3 epochs. Varied from run to run: "
        "imu.a, imu.b. R95 has no upper bound with fewer than 72 runs. 1 of 5 runs failed; their errors are treated as "
        "infinite. The ensemble was interrupted; the report shows the finished runs."
    )
    whole = {**NUMBERS, "status": "finished", "failed": 0}
    assert report.opening(RESULT, whole).endswith("with fewer than 72 runs.")
    assert "The ensemble failed;" in report.opening(RESULT, {**NUMBERS, "status": "failed"})


def test_components_in_their_units() -> None:
    units = [("km", 1e3), ("mm/s", 1e-3), ("arcmin", ARCMIN)]
    one = {}
    for k, size in enumerate([1.0] * 3 + [1e-3] * 3 + [ARCMIN] * 3, start=1):
        values = (-k if k < 4 else k, 2.0 * k, 0.5 * k if k < 4 else 0.25, 3.0 * k if k < 4 else 4.0 * k)
        keys = ("final_mean", "final_sigma", "final_sigma_standard_error", "rms")
        one[f"c{k}"] = {key: value * size for key, value in zip(keys, values, strict=True)}
    rows = cells(report._components({"components": one}, units))
    assert rows[0] == ["", "unit", "mean at the end", "σ at the end ± standard error", "rms over runs and epochs"]
    assert rows[1] == ["position, north", "km", "−0.00100", "0.00200 ± 0.00050", "0.00300"]
    assert rows[3] == ["position, down", "km", "−0.00300", "0.0060 ± 0.0015", "0.00900"]
    assert rows[5] == ["velocity, east", "mm/s", "5.00", "10.00 ± 0.25", "20.0"]
    assert rows[9] == ["attitude φ, down", "arcmin", "9.00", "18.00 ± 0.25", "36.0"]
    assert [row[0].partition(", ")[2] for row in rows[1:]] == ["north", "east", "down"] * 3


def test_consistency(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report, "to_svg", lambda figure, name: f"({name}: {figure})")
    monkeypatch.setattr(
        report.figures, "consistency", lambda result, squares, title: f"{title} of {', '.join(squares)}"
    )
    monkeypatch.setattr(report, "consistency_sentences", lambda numbers: ["It is <right>."])
    square = {"mean": 1.25, "end": 0.75, "low": 0.5, "high": 1.75, "share_in_band": 0.875}
    other = {**square, "end": 3.5, "share_in_band": nan}
    html = "".join(report._consistency(RESULT, {"nees": {"attitude": square}, "nis": {"gnss": other}}))
    heads = ["", "mean over all epochs", "at the last epoch", "95 % band there", "epochs within the band"]
    assert cells(html) == [
        heads, ["attitude", "1.25", "0.750", "0.500 … 1.75", "88 %"], heads,
        ["gnss", "1.25", "3.50", "0.500 … 1.75", "–"],
    ]  # fmt: skip
    text = read(html)
    assert "It is &lt;right&gt;." in text
    assert text.index("ANEES by block of states (nees: NEES / n of attitude)") < text.index(
        "NIS by sensor (nis: NIS / n of baro, gnss)"
    )


def test_runs_to_examine_and_failures() -> None:
    assert cells(report._runs(RESULT, NUMBERS)) == [
        ["", "run", "rate Σ t r / Σ t², nmi/h", "final, m", "command for the complete run"],
        ["the &lt;worst&gt;", "3", "0.750", "52.2", "sinssim run &lt;3&gt;"],
        ["median", "2", "failed", "–", "sinssim run &lt;2&gt;"],
    ]
    assert cells(report._failures(RESULT)) == [["run", "seed", "reason"], ["2", "1002", "it &lt;fell&gt; over."]]
    many: Any = Result()
    many.failures = {k: f"reason {k}" for k in range(57)}
    html = report._failures(many)
    assert "and 7 more" in html
    assert cells(html)[-1] == ["49", "1049", "reason 49"]


def test_how_it_was_computed() -> None:
    text = read(report._method(RESULT, {}, {"sinssim": "9.8", "numpy": "<7>"}))
    assert "3 runs were computed in 12.3 s by this call." in text
    assert text.endswith("sinssim 9.8, numpy &lt;7&gt;")
    assert len(cells(report.definitions())) > 5
