"""The page on navigators of others, as it is printed, with a shorter run; pyins checks units and axes of the export."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sinssim.earth.geodetic_coordinates import geodetic_to_ecef
from sinssim.experiments.run.run_execution import run
from sinssim.logs.formats import DEFAULT_START, read_file
from sinssim.logs.formats.export_streams import export
from sinssim.logs.gps_time import parse_date
from sinssim.logs.solution_score import Judge
from sinssim.logs.stored_run import RecordedRun
from sinssim.scenario import Scenario, load_scenario

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "your-navigator.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the page's run of four seconds, and what pyins computed from its readings."""
    pytest.importorskip("pyins")
    place = tmp_path_factory.mktemp("pyins")
    scenario = load_scenario(DOCS / "programs" / "minute.toml", "great_circle.duration_s=4")
    run(scenario, place / "minute")
    export(place / "minute", "csv", place / "readings")
    shutil.copy(DOCS / "programs" / "navigate_with_pyins.py", place)
    done = subprocess.run(
        [sys.executable, "navigate_with_pyins.py", "readings", "0.5", "0", "-1.5"],
        cwd=place, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return place


def test_two_programs_integrate_the_same_readings(folder: Path) -> None:
    """pyins and this package share no code; both start at the truth and integrate the same increments."""
    judge = Judge(RecordedRun(folder / "minute"), parse_date(DEFAULT_START, ""))
    theirs = judge.score(folder / "pyins_inertial.csv").error
    ours = judge.run_errors(judge.span)["quaternion"]
    # pyins corrects coning and sculling for a linear model, integrates the position by trapezia: 0.1 mm
    assert np.abs(theirs.position_ned - ours.position_ned).max() < 1e-3
    assert np.abs(theirs.velocity_ned - ours.velocity_ned).max() < 1e-4
    assert np.abs(theirs.attitude - ours.attitude).max() < 1e-6
    assert ours.horizontal.max() > 0.05, "the errors of the readings are far above these differences"


def test_the_filter_is_scored(folder: Path) -> None:
    judge = Judge(RecordedRun(folder / "minute"), parse_date(DEFAULT_START, ""))
    score = judge.score(folder / "pyins_filter.csv", seconds=1.0)
    # fixes of 1.5 m at 5 Hz and velocities of centimetres, from the true start
    assert score.error.horizontal.max() < 5.0
    assert score.error.speed.max() < 1.0


@pytest.mark.slow
def test_within_a_run_it_has_the_figures_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the protocol for navigators of others, without files of readings: the table of the page, digit for digit."""
    pytest.importorskip("pyins")
    monkeypatch.setenv("SINSSIM_PROGRAMS", "allow")
    program = DOCS / "programs" / "pyins_navigator.py"
    tables = "".join(
        f'[[navigator]]\nname = "pyins_{what}"\ncommand = ["{sys.executable}", "{program}", "{what}"]\n'
        'inputs = ["imu", "gnss"]\n'
        for what in ("inertial", "filter")
    )
    minute = (DOCS / "programs" / "minute.toml").read_text(encoding="utf-8")
    (tmp_path / "minute.toml").write_text(minute + tables)
    summary = run(tmp_path / "minute.toml").summary
    for name in ("pyins_filter", "pyins_inertial"):
        (row,) = re.findall(rf"^ \d  {name} \*(.*)$", PAGE, re.MULTILINE)
        final, rms, largest, height, velocity, attitude = map(float, row.split())
        errors = summary["algorithms"][name]
        assert [errors[f"{kind}_horizontal_error_m"] for kind in ("final", "rms", "max")] == pytest.approx(
            [final, rms, largest], rel=3e-4
        )
        assert errors["max_height_error_m"] == pytest.approx(height, rel=3e-4)
        assert errors["max_velocity_error_mps"] == pytest.approx(velocity, rel=3e-4)
        assert errors["max_attitude_error_arcsec"] / 3600.0 == pytest.approx(attitude, rel=3e-4)


@pytest.mark.slow
def test_within_a_run_its_filter_has_the_figures_of_the_airliner(monkeypatch: pytest.MonkeyPatch) -> None:
    """20 min of `aided_airliner` with fixes, and 5 min without, as in tests/estimation/test_pyins_filter.py; the truth
    has pyins' gravity. The page has three digits, of increments that were changed by the difference of gravity."""
    pytest.importorskip("pyins")
    monkeypatch.setenv("SINSSIM_PROGRAMS", "allow")
    program = str(DOCS / "programs" / "pyins_navigator.py")
    contents = load_scenario("aided_airliner").contents()
    del contents["aiding"]["baro"]
    contents["aiding"]["gnss"].update(latency_s=0.0, height_sigma_m=1.5, lever_arm_m=[0.0, 0.0, 0.0])
    contents["navigation"].update(vertical="free", gravity="somigliana")
    contents["truth"]["gravity"] = "somigliana"
    contents["filter"].update(smooth=False, gate=1e-12)
    contents["flight"]["legs"] = [*contents["flight"]["legs"][:5], {"type": "hold", "until_s": 1510.0}]
    command = [sys.executable, program, "model", "5", "5"]  # seconds of arc, those of the grade
    contents["navigator"] = [{"name": "pyins", "command": command, "inputs": ["imu", "gnss"], "timeout_s": 900.0}]
    found = run(Scenario.model_validate(contents))
    seconds = np.arange(1.0, 1500.0)
    rows = np.searchsorted(found.solutions["pyins"].time, seconds - 1e-6)
    errors = found.errors["pyins"]
    aided, outage = rows[(seconds > 60.0) & (seconds <= 1200.0)], rows[seconds > 1200.0]
    line, *_ = re.findall(r"filter of pyins without changes \| (.*?)\|", (DOCS / "programs-compared.md").read_text())
    position, velocity, without = map(float, re.findall(r"pyins ([\d.]+) m", line))
    for values, of_page in ((errors.position_ned[aided], position), (1e3 * errors.velocity_ned[aided], velocity),
                            (errors.position_ned[outage], without)):  # fmt: skip
        assert np.sqrt(np.mean(np.square(values))) == pytest.approx(of_page, rel=3e-3)


@pytest.mark.filterwarnings("ignore:The copy keyword")
def test_ideal_readings_close_on_the_truth(folder: Path) -> None:
    """By pyins, on the exported ideal readings: so units, axes and clock of the export are right."""
    from pyins import strapdown

    pandas = pytest.importorskip("pandas")
    export(folder / "minute", "csv", folder / "ideal", solution=["ideal"])
    imu = read_file(folder / "ideal" / "imu.csv").inertial["imu"]
    truth = RecordedRun(folder / "minute").solution("truth")
    rows = np.hstack((imu.gyro, imu.accel))
    frame = pandas.DataFrame(
        np.vstack((rows[:1], rows)), index=np.append(truth.time[0], imu.time),
        columns=["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"],
    )  # fmt: skip
    first = pandas.read_csv(folder / "ideal" / "truth.csv").iloc[0]
    names = ("latitude_deg", "longitude_deg", "height_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
             "roll_deg", "pitch_deg", "heading_deg")  # fmt: skip
    pva = ("lat", "lon", "alt", "VN", "VE", "VD", "roll", "pitch", "heading")
    start = pandas.Series({a: first[b] for a, b in zip(pva, names, strict=True)}, name=truth.time[0])
    found = strapdown.Integrator(start).integrate(strapdown.compute_increments_from_imu(frame, "increment"))
    end = geodetic_to_ecef(*(np.radians(found[name].iloc[-1]) for name in ("lat", "lon")), found["alt"].iloc[-1])
    true = geodetic_to_ecef(truth.latitude[-1], truth.longitude[-1], truth.height[-1])
    assert np.linalg.norm(end - true) < 1e-3
