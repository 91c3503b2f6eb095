"""Small studies from end to end: closed forms come out, and what is written holds what was found out."""

from __future__ import annotations

import json
import math
import re
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from sinssim.content import list_content
from sinssim.errors import InputError
from sinssim.experiments.studies import algorithm_comparison as module
from sinssim.experiments.studies.algorithm_comparison import compare
from sinssim.experiments.studies.study_schema import Study
from sinssim.experiments.study import load_study
from tests.slow import slow

pytestmark = pytest.mark.usefixtures("hardly_counted")

CONE = {"type": "coning", "half_angle_deg": 1.0, "frequency_hz": 1.0, "duration_s": 20.0}
PARKED = {"latitude_deg": 50.0, "duration_s": 5.0}


def study(**part) -> Study:
    whole = {"title": "p", "rates_hz": (20.0, 40.0, 80.0), "motions": ({"motion": CONE},), **part}
    return Study.model_validate({"name": "small", "parts": (whole,)})


@pytest.fixture(scope="module")
def cones(hardly_counted):
    algorithms = ("rotation-vector-1", "rotation-vector-2", "rotation-vector-3", "rotation-vector-1p", "quaternion-4")
    return compare(study(algorithms=algorithms))


def test_coning_drift_follows_the_closed_form(cones):
    """ε = α²Ω(Ωh)²ⁿ n!/(2ⁿ⁺¹(2n+1)!!) for n samples, α²Ω(Ωh)⁴/60 with one and the previous one."""
    alpha, omega = math.radians(1.0), 2.0 * math.pi
    for row in cones.rows:
        x = omega / row.rate_hz
        n = row.algorithm.removeprefix("rotation-vector-")
        if n == "1p":
            factor = x**4 / 60.0
        elif n == "quaternion-4":
            continue
        else:
            k = int(n)
            odd = math.prod(range(1, 2 * k + 2, 2))
            factor = x ** (2 * k) * math.factorial(k) / (2 ** (k + 1) * odd)
        if x > (0.1 if n == "3" else 0.16):
            continue  # the next term, of the order x² of this one, is no longer small
        drift = math.radians(row.final_attitude_error_arcsec / 3600.0) / row.duration_s
        expected = pytest.approx(alpha**2 * omega * factor, rel=0.03, abs=5e-13)  # rounding errors, rad/s
        assert drift == expected, (row.algorithm, row.rate_hz)


def test_orders_of_convergence(cones):
    found = {o.algorithm: o.order for o in cones.orders if o.quantity == "max_attitude_error_arcsec"}
    assert found["rotation-vector-1"] == pytest.approx(2.0, abs=0.05)
    assert found["quaternion-4"] == pytest.approx(2.0, abs=0.05)  # a high order for constant rates alone
    assert found["rotation-vector-2"] == pytest.approx(4.0, abs=0.1)


def test_rows_are_complete(cones):
    assert len(cones.rows) == 15
    assert {row.samples for row in cones.rows} == {400, 800, 1600}
    for row in cones.rows:
        assert row.status == "done"
        assert row.ns_per_step > 1.0
        assert row.operations_per_step > 100.0
        assert math.isfinite(row.max_horizontal_error_m)
    facts = cones.motions["p", "coning"]
    assert facts.duration_s == 20.0
    assert facts.max_pitch_deg == pytest.approx(1.0, abs=1e-3)
    history = next(iter(cones.histories.values()))
    assert history.attitude[-1] == pytest.approx(cones.rows[0].final_attitude_error_arcsec)


def test_the_same_study_gives_the_same_numbers():
    noisy = study(sensors=("tactical",), algorithms=("quaternion", "poisson"), motions=({"parked": PARKED},))
    first, second = compare(noisy), compare(noisy)
    assert [r.max_horizontal_error_m for r in first.rows] == [r.max_horizontal_error_m for r in second.rows]
    assert {r.status for r in first.rows} == {"done"}
    # one random walk, read more or less often: the final attitude differs by the algorithm's own error only
    final = [r.final_attitude_error_arcsec for r in first.rows]
    assert np.ptp(final) < 1e-3 * final[0]


def test_a_frame_that_cannot_pass_the_pole_is_a_result():
    over = {"latitude_deg": 89.95, "course_deg": 0.0, "speed_mps": 300.0, "duration_s": 60.0}
    found = compare(
        study(
            frames=("level", "inertial"),
            rates_hz=(50.0,),
            motions=({"great_circle": over},),
            algorithms=("quaternion",),
        )
    )
    level, inertial = found.rows
    assert level.status == "failed"
    assert "pole" in level.message
    assert math.isnan(level.max_horizontal_error_m)
    assert inertial.max_horizontal_error_m < 1e-3


def test_three_rates():
    found = compare(
        study(rates_hz=(), schedules_hz=((100.0, 50.0, 10.0),), slow_quantities=("hold", "extrapolate"),
              algorithms=("quaternion",), motions=({"parked": PARKED},))
    )  # fmt: skip
    assert [row.pace for row in found.rows] == ["100/50/10", "100/50/10 extrapolate"]
    assert {row.status for row in found.rows} == {"done"}


@pytest.mark.parametrize("frames", [("level",), *slow((("level", "inertial"),))])
def test_every_schedule_has_its_own_cost(tmp_path, frames):
    found = compare(
        study(rates_hz=(100.0,), schedules_hz=((100.0, 100.0), (100.0, 10.0)), algorithms=("quaternion", "euler"),
              frames=frames, motions=({"parked": PARKED},)),
        tmp_path / "s",
    )  # fmt: skip
    operations = {(r.algorithm, r.frame, r.pace): r.operations_per_step for r in found.rows}
    assert len(operations) == len(found.costs) == 6 * len(frames)
    for algorithm in ("quaternion", "euler"):
        for frame in frames:
            assert operations[algorithm, frame, "100/10/10"] < 0.9 * operations[algorithm, frame, "100/100/100"]
    for row in found.rows:
        cost = found.costs[row.algorithm, row.frame, row.schedule_hz]
        assert (row.ns_per_step, row.operations_per_step) == (cost.ns_per_step, cost.operations.total)
    results = json.loads((tmp_path / "s" / "results.json").read_text(encoding="utf-8"))
    assert [0.0, *results["costs"][1]["schedule_hz"]] == [0.0, 100.0, 100.0, 100.0]
    assert len(results["attitude_costs"]) == 3  # of Euler angles, with B by functions, too
    report = (tmp_path / "s" / "report.html").read_text(encoding="utf-8")
    assert "100/10/10" in report
    assert "B by sines and cosines" in report


def test_ellipsoids_of_the_navigator():
    """The Earth's rate of the chapter at rest: R δω cos φ t³ω²/6 east in the first seconds of a Schuler period."""
    found = compare(
        study(rates_hz=(20.0,), ellipsoids=("truth", "chapter"), algorithms=("quaternion",),
              motions=({"parked": {**PARKED, "duration_s": 60.0}},))
    )  # fmt: skip
    truth, chapter = found.rows
    assert (truth.ellipsoid, chapter.ellipsoid) == ("truth", "chapter")
    assert truth.max_horizontal_error_m < 1e-6
    expected = 2.2115e-7 * math.cos(math.radians(50.0)) * 9.811 * 60.0**3 / 6.0
    assert chapter.max_horizontal_error_m == pytest.approx(expected, rel=0.02)
    (pick,) = found.picks
    assert pick.numbers["candidates"] == 2.0


def test_a_window_longer_than_the_data():
    short = ({"parked": {**PARKED, "duration_s": 0.3}},)
    with pytest.raises(
        InputError, match=r"'p': the motion 'parked' lasts 0.3 s; functional-iteration at 20 Hz.* 0.4 s"
    ):
        compare(study(algorithms=("functional-iteration",), motions=short))


def test_what_is_too_short_is_found_before_anything_is_done(monkeypatch):
    monkeypatch.setattr(module.step_cost, "measure_cost", lambda *_: pytest.fail("it started"))
    with pytest.raises(
        InputError, match=r"'p': the motion 'coning' lasts 20 s; quaternion at 0.01 Hz needs at least 100 s"
    ):
        compare(study(rates_hz=(0.01, 100.0)))
    with pytest.raises(InputError, match=r"coning' lasts 0.001 s; quaternion at 20 Hz needs at least 0.05 s"):
        compare(study(motions=({"motion": CONE, "duration_s": 0.001},)))
    slow = {"rates_hz": (), "schedules_hz": ((100.0, 50.0, 0.02),)}
    with pytest.raises(InputError, match=r"coning' lasts 20 s; quaternion at 0.02 Hz needs at least 50 s"):
        compare(study(**slow))
    with pytest.raises(InputError, match=r"part 'p': .*sample by sample, but rotation-vector-2 by several"):
        compare(study(rates_hz=(), schedules_hz=((100.0, 50.0, 10.0),), algorithms=("rotation-vector-2",)))
    with pytest.raises(InputError, match="limit_minutes = nan"):
        compare(study(), limit_minutes=math.nan)


def test_a_study_that_does_not_fit_into_memory(monkeypatch):
    monkeypatch.setattr(module, "machine_memory", lambda: 16e9)
    long = study(motions=({"parked": {**PARKED, "duration_s": 1e6}},))
    with pytest.raises(
        InputError, match=r"80 million samples of parked at 80 Hz need about 24 GB, and this machine has 16 GB"
    ):
        compare(long, limit_minutes=1e9)


def test_more_than_the_motion_lasts():
    with pytest.raises(InputError, match=r"'parked' lasts 5.0 s, less than its duration_s = 9 s"):
        compare(study(motions=({"parked": PARKED, "duration_s": 9.0},)))


def test_a_study_of_hours_is_refused_before_it_starts(monkeypatch):
    monkeypatch.setattr(module._Work, "_run_block", lambda *_: pytest.fail("it started"))
    long = study(motions=({"parked": {**PARKED, "duration_s": 3e7}},))
    with pytest.raises(InputError, match=r"about \d+\.\d h, more than the limit of 30 min.*--limit-minutes \d+"):
        compare(long)


def test_a_long_study_says_so(monkeypatch):
    said: list[str] = []
    monkeypatch.setattr(module._Work, "_run_block", lambda *_: None)
    monkeypatch.setattr(module, "machine_memory", lambda: math.inf)
    compare(study(motions=({"parked": {**PARKED, "duration_s": 2e6}},)), limit_minutes=1e9, say=said.append)
    assert re.search(r"small: 3 navigations of 280 million samples, about \d+ (s|min)", said[0])


# --- what is written ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory, hardly_counted: None) -> Path:
    folder = tmp_path_factory.mktemp("study") / "small"
    parts = (
        {"title": "rates <&>", "algorithms": ("quaternion", "poisson-2-ortho"), "rates_hz": (20.0, 40.0, 80.0),
         "decides": ("orthogonality",), "motions": ({"motion": CONE},)},
        {"title": "sensors", "rates_hz": (50.0,), "sensors": ("ideal", "tactical"), "motions": ({"parked": PARKED},)},
    )  # fmt: skip
    compare(Study.model_validate({"name": "small", "parts": parts}), folder)
    return folder


def test_files(written):
    assert {p.name for p in written.iterdir()} == {
        ".sinssim.json", "report.html", "results.json", "results.parquet", "recording.rrd", "study.toml",
        "comparison.json", "navigations",
    }  # fmt: skip
    assert load_study(written / "study.toml").parts[0].title == "rates <&>"


def test_results_as_numbers(written):
    results = json.loads((written / "results.json").read_text(encoding="utf-8"))
    table = pq.read_table(written / "results.parquet")
    assert len(results["cases"]) == table.num_rows == 8
    assert table["max_attitude_error_arcsec"].to_pylist() == [c["max_attitude_error_arcsec"] for c in results["cases"]]
    assert results["status"] == "finished"
    assert {c["algorithm"] for c in results["costs"]} == {"quaternion", "poisson-2-ortho"}
    assert results["verdicts"][0]["verdict"] == "undecided"


def test_report_stands_alone(written):
    page = (written / "report.html").read_text(encoding="utf-8")
    assert "rates &lt;&amp;&gt;" in page
    links = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert all(link.startswith("#") for link in links)
    charts = re.sub(r'<div class="row[^"]*">(.*?)</div>', r"\1", page, flags=re.DOTALL)  # side by side
    figures = re.findall(r'<div class="charts">.*?</div>', charts, re.DOTALL)
    assert len(figures) == 7  # rate, cost, orders, defect; bars, growth; cost of a step
    for figure in figures:
        svg = ElementTree.fromstring(figure)
        assert any("text" in element.tag for element in svg.iter())
        ids = {e.get("id") for e in svg.iter() if e.get("id")}
        used = {v[1:] for e in svg.iter() for k, v in e.attrib.items() if k.endswith("href")}
        assert used <= ids
    everything = re.findall(r'\bid="([^"]+)"', page)
    assert len(everything) == len(set(everything))


def test_recording_is_valid_and_shows_the_comparison(written):
    import rerun_cli

    from sinssim.recording.rerun_viewer import find_run_info
    from sinssim.recording.rerun_views import all_views

    recording = written / "recording.rrd"
    binary = Path(rerun_cli.__file__).parent / "rerun"
    subprocess.run([binary, "rrd", "verify", recording], check=True, capture_output=True)
    run = find_run_info(recording)
    assert run.label("kind") == "study"
    assert [tab.name for tab in all_views(run).root_container.contents] == ["comparison"]
    with pytest.raises(InputError, match="Known: comparison"):
        all_views(run, "flight")


def test_numbers_do_not_depend_on_the_threads(hardly_counted):
    some = study(algorithms=("quaternion", "euler"))
    one, three = (compare(some, threads=threads) for threads in (1, 3))
    assert [row.max_attitude_error_arcsec for row in one.rows] == [row.max_attitude_error_arcsec for row in three.rows]
    assert len(one.rows) == 6
    with pytest.raises(InputError, match="threads = 0 must be a whole number from 1 to 1024"):
        compare(some, threads=0)


def test_a_directory_is_not_replaced_unasked(written):
    with pytest.raises(InputError, match="already holds a study"):
        compare(study(), written)


def test_interrupted_keeps_what_is_done(tmp_path, monkeypatch):
    whole = module._Work._run_block
    calls = iter(range(10))

    def second_is_interrupted(*arguments):
        if next(calls) == 1:
            raise KeyboardInterrupt
        whole(*arguments)

    monkeypatch.setattr(module._Work, "_run_block", second_is_interrupted)
    two = study(algorithms=("quaternion",), motions=({"parked": PARKED}, {"motion": CONE}))
    with pytest.raises(KeyboardInterrupt) as interrupt:
        compare(two, tmp_path / "s")
    assert "3 of 6 navigations are finished" in interrupt.value.__notes__[0]
    results = json.loads((tmp_path / "s" / "results.json").read_text(encoding="utf-8"))
    assert results["status"] == "interrupted"
    assert {case["motion"] for case in results["cases"]} == {"parked"}
    assert "The study was interrupted" in (tmp_path / "s" / "report.html").read_text(encoding="utf-8")


def test_interrupted_it_does_not_decide_on_half_the_numbers(tmp_path, monkeypatch):
    whole = module._Work._run_block
    calls = iter(range(10))

    def second_is_interrupted(*arguments):
        if next(calls) == 1:
            raise KeyboardInterrupt
        whole(*arguments)

    monkeypatch.setattr(module._Work, "_run_block", second_is_interrupted)
    both = study(
        algorithms=("two-quaternions",), decides=("orthogonality",), motions=({"parked": PARKED}, {"motion": CONE})
    )
    with pytest.raises(KeyboardInterrupt):
        compare(both, tmp_path / "s")
    (verdict,) = json.loads((tmp_path / "s" / "results.json").read_text(encoding="utf-8"))["verdicts"]
    assert verdict["verdict"] == "undecided"
    assert "3 of its 6 navigations were not reached" in verdict["reason"]


def test_interrupted_while_it_is_written_it_is_written_all_the_same(tmp_path, monkeypatch):
    from sinssim.experiments.studies import algorithm_comparison as record

    whole = record.write_study
    asked = iter((True, False))

    def interrupted_once(comparison, path):
        whole(comparison, path)
        if next(asked):
            raise KeyboardInterrupt

    monkeypatch.setattr(record, "write_study", interrupted_once)
    with pytest.raises(KeyboardInterrupt) as interrupt:
        compare(study(algorithms=("quaternion",)), tmp_path / "s")
    assert "3 of 3 navigations are finished" in interrupt.value.__notes__[0]
    assert json.loads((tmp_path / "s" / "results.json").read_text(encoding="utf-8"))["status"] == "finished"
    assert [p.name for p in tmp_path.iterdir()] == ["s"]


def test_a_failure_keeps_what_is_done(tmp_path):
    """The second motion is a flight that does not last as long as it is asked for; that is known when it was flown."""
    short = {"name": "late", "scenario": "parked", "duration_s": 1e5}
    with pytest.raises(InputError, match="less than its duration_s") as failure:
        compare(study(algorithms=("quaternion",), motions=({"parked": PARKED}, short)), tmp_path / "s")
    assert "3 of 6 navigations are finished" in failure.value.__notes__[0]
    results = json.loads((tmp_path / "s" / "results.json").read_text(encoding="utf-8"))
    assert results["status"] == "failed"
    assert "The study failed" in (tmp_path / "s" / "report.html").read_text(encoding="utf-8")


def test_interrupted_before_anything_was_done_leaves_nothing(tmp_path, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(module._Work, "_run_block", stop)
    with pytest.raises(KeyboardInterrupt):
        compare(study(algorithms=("quaternion",)), tmp_path / "s")
    assert list(tmp_path.iterdir()) == []


# --- the shipped ones ---------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(list_content("studies")) - {"gyro_trade"}))
def test_shipped_study(name, tmp_path):
    found = compare(load_study(name), tmp_path / name)
    assert found.rows
    assert "undecided" not in {verdict.verdict for verdict in found.verdicts}
    failed = {row.frame for row in found.rows if row.status == "failed"}
    assert failed <= ({"level"} if name == "poles" else set())


def test_the_console_table_cuts_no_number(capsys):
    """Many rates on 80 columns: fewer of them, and every number whole."""
    from rich.console import Console

    from sinssim.recording.console import show
    from sinssim.units import number_text

    rates = (10.0, 20.0, 25.0, 40.0, 50.0, 80.0, 100.0, 200.0, 400.0)
    found = compare(
        study(algorithms=("quaternion", "functional-iteration"), rates_hz=rates, motions=({"parked": PARKED},))
    )
    show(found.exhibits, Console(width=80, file=None))
    out = capsys.readouterr().out
    assert "…" not in out
    assert "10 Hz" in out
    assert "400 Hz" in out
    assert number_text(found.rows[0].max_attitude_error_arcsec) in out
    assert max(map(len, out.splitlines())) <= 80
