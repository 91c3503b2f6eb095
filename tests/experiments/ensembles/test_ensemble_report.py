"""The report, the figures and the numbers of an ensemble, as files."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

import sinssim
from sinssim.experiments.ensembles.ensemble_exhibits import (
    _with_band,
    _with_error,
    exhibits_of,
    scales_of,
    write_ensemble,
)
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult
from sinssim.experiments.ensembles.ensemble_run import EnsembleMedia
from sinssim.experiments.ensembles.ensemble_summary import ensemble_numbers
from sinssim.recording.page import page_of
from sinssim.statistics.percentiles import Percentile
from tests.experiments.ensembles.examples import AIDED, scenario
from tests.recording.drawn import figure, words


@pytest.fixture(scope="module")
def with_failures() -> EnsembleResult:
    vary = ({"type": "normal", "key": "parked.roll_deg", "mean": 0.0, "sigma": 150.0},)
    result = sinssim.ensemble(scenario(ensemble={"vary": vary, "epoch_s": 1.0}), 80)
    assert 0 < result.failed.sum() < 40
    return result


@pytest.fixture(scope="module")
def filtered() -> EnsembleResult:
    return sinssim.ensemble(scenario(AIDED), 6, threads=1)


class _Text(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.text = ""

    def handle_data(self, data: str) -> None:
        self.text += data


def _words(page: str) -> str:
    parser = _Text()
    parser.feed(re.sub(r"<style>.*?</style>|<svg.*?</svg>", "", page, flags=re.DOTALL))
    return " ".join(parser.text.split())


def test_report_of_an_ensemble_with_failures(with_failures: EnsembleResult, tmp_path) -> None:
    names = write_ensemble(with_failures, tmp_path)
    assert sorted(names) == sorted(file.name for file in tmp_path.iterdir())
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    text, failed = _words(page), int(with_failures.failed.sum())
    assert f"{failed} of 80 runs failed; their errors are treated as infinite" in text
    assert "parked.roll_deg" in text
    for number in with_failures.ranking[:5].tolist():
        assert with_failures.command(number) in text
    assert "Σ t r / Σ t²" in text
    assert "order statistics" in text
    assert "14 CFR Part 121, Appendix G" in text
    assert not re.search(r'(?:src|href)="(?!#)', page)  # nothing outside the page
    numbers = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert len(numbers["failures"]) == failed
    assert numbers["final_horizontal_m"]["r95"]["value"] is None  # infinite: more than 5 % failed
    assert numbers["final_horizontal_m"]["cep"]["value"] == pytest.approx(with_failures.cep.value[-1])


def test_report_of_a_filter(filtered: EnsembleResult, tmp_path) -> None:
    write_ensemble(filtered, tmp_path, "interrupted")
    text = _words((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "The ensemble was interrupted" in text
    assert "ANEES by block of states" in text
    assert "gnss-velocity" in text
    assert "no upper bound with fewer than 72 runs" in text
    numbers = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert set(numbers["nees"]) == set(filtered.plan.blocks)
    assert 0.5 < numbers["nis"]["gnss-position"]["mean"] < 1.5


def test_figures_say_what_they_show(with_failures: EnsembleResult, filtered: EnsembleResult) -> None:
    for result in (with_failures, filtered):
        left, right = result.plot().axes
        assert "horizontal error" in left.get_ylabel()
        assert "[" in left.get_xlabel()
        assert (right.get_xlabel()[:4], right.get_ylabel()[:5]) == ("east", "north")
    panels = figure(filtered.exhibits, "components").axes
    assert len(panels) == 9
    assert all(axes.get_ylabel() for axes in panels)
    (stated,) = [line for line in panels[0].lines if "stated" in str(line.get_label())]
    sigma = filtered.errors.sigma
    assert sigma is not None
    assert panels[0].get_ylabel() == "m"
    np.testing.assert_allclose(stated.get_ydata(), np.sqrt(np.mean(sigma[:, :, 0] ** 2, axis=0)), rtol=1e-12)
    assert [words(axes)[0] for axes in figure(filtered.exhibits, "neess").axes] == list(filtered.plan.blocks)


def test_tables_and_figures_have_the_same_units(filtered: EnsembleResult) -> None:
    expected = [scale[0][0] for scale in scales_of(filtered) for _ in range(3)]
    exhibits = exhibits_of(filtered, ensemble_numbers(filtered))
    assert [axes.get_ylabel() for axes in figure(exhibits, "components").axes] == expected
    text = page_of(exhibits)
    assert re.findall(r"(?:position|velocity|attitude φ), \w+</t.><td[^>]*>([^<]+)</td>", text) == expected


def test_a_value_has_the_decimals_of_its_standard_error() -> None:
    assert _with_error(0.6174, 0.1312) == "0.62 ± 0.13"
    assert _with_error(214.4, 44.2) == "214 ± 44"
    assert _with_error(0.5, 0.0) == "0.500 ± 0"
    assert _with_error(0.5, float("inf")) == "0.500 ± –"


def test_percentiles_with_bands_as_text() -> None:
    assert (
        _with_band(Percentile(0.5, np.array(0.5), np.array(0.25), np.array(np.inf), 0.95, np.array(9.0)))
        == "0.500 (0.250 … ∞)"
    )


@pytest.mark.parametrize("runs", [1, 2])
def test_few_runs_have_a_report(runs: int, tmp_path) -> None:
    write_ensemble(sinssim.ensemble(scenario(ensemble={"epoch_s": 10.0}), runs), tmp_path)
    text = _words((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert f"an ensemble of {runs} runs" in text
    assert "∞" in text


def test_nothing_but_failures_has_a_report(with_failures: EnsembleResult, tmp_path) -> None:
    """Every percentile is infinite, and there is no position to draw."""
    from dataclasses import replace

    errors = with_failures.errors
    blank = {name: np.full_like(getattr(errors, name), np.nan) for name in ("table", "final")}
    lost = replace(errors, failure=["lost."] * len(errors), **blank)
    write_ensemble(EnsembleResult(with_failures.plan, lost, media=EnsembleMedia()), tmp_path)
    text = _words((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "80 of 80 runs failed" in text
    assert "∞ (∞ … ∞)" in text
