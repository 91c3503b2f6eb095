"""The runs of an ensemble one by one on its page, in a real browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult
from tests.browser import CHROMIUM, Page, file_address
from tests.experiments.ensembles.examples import scenario

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> EnsembleResult:
    folder = tmp_path_factory.mktemp("ensemble") / "of"
    return sinssim.ensemble(scenario(ensemble={"epoch_s": 5.0}), directory=folder, runs=20)


@pytest.fixture
def page(result: EnsembleResult) -> Iterator[Page]:
    assert result.directory is not None
    with Page(size=(1250, 1000)) as page:
        page.open(file_address(Path(result.directory) / "report.html"), "live.eachRun")
        page.value("document.querySelector('.each_run').scrollIntoView()")
        page.until("live.eachRun.chart")
        page.drawn()
        yield page
        assert page.problems == []


def errors(result: EnsembleResult) -> Any:
    return result.errors.position_ned[:, :, :2]


def spot(page: Page, run: int) -> tuple[float, float]:
    """Return where the dot of a run is in the window, px."""
    return tuple(
        page.value(
            f"(() => {{const b = document.querySelector('.plane').getBoundingClientRect(), [x, y] = "
            f"live.eachRun.place({run}); return [b.left + x * b.width / 440, b.top + y * b.height / 440]}})()"
        )
    )


def words(page: Page) -> str:
    return str(page.value("live.eachRun.words.textContent")).replace("−", "-")


def test_a_dot_says_its_run_and_draws_its_curve(page: Page, result: EnsembleResult) -> None:
    at = spot(page, 7)
    page.mouse(("mouseMoved", *at), ("mousePressed", *at), ("mouseReleased", *at))
    page.drawn()
    assert f"seed {result.errors.seed[7]}" in words(page)
    assert words(page).endswith(result.command(7, scenario="scenario.toml"))
    drawn = page.value("(({plot, y}) => plot.data.at(-1 - live.eachRun.chart.rules.filter(r => r.series).length)"
                       ".map(v => v * y.size))(live.eachRun.chart)")  # fmt: skip
    np.testing.assert_allclose(drawn, np.hypot(*errors(result)[7].T), rtol=1e-5, atol=1e-9)


def test_the_slider_chooses_the_instant_and_keys_the_run(page: Page, result: EnsembleResult) -> None:
    page.value("(e => {e.value = 3; e.dispatchEvent(new Event('input'))})(document.querySelector('.each_run input'))")
    page.value("document.querySelector('.plane').focus()")
    page.key("ArrowLeft")
    there = np.hypot(*errors(result)[:, 3].T)
    worst = int(there.argmax())
    assert words(page).startswith(f"Run {worst}, ")
    page.key("ArrowRight", "ArrowLeft")
    assert words(page).startswith(f"Run {there.argsort()[-2]}, ")
    radii = page.value("live.eachRun.given.radii.map(circle => circle[3])")
    assert radii[0] == pytest.approx(result.cep.value[3], rel=1e-9)
    assert radii[1] is None or radii[1] == pytest.approx(result.r95.value[3], rel=1e-9)


def test_a_rectangle_has_the_statistics_of_its_runs(page: Page, result: EnsembleResult) -> None:
    box = page.value(
        "(b => [b.left, b.top, b.width, b.height])(document.querySelector('.plane').getBoundingClientRect())"
    )
    left, top, width, height = box
    begin, end = (left + 0.5 * width, top + 2.0), (left + width - 2.0, top + height - 2.0)  # the eastern half
    page.mouse(("mouseMoved", *begin), ("mousePressed", *begin), ("mouseMoved", *end), ("mouseReleased", *end))
    page.drawn()
    last = errors(result)[:, -1]
    inside = last[last[:, 1] > 0.0]
    assert words(page).startswith(f"{len(inside)} of 20 runs: mean ")
    seen = page.value("[...live.eachRun.within]")
    assert seen == np.flatnonzero(last[:, 1] > 0.0).tolist()
    root = np.sqrt((inside**2).sum(axis=1).mean())
    text = words(page).split("root mean square ")[1].split(",")[0]
    value = float(text.split()[0]) * {"m": 1.0, "cm": 0.01, "km": 1e3}[text.split()[1]]
    assert value == pytest.approx(root, rel=1e-3)


def test_a_rectangle_by_keys(page: Page, result: EnsembleResult) -> None:
    """R begins it a quarter of the drawing wide about the middle; ten steps of a fortieth move it by its width."""
    page.value("document.querySelector('.plane').focus()")
    page.key("r")
    side, x0, y0, x1, y1 = page.value("[440, ...live.eachRun.corners]")
    assert [x1 - x0, y0 - y1, x0 + x1, y0 + y1] == pytest.approx([side / 4, side / 4, side, side])
    page.key(*["ArrowRight"] * 10)
    assert page.value("live.eachRun.corners") == pytest.approx([x0 + side / 4, y0, x1 + side / 4, y1])
    page.key(*["ArrowUp", "ArrowRight"] * 20, shift=True)
    page.key(*["ArrowLeft"] * 5)
    x, y, a, b = page.value("live.eachRun.corners")
    places = np.array(page.value("live.eachRun.given.runs.map((_, k) => live.eachRun.place(k))"))
    inside = (places[:, 0] >= x) & (places[:, 0] <= a) & (places[:, 1] <= y) & (places[:, 1] >= b)
    assert page.value("[...live.eachRun.within]") == np.flatnonzero(inside).tolist()
    assert 0 < inside.sum() < 20
    assert words(page).startswith(f"{inside.sum()} of 20 runs: mean ")
    page.key("Escape")
    assert words(page) == "20 runs."
    assert page.value("document.querySelector('.plane .frame')") is None


def test_a_finger_chooses_a_run_and_draws_a_rectangle(page: Page, result: EnsembleResult) -> None:
    page.touch((spot(page, 7),))
    page.drawn()
    assert f"seed {result.errors.seed[7]}" in words(page)
    left, top, width, height = page.value(
        "(b => [b.left, b.top, b.width, b.height])(document.querySelector('.plane').getBoundingClientRect())"
    )
    begin, end = (left + 0.5 * width, top + 2.0), (left + width - 2.0, top + height - 2.0)
    page.touch((begin,), ((begin[0] + 20.0, begin[1] + 50.0),), (end,))
    page.drawn()
    assert page.value("[...live.eachRun.within]") == np.flatnonzero(errors(result)[:, -1, 1] > 0.0).tolist()
