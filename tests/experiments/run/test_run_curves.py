"""Curves of runs, ensembles and budgets on the same axes, by hand, and the page on which they are chosen."""

from __future__ import annotations

import base64
import html
import json
import re
import time as clock
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sinssim.cli import app as cli
from sinssim.errors import InputError
from sinssim.experiments.run.finished_runs import runs_in
from sinssim.experiments.run.run_comparison import compare_runs, comparison_exhibits, list_page, write_list
from sinssim.experiments.run.run_curves import Curve, source_of
from sinssim.recording.page import page_of
from tests.browser import CHROMIUM, Page, file_address
from tests.experiments.run.test_by_hand import COLUMNS, EARLY, LATE, SIZES, write

BAD = "<img src=x onerror=alert(1)>&quot;"
PARTS = [f"{what}_{axis}_{unit}" for what, unit in (("position", "m"), ("velocity", "mps"), ("attitude", "rad"))
         for axis in "ned"]  # fmt: skip


def write_ensemble(folder: Path, horizontal: list[float], failures: list[str]) -> Path:
    """Write an ensemble whose run i has k times (h_i, 0, 2) m, (0, 0, h_i) m/s and (3, 0, 4) µrad at epoch k = 0, 1."""
    (folder / "runs").mkdir(parents=True)
    columns: dict[str, Any] = {"failure": failures}
    for name, size in zip(PARTS, (1, 0, 2, 0, 0, 1, 3e-6, 0, 4e-6), strict=True):
        rows = [[0.0, size * (h if name in ("position_n_m", "velocity_d_mps") else 1.0)] for h in horizontal]
        columns[name] = pa.FixedSizeListArray.from_arrays(pa.array(np.ravel(rows)), 2)
    for number, rows in enumerate((slice(0, 2), slice(2, None))):
        pq.write_table(pa.table(columns)[rows], folder / "runs" / f"{number}.parquet")
    (folder / "ensemble.json").write_text(json.dumps({"epochs_s": [10.0, 20.0]}))
    (folder / "scenario.toml").write_text("seed = 7\n[imu]\ngrade = 'tactical'\n")
    return folder


def write_budget(folder: Path) -> Path:
    """Write a budget of two sources, of which the total has σ of 3, 4, … and means of 4, 3, 0, … at 5 s."""
    folder.mkdir()
    names = ["position_north_m", "position_east_m", "position_down_m", "velocity_north_mps", "velocity_east_mps",
             "velocity_down_mps", "tilt_north_rad", "tilt_east_rad", "heading_rad"]  # fmt: skip
    rows: dict[str, Any] = {"source": ["gyro", "total"], "time_s": [5.0, 5.0], "cep_m": [1.0, 7.0], "r95_m": [2.0, 9.0]}
    for name, sigma, mean in zip(names, (9, 9, 3, 1, 2, 0, 2, 3, 6), (9, 9, -4, 0, 0, 2, 0, 0, 0), strict=True):
        rows |= {f"sigma_{name}": [99.0, float(sigma)], f"mean_{name}": [99.0, float(mean)]}
    pq.write_table(pa.table(rows), folder / "budget.parquet")
    (folder / "budget.json").write_text("{}")
    (folder / "scenario.toml").write_text("seed = 7\n[imu]\ngrade = 'laser'\n")
    return folder


def write_score(run: Path, name: str) -> None:
    (run / "scores" / name).mkdir(parents=True)
    rows = np.array(SIZES) * np.array([[1.0], [2.0]])
    columns = dict(zip(COLUMNS, [np.array([5.0, 9.0]), *rows.T], strict=True))
    pq.write_table(pa.table(columns), run / "scores" / name / f"error_{name}.parquet")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs, of which the second has a score and a name that means harm, an ensemble, a budget, and a study."""
    folder = tmp_path_factory.mktemp("curves") / "runs"
    write(folder / "early", EARLY, more="[imu]\ngrade = 'laser'\n")
    write(folder / BAD, LATE, 2.0, "poisson", "[imu]\ngrade = 'mems'\n")
    write_score(folder / BAD, "mine")
    write_ensemble(folder / "many", [5.0, 1.0, 3.0, 2.0], ["", "", "", "diverged"])
    write_budget(folder / "budget")
    (folder / "study").mkdir()
    (folder / "study" / "results.json").write_text("{}")
    (folder / "early" / "report.html").write_text("its report")
    return folder


def test_the_size_of_errors_of_an_ensemble(made: Path) -> None:
    """Of 1, 3, 5 m and infinity, half are below 4 m, and 95 % below infinity; three runs have a root mean square."""
    circle, outer, rms = source_of(made / "many", "many").curves
    assert [curve.name for curve in (circle, outer, rms)] == ["CEP", "R95", "rms"]
    assert circle.time.tolist() == [10.0, 20.0]
    assert circle.values["horizontal"][1] == pytest.approx(4.0)
    assert np.isinf(outer.values["horizontal"][1])
    assert rms.values["height"].tolist() == [0.0, 2.0]
    assert rms.values["speed"][1] == pytest.approx(np.sqrt((25.0 + 1.0 + 9.0) / 3.0))
    assert rms.values["attitude"][1] == pytest.approx(5e-6)


def test_the_size_of_errors_of_a_budget(made: Path) -> None:
    circle, outer, rms = source_of(made / "budget", "b").curves
    assert (circle.values["horizontal"].tolist(), outer.values["horizontal"].tolist()) == ([7.0], [9.0])
    assert {key: rows.tolist() for key, rows in rms.values.items()} == {
        "height": [5.0],
        "speed": [3.0],
        "attitude": [7.0],
    }


def test_the_curves_of_a_run_are_those_of_its_solutions_and_scores(made: Path) -> None:
    own, scored = source_of(made / BAD, "x").curves
    assert [own.name, scored.name] == ["poisson", "mine (scored)"]
    assert own.values["horizontal"].tolist() == pytest.approx([10.0 * k for k in range(1, 7)])
    assert scored.values["height"].tolist() == pytest.approx([7.0, 14.0])
    assert scored.values["attitude"].tolist() == pytest.approx([9e-5, 18e-5])
    with pytest.raises(InputError, match="is a study"):
        source_of(made / "study", "x")


def test_a_long_curve_keeps_its_extremes_and_gaps() -> None:
    time, rows = np.linspace(0.0, 100.0, 10_001), np.linspace(0.0, 1.0, 10_001)
    rows[3_333], rows[5_000:6_000] = 7.0, np.nan
    thin = Curve("a", time, {"horizontal": rows}).thinned(100)
    assert (thin.step, len(thin.time)) == (1.0, 200)
    values = thin.values["horizontal"]
    assert np.nanmax(values) == 7.0
    assert abs(thin.time[np.nanargmax(values)] - 33.33) < 1.0
    assert np.isnan(values[100:120]).all()
    assert np.isfinite(values[:100]).all()
    assert values[:2].tolist() == pytest.approx([0.0, 0.0099])
    assert Curve("a", time[:200], {"horizontal": rows[:200]}).thinned(100).step == 0.0


def packed(page: str) -> dict[str, Any]:
    (text,) = re.findall(r'<div class="several_runs" data-live="([^"]*)"', page)
    return dict(json.loads(zlib.decompress(base64.b64decode(json.loads(html.unescape(text))["packed"]), wbits=-15)))


def test_the_page_has_what_differs_and_the_curves_that_are_not_drawn(made: Path) -> None:
    given = packed(list_page(runs_in(made), made, made))
    entries = {entry["label"]: entry for entry in given["entries"]}
    assert set(entries) == {"early", BAD, "many", "budget", "study"}
    assert (entries["early"]["report"], entries["many"]["report"]) == ("early/report.html", "")
    assert entries["study"]["curves"] == []
    drawn = [curve for entry in entries.values() for curve in entry["curves"] if curve["shown"]]
    assert len(drawn) == 8  # of nine
    assert all(not curve["of"] for curve in drawn)
    rows = {entry["label"]: row for row, entry in enumerate(given["entries"])}
    assert given["keys"]["imu.grade"] == {
        text: sorted(rows[label] for label in labels)
        for text, labels in (("laser", ("early", "budget")), ("mems", (BAD,)), ("tactical", ("many",)))
    }


def test_the_commands_compare_runs_with_ensembles_and_budgets(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    places = [str(made / name) for name in ("early", "many", "budget")]
    with pytest.raises(SystemExit) as stopped:
        cli.main(["compare-runs", *places, "-o", str(tmp_path / "all")])
    assert stopped.value.code == 0
    assert re.search(r"many +CEP, R95, rms +ensemble", capsys.readouterr().out)
    given = packed((tmp_path / "all" / "report.html").read_text())
    assert [entry["label"] for entry in given["entries"]] == ["early", "many", "budget"]
    assert given["entries"][0]["report"].endswith("/runs/early/report.html")
    both = page_of(comparison_exhibits(compare_runs([made / "many", made / "budget"])))
    assert "Errors from" not in both
    with pytest.raises(InputError, match="at least two"):
        compare_runs([made / "many"])


def test_the_list_replaces_only_what_it_wrote(made: Path, tmp_path: Path) -> None:
    place = write_list(runs_in(made), made)
    assert place == made / "runs.html"
    assert write_list(runs_in(made), made) == place
    place.write_text("mine")
    with pytest.raises(InputError, match=r"runs.html is no list of runs"):
        write_list(runs_in(made), made)
    place.unlink()
    (tmp_path / "other.html").write_text("<title>Runs in x</title>")
    place.symlink_to(tmp_path / "other.html")
    with pytest.raises(InputError, match="is no list of runs"):
        write_list(runs_in(made), made)
    place.unlink()


@pytest.fixture(scope="module")
def browser() -> Iterator[Page]:
    if CHROMIUM is None:
        pytest.skip("there is no Chromium on this machine")
    with Page(size=(1250, 1000)) as page:
        yield page


@pytest.fixture
def page(browser: Page, made: Path) -> Page:
    browser.problems.clear()
    browser.requests.clear()
    browser.open("about:blank", "true")
    browser.open(file_address(write_list(runs_in(made), made)), "live.severalRuns && live.drawn.length > 1")
    browser.drawn()
    return browser


NAMES = "live.drawn.find(c => c.key === 'several/horizontal').options.map(o => o.label)"


def test_curves_are_chosen_by_keys_and_keep_their_values(page: Page) -> None:
    """The largest horizontal errors: early 25 m, the other 60 m and its score 10 m, the budget 9 m, many infinite."""
    page.value("[...document.querySelectorAll('.several_tools button')].at(-1).focus()")
    page.key("Enter")
    page.drawn()
    assert page.value(NAMES) == ["Horizontal position error"]  # of a chart without curves
    page.value(f"document.querySelector('input[aria-label={json.dumps(f'{BAD}: poisson')}]').focus()")
    page.key(" ")
    page.drawn()
    assert page.value(NAMES) == [f"{BAD}: poisson"]
    column = "live.drawn.find(c => c.key === 'several/horizontal').plot.data"
    assert page.value(column)[1] == pytest.approx([10.0, 20.0, 30.0, 40.0, 50.0, 60.0])
    assert page.value(column)[0] == pytest.approx(LATE)
    page.value("document.querySelector('input[aria-label=\"early: euler\"]').focus()")
    page.key(" ")
    page.drawn()
    assert page.value("live.drawn.find(c => c.key === 'several/horizontal').plot.scales.y.max") == pytest.approx(63.0)
    rows = page.value(
        "[...document.querySelectorAll('.several_runs tr')].map(r => [...r.cells].map(c => c.textContent))"
    )
    order = [name for name in rows[0] if name != "key"]
    assert sorted(order) == sorted(["early", BAD])
    grades = {"early": "laser", BAD: "mems"}
    assert rows[1:] == [["imu.grade", *(grades[name] for name in order)]]
    state = page.value("location.hash")
    page.open("about:blank", "true")
    page.open(page_address(page, state), "live.severalRuns && live.drawn.length > 1")
    assert sorted(page.value(NAMES)) == sorted([f"{BAD}: poisson", "early: euler"])
    assert page.problems == []


def page_address(page: Page, state: str) -> str:
    return next(address for address in page.requests if address.startswith("file:")) + state


def test_rows_with_a_word_and_links_to_reports(page: Page) -> None:
    page.value("document.querySelector('.several_tools input').focus()")
    page.key(*"tudy")
    rows = "[...document.querySelector('table').tBodies[0].rows]"
    assert page.value(f"{rows}.filter(r => r.offsetParent).map(r => r.cells[0].textContent)") == ["study"]
    assert page.value(
        "[...document.querySelectorAll('tbody a')].map(a => [a.textContent, a.getAttribute('href')])"
    ) == [["early", "early/report.html"]]
    assert page.value("document.querySelector('img')") is None
    assert all(address.startswith(("file:", "about:")) for address in page.requests)
    assert page.problems == []


@pytest.mark.slow
def test_five_hundred_runs_open_at_once(browser: Page, tmp_path: Path) -> None:
    """The page has at most 2 MB; the time is that of a loaded machine, far above the second of docs/performance.md."""
    time = tuple(np.linspace(0.0, 600.0, 2000))
    for k in range(500):
        write(tmp_path / f"run {k}", time, 1.0 + 0.01 * k, more=f"[imu]\nbias = {k}\n")
    place = write_list(runs_in(tmp_path), tmp_path)
    assert place.stat().st_size < 2e6
    begin = clock.monotonic()
    browser.open(file_address(place), "live.severalRuns && live.drawn.length > 1")
    assert clock.monotonic() - begin < 10.0
    assert browser.value("document.querySelectorAll('tbody input').length") == 500
