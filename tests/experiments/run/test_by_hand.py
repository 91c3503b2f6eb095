"""Runs written by hand, with few numbers: what is read, compared, listed and reported of them, to the last figure."""

from __future__ import annotations

import datetime
import json
import os
import re
from math import pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import sinssim
from sinssim.errors import InputError
from sinssim.experiments.run import run_comparison
from sinssim.experiments.run.finished_runs import Entry, FinishedRun, is_marked, kind_of, load_streams, runs_in, size_of
from sinssim.experiments.run.run_comparison import compare_runs, comparison_exhibits, write_comparison
from sinssim.recording.page import page_of
from sinssim.system.files import MARK

COLUMNS = (
    "time_s", "position_n_m", "position_e_m", "position_d_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
    "phi_n_rad", "phi_e_rad", "phi_d_rad",
)  # fmt: skip
SIZES = (3.0, -4.0, 7.0, -2.0, 3.0, 6.0, 1e-5, -4e-5, 8e-5)
"""Of the errors in the first row; horizontal 5 m, height −7 m, speed 7 m/s, angle 9e-5 rad. The k-th row is k times."""
EARLY, LATE = (3.0, 5.0, 7.0, 9.0, 13.0), (5.0, 8.0, 11.0, 14.0, 17.0, 23.0)
SCENARIO = 'name = "%s"\nrate_hz = 100.0\n[truth]\nellipsoid = "krasovsky-1940"\n[recording]\nkeep = "%s"\n'


def write(folder: Path, time: tuple[float, ...], factor: float = 1.0, solution: str = "euler", more: str = "",
          **summary: Any) -> Path:  # fmt: skip
    """Write a run of one solution."""
    (folder / "streams").mkdir(parents=True)
    rows = np.array(SIZES) * factor * np.arange(1.0, len(time) + 1.0)[:, np.newaxis]
    columns = dict(zip(COLUMNS, [np.array(time), *rows.T], strict=True))
    pq.write_table(pa.table(columns), folder / "streams" / f"error_{solution}.parquet")
    state = {"time_s": np.array(time), "latitude_rad": 0.2 + 0.02 * rows[:, 0], "longitude_rad": 1.2 + rows[:, 0],
             "height_m": 1500.0 + rows[:, 0]}  # fmt: skip
    pq.write_table(pa.table(state), folder / "streams" / f"nav_{solution}.parquet")
    (folder / "scenario.toml").write_text(SCENARIO % (folder.name, folder.name) + more)
    known = {"scenario": f"scenario {folder.name}", "versions": {"sinssim": sinssim.__version__}}
    (folder / "summary.json").write_text(json.dumps(known | summary))
    return folder


@pytest.fixture
def pair(tmp_path: Path) -> list[Path]:
    """A run from 3 s to 13 s, and one with twice its errors from 5 s to 23 s."""
    legs = '[[flight]]\nkind = "%s"\nheights_m = [%s]\n[[flight]]\nkind = "turn"\n'
    early = write(tmp_path / "early", EARLY, more=legs % ("climb", "1.5, 2500.0"), seed=11)
    late = write(tmp_path / "late", LATE, 2.0, "poisson", legs % ("descent", "1.5, 900.0") + "[imu]\nbias_ug = 0.3",
                 seed=12, status="failed")  # fmt: skip
    os.utime(early / "summary.json", (1_000_000_000, 1_000_000_000))
    os.utime(late / "summary.json", (1_100_000_000, 1_100_000_000))
    return [early, late]


def statistics(first: float, count: int) -> dict[str, float]:
    """Return the statistics of the multiples first, first + 1, … of the errors, in proportion to their size."""
    rows = [first + k for k in range(count)]
    rms = sqrt(sum(row**2 for row in rows) / count)
    found: dict[str, float] = {}
    for name, size in (("horizontal_error_m", 5.0), ("height_error_m", -7.0), ("velocity_error_mps", 7.0),
                       ("attitude_error_arcsec", 9e-5 * 648_000.0 / pi)):  # fmt: skip
        found |= {f"final_{name}": rows[-1] * size, f"rms_{name}": rms * abs(size), f"max_{name}": rows[-1] * abs(size)}
    return found


@pytest.mark.parametrize("order", [1, -1])
def test_the_time_in_common_is_from_the_latest_begin_to_the_earliest_end(pair: list[Path], order: int) -> None:
    """From 5 s to 13 s: the last four rows of the early run, the first three of the late one."""
    found = compare_runs(pair[::order])
    assert list(found.runs) == ["early", "late"][::order]
    assert found.solutions == {"early": "euler", "late": "poisson"}
    assert found.span == (5.0, 13.0)
    assert found.time.tolist() == [5.0, 13.0]
    assert found.is_cut
    assert found.axes == "north"
    assert found.numbers["early"] == pytest.approx(statistics(2.0, 4), rel=1e-12)
    twice = {name: 2.0 * value for name, value in statistics(1.0, 3).items()}
    assert found.numbers["late"] == pytest.approx(twice, rel=1e-12)


def test_a_run_is_cut_where_it_is_longer(tmp_path: Path) -> None:
    base = write(tmp_path / "base", (2.0, 4.0, 6.0))
    same = write(tmp_path / "same", (2.0, 3.0, 6.0))
    assert not compare_runs([base, same]).is_cut
    assert compare_runs([base, write(tmp_path / "before", (1.0, 6.0))]).is_cut
    assert compare_runs([base, write(tmp_path / "after", (2.0, 7.0))]).is_cut
    assert compare_runs([base, write(tmp_path / "least", (5.0, 6.0))]).span == (5.0, 6.0)
    with pytest.raises(InputError, match=r"never begins when base has ended \(base 2 s to 6 s, never 5.1 s to 9 s\)"):
        compare_runs([base, write(tmp_path / "never", (5.1, 9.0))])


def test_runs_of_one_name_are_called_by_their_folders(tmp_path: Path) -> None:
    one, other = write(tmp_path / "a" / "run", EARLY), write(tmp_path / "b" / "run", EARLY)
    assert list(compare_runs([one, other, write(tmp_path / "own", LATE)]).runs) == [str(one), str(other), "own"]


def test_the_keys_that_differ(pair: list[Path]) -> None:
    """Neither the name nor [recording]; tables in lists by number, lists as a line, a dash for a missing key."""
    assert compare_runs(pair).differences == {
        "flight.1.kind": ["climb", "descent"],
        "flight.1.heights_m": ["1.5, 2500", "1.5, 900"],
        "imu.bias_ug": ["–", "0.3"],
    }


def test_the_file_of_a_comparison(pair: list[Path], tmp_path: Path) -> None:
    compared = compare_runs(pair)
    contents, folder = write_comparison(compared, tmp_path / "both")
    assert (folder / "report.html").read_text().startswith("<!DOCTYPE html>")
    assert json.loads((folder / "comparison.json").read_text()) == contents
    assert contents["from_s"] == 5.0
    assert contents["to_s"] == 13.0
    assert contents["runs"] == {
        "early": {"directory": str(pair[0]), "scenario": "scenario early", "status": "finished", "solution": "euler",
                  "errors": compared.numbers["early"]},
        "late": {"directory": str(pair[1]), "scenario": "scenario late", "status": "failed", "solution": "poisson",
                 "errors": compared.numbers["late"]},
    }  # fmt: skip
    assert contents["differences"] == compared.differences


def texts(html: str) -> list[list[str]]:
    """Return the cells of the rows of all tables."""
    rows = re.findall(r"<tr>(.*?)</tr>", html, re.DOTALL)
    return [[re.sub("<[^>]*>", "", cell) for cell in re.findall("<t[dh][^>]*>(.*?)</t[dh]>", row)] for row in rows]


def schuler_minutes(latitude: float, height: float) -> float:
    """Return 2π √(R/g) on Krasovsky's ellipsoid with Somigliana's gravity of WGS-84, which differs by 2e-5."""
    a, f = 6_378_245.0, 1.0 / 298.3
    e2, s2 = f * (2.0 - f), sin(latitude) ** 2
    mean = a * sqrt(1.0 - e2) / (1.0 - e2 * s2)
    gravity = 9.7803253359 * (1.0 + 0.00193185265241 * s2) / sqrt(1.0 - 0.00669437999 * s2)
    return 2.0 * pi * sqrt((mean + height) / (gravity * (1.0 - 2.0 * height / 6.371e6))) / 60.0


def test_the_report_of_a_comparison(pair: list[Path]) -> None:
    page = page_of(comparison_exhibits(compare_runs(pair)))
    words = " ".join(re.sub("<[^>]*>", " ", page).split())
    assert "Comparison of early, late" in words
    assert "Errors from 5 s to 13 s (8 s), which all runs have. A run that is longer is cut to it." in words
    cells = texts(page)
    dates = [f"{datetime.datetime.fromtimestamp(at):%Y-%m-%d %H:%M}" for at in (1_000_000_000, 1_100_000_000)]
    start = cells.index(["run", "scenario", "solution", "status", "date", "seed", "time [s]", "curves"])
    assert cells[start + 1 : start + 3] == [
        ["early", "scenario early", "euler", "finished", dates[0], "11", "3 … 13", "euler"],
        ["late", "scenario late", "poisson", "failed", dates[1], "12", "5 … 23", "poisson"],
    ]
    assert cells[-4:] == [["key", "early", "late"], ["flight.1.kind", "climb", "descent"],
                          ["flight.1.heights_m", "1.5, 2500", "1.5, 900"], ["imu.bias_ug", "–", "0.3"]]  # fmt: skip
    shown = re.search(r"The Schuler period T = 2π√\(R/g\) is ([\d.]+) min here", words)
    assert shown is not None
    first = schuler_minutes(0.26, 1503.0)  # of the first row of the first run
    assert float(shown[1]) == pytest.approx(first, abs=0.008)


def test_the_period_is_that_of_the_first_run_on_its_ellipsoid(
    pair: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[Any] = []
    monkeypatch.setattr(run_comparison, "schuler_period", lambda *given: seen.append(given) or 5000.0)
    assert run_comparison._period(compare_runs(pair)) == 5000.0
    ((state, ellipsoid),) = seen
    assert (ellipsoid.a, ellipsoid.f) == (6_378_245.0, pytest.approx(1.0 / 298.3))
    assert (state.latitude.tolist(), state.height.tolist()) == ([pytest.approx(0.26)], [1503.0])


def test_the_report_of_runs_of_one_scenario(tmp_path: Path) -> None:
    folders = [write(tmp_path / name / "run", EARLY) for name in "ab"]
    page = page_of(comparison_exhibits(compare_runs(folders)))
    assert "Errors from 3 s to 13 s (10 s), which all runs have.</p>" in page
    assert "<p>The scenarios are the same.</p>" in page


def test_many_keys_are_counted(tmp_path: Path) -> None:
    tables = ["[imu]\n" + "".join(f"key_{k} = {k + size}\n" for k in range(67)) for size in (1, 2)]
    folders = [write(tmp_path / name, EARLY, more=more) for name, more in zip("ab", tables, strict=True)]
    page = page_of(comparison_exhibits(compare_runs(folders)))
    assert "And 7 more; each scenario.toml has all of its keys." in page
    assert texts(page)[-1] == ["imu.key_59", "60", "61"]


def test_what_a_directory_holds(tmp_path: Path) -> None:
    files = {"ensemble.json": "ensemble", "trade.json": "trade study", "budget.json": "error budget",
             "results.json": "study", "comparison.json": "comparison of runs"}  # fmt: skip
    for name, kind in files.items():
        (tmp_path / kind).mkdir()
        (tmp_path / kind / name).write_text("{}")
        assert kind_of(tmp_path / kind) == kind
        assert is_marked(tmp_path / kind)
        article = "an" if kind.startswith("e") else "a"
        with pytest.raises(InputError, match=f"{kind} is {article} {kind}; give the directory of a run"):
            FinishedRun(tmp_path / kind)
    run = write(tmp_path / "run", EARLY)
    assert kind_of(run) == "run"
    (run / "scenario.toml").unlink()
    assert kind_of(run) is None
    assert not is_marked(run)
    (run / MARK).write_text("{}")
    assert is_marked(run)
    with pytest.raises(InputError, match="nowhere does not exist"):
        FinishedRun(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"holds no run: it lacks summary.json or scenario.toml"):
        FinishedRun(run)


def test_the_headline_is_the_filters_and_then_that_of_the_first_algorithm_with_a_result(tmp_path: Path) -> None:
    numbers = {name: {"rms_horizontal_error_m": value, "max_horizontal_error_m": 9.0 * value}
               for name, value in (("quaternion", 5.0), ("euler", 7.0), ("aided", 0.5), ("smoothed", 0.3))}  # fmt: skip
    algorithms = {"poisson": {"rms_horizontal_error_m": None}, "euler": numbers["euler"],
                  "quaternion": numbers["quaternion"]}  # fmt: skip
    of_filter = {"smoothed": numbers["smoothed"], "aided": numbers["aided"], "backward": None, "other": 3.0}
    whole = FinishedRun(write(tmp_path / "whole", EARLY, algorithms=algorithms, filter=of_filter))
    assert list(whole.numbers) == ["aided", "smoothed", "poisson", "euler", "quaternion"]
    assert whole.numbers["smoothed"] == numbers["smoothed"]
    assert whole.headline == ("aided", 0.5)
    assert whole.solution() == "euler"  # the headline's has no errors over time here
    inertial = FinishedRun(write(tmp_path / "inertial", EARLY, algorithms=algorithms, status="interrupted"))
    assert inertial.headline == ("euler", 7.0)
    assert (inertial.name, inertial.status) == ("inertial", "interrupted")
    bare = FinishedRun(write(tmp_path / "bare", EARLY))
    assert (bare.headline, bare.numbers, bare.status) == (None, {}, "finished")
    os.utime(bare.path / "summary.json", (1_200_000_000, 1_200_000_000))
    assert bare.date.timestamp() == 1_200_000_000.0


def test_errors_and_place_of_a_run(pair: list[Path]) -> None:
    run = FinishedRun(pair[1])
    error = run.errors("poisson")
    assert error.time.tolist() == list(LATE)
    for k, row in enumerate(np.array(SIZES) * 2.0 * factor for factor in range(1, 7)):
        np.testing.assert_allclose(error.position_ned[k], row[:3], rtol=1e-14)
        np.testing.assert_allclose(error.velocity_ned[k], row[3:6], rtol=1e-14)
        np.testing.assert_allclose(error.attitude[k], row[6:], rtol=1e-14)
    latitude, height = run.place()
    assert (latitude.tolist(), height.tolist()) == ([pytest.approx(0.32)], [1506.0])
    file = pair[1] / "streams" / "error_poisson.parquet"
    table = pq.read_table(file)
    for number in (1, 2, 3):
        table = table.set_column(number, COLUMNS[number], pa.array(np.full(len(LATE), np.nan)))
    pq.write_table(table, file)
    with pytest.raises(InputError, match="the errors of poisson are not known, because the run has no reference"):
        FinishedRun(pair[1]).errors("poisson")


def test_the_list_of_runs(pair: list[Path], tmp_path: Path) -> None:
    """The newest first; not those within a run, in a hidden folder, behind a link, or more than three levels deep."""
    numbers = {"quaternion": {"rms_horizontal_error_m": 3.5}}
    third = write(tmp_path / "one" / "two" / "third", EARLY, algorithms=numbers)
    os.utime(third / "summary.json", (1_050_000_000, 1_050_000_000))
    write(tmp_path / "one" / "two" / "three" / "fourth", EARLY)
    write(tmp_path / ".hidden" / "run", EARLY)
    write(pair[0] / "within", EARLY)
    (tmp_path / "link").symlink_to(pair[0])
    study = tmp_path / "study"
    study.mkdir()
    (study / "results.json").write_text("12345")
    os.utime(study, (900_000_000, 900_000_000))
    found = runs_in(tmp_path)
    assert [entry.path for entry in found] == [pair[1], third, pair[0], study]

    def at(seconds: int) -> datetime.datetime:
        return datetime.datetime.fromtimestamp(seconds).astimezone()

    now = sinssim.__version__
    assert found == [
        Entry(pair[1], "run", "scenario late", "failed", "", None, size_of(pair[1]), at(1_100_000_000), "", now),
        Entry(
            third, "run", "scenario third", "finished", "quaternion", 3.5, size_of(third), at(1_050_000_000), "", now
        ),
        Entry(pair[0], "run", "scenario early", "finished", "", None, size_of(pair[0]), at(1_000_000_000), "", now),
        Entry(study, "study", "", "", "", None, 5, at(900_000_000), "", ""),
    ]
    with pytest.raises(InputError, match=r"results.json is a file; give a folder"):
        runs_in(study / "results.json")


def test_the_size_of_a_directory(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "one").write_bytes(b"x" * 700)
    (tmp_path / "in" / "two").write_bytes(b"x" * 41)
    (tmp_path / "link").symlink_to(tmp_path / "one")
    assert size_of(tmp_path) == 741


def test_the_streams_of_a_run(pair: list[Path]) -> None:
    (pair[0] / "streams" / "events.parquet").write_bytes(b"")
    streams = load_streams(pair[0])
    assert list(streams) == ["error_euler", "nav_euler"]
    assert len(streams) == 2
    assert "events" not in streams
    assert repr(streams) == f"FinishedStreams({pair[0]}: error_euler, nav_euler)"
    own = streams["error_euler"]
    assert tuple(own.columns) == COLUMNS
    assert own["time_s"].tolist() == list(EARLY)
    for size, name in zip(SIZES, COLUMNS[1:], strict=True):
        np.testing.assert_allclose(own[name], [size * k for k in (1.0, 2.0, 3.0, 4.0, 5.0)], rtol=1e-14)
