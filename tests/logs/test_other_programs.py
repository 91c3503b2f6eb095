"""What PSINS, NaveGo and gnss-ins-sim computed from exported increments: the car of docs/your-navigator.md.

tests/data/other_programs has the rows at whole seconds of what the page's programs wrote. They are numbers that these
programs computed, no part of them: PSINS (copy of WangShanpeng, functions of 2023) and NaveGo (version 012 of ins and
ins_gnss, 2022) in GNU Octave 7.3.0, gnss-ins-sim (free_integration.py of a678a76). With the directory of a program in
SINSSIM_PSINS, SINSSIM_NAVEGO or SINSSIM_GNSS_INS_SIM, its program in docs/programs runs here and must give these rows.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sinssim.data import Array
from sinssim.earth.gravity import gravity_ned
from sinssim.experiments.run.run_execution import run
from sinssim.logs.formats import DEFAULT_START
from sinssim.logs.formats.export_streams import export
from sinssim.logs.gps_time import parse_date
from sinssim.logs.solution_score import Judge
from sinssim.logs.stored_run import RecordedRun
from sinssim.scenario import load_scenario
from tests.oracles import other_gravity
from tests.oracles.s_turn import Gravity

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data" / "other_programs"
PAGE = (ROOT / "docs" / "your-navigator.md").read_text(encoding="utf-8")
PROGRAMS = ROOT / "docs" / "programs"
SIMPLE = (
    "aiding.gnss.velocity=true",
    "imu.gyro_scale_sigma_ppm=0.0",
    "imu.accel_scale_sigma_ppm=0.0",
    'filter.states=["gyro bias","accelerometer bias"]',
    "filter.gate=0",
)
"""Settings of the page for filters whose states are biases."""


def fallen(judge: Judge, time: Array, formula: Gravity) -> tuple[Array, Array]:
    """Return the north and down errors that another gravity causes in a minute on the road, m."""
    truth = judge.run.solution("truth")
    latitude, height = truth.latitude[0], float(truth.height[0])
    normal = gravity_ned(latitude, height)
    down = float(formula(np.asarray(latitude), height)[1])
    return -0.5 * normal[0] * time**2, 0.5 * (down - normal[2]) * time**2


def test_ideal_increments_in_psins(judge: Judge) -> None:
    """Second order, two samples a step: what remains of 600 m of road is half a millimetre."""
    error = judge.score(DATA / "psins_inertial.csv").error
    north, down = fallen(judge, error.time, other_gravity.psins)
    assert north[-1] == pytest.approx(8.7e-3, abs=0.1e-3)
    assert down[-1] == pytest.approx(7.1e-3, abs=0.1e-3)
    assert np.abs(error.position_ned[:, 0] - north).max() < 6e-4
    assert np.abs(error.position_ned[:, 1]).max() < 6e-4
    assert np.abs(error.position_ned[:, 2] - down).max() < 6e-4
    assert np.abs(error.attitude).max() < 2e-9


@pytest.mark.parametrize(("name", "metres", "angle"), [("navego", 0.45, 5e-7), ("gnss_ins_sim", 0.38, 1e-5)])
def test_ideal_increments_in_programs_of_first_order(judge: Judge, name: str, metres: float, angle: float) -> None:
    """Half a step of velocity and rotation: decimetres. Rows that are one sample late give 1e-3 rad."""
    error = judge.score(DATA / f"{name}_inertial.csv").error
    _, down = fallen(judge, error.time, getattr(other_gravity, name))
    assert error.horizontal.max() == pytest.approx(metres, abs=0.02)
    assert np.abs(error.position_ned[:, 2] - down).max() < 2e-3
    assert np.abs(error.attitude).max() < angle


@pytest.mark.slow
def test_the_filter_of_psins_agrees(tmp_path: Path) -> None:
    """Same states, same noise, same start; other equations by other people."""
    run(load_scenario(PROGRAMS / "car.toml", list(SIMPLE)), tmp_path / "car15")
    judge = Judge(RecordedRun(tmp_path / "car15"), parse_date(DEFAULT_START, ""))
    score = judge.score(DATA / "psins_filter.csv")
    assert score.sigma is not None
    ours, sigma = judge.run_errors(judge.span)["aided"], judge.run.table("filter")
    rows = np.searchsorted(ours.time, score.error.time - 1e-6)
    states = [("position", "m"), ("velocity", "mps")]
    names = [f"sigma_{what}_{axis}_{unit}" for what, unit in states for axis in "ned"]
    own = np.column_stack([sigma[name] for name in names])[np.searchsorted(sigma["time_s"], score.error.time - 1e-6)]
    theirs = score.sigma[:, :6]
    assert np.abs(theirs / own - 1.0).max() < 4e-3
    difference = np.hstack(
        (
            score.error.position_ned - ours.position_ned[rows],
            score.error.velocity_ned - ours.velocity_ned[rows],
        )
    )
    assert np.sqrt(np.mean((difference / own) ** 2, axis=0)).max() < 0.05
    assert ours.horizontal.max() > 1.0, "the errors are far above these differences"


@pytest.mark.parametrize(
    ("name", "variable", "to", "more"),
    [
        ("psins", "SINSSIM_PSINS", "psins", ()),
        ("navego", "SINSSIM_NAVEGO", "csv", ("truth.csv",)),
        ("gnss_ins_sim", "SINSSIM_GNSS_INS_SIM", "gnss-ins-sim", ()),
    ],
)
def test_the_page_gives_these_rows(
    judge: Judge, name: str, variable: str, to: str, more: tuple[str, ...], tmp_path: Path
) -> None:
    place = os.environ.get(variable)
    if not place:
        pytest.skip(f"{variable} names no directory of this program")
    if name == "gnss_ins_sim":
        command = [sys.executable, str(PROGRAMS / "navigate_with_gnss_ins_sim.py")]
    else:
        octave = shutil.which("octave-cli")
        if octave is None:
            pytest.skip("octave-cli is not installed")
        command = [octave, str(PROGRAMS / f"navigate_with_{name}.m")]
    export(judge.run.path, to, tmp_path / "given", solution=["ideal"])
    done = subprocess.run([*command, place, "given", *more], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    made, kept = (judge.score(folder / f"{name}_inertial.csv").error for folder in (tmp_path, DATA))
    rows = np.searchsorted(made.time, kept.time - 1e-6)
    assert np.abs(made.time[rows] - kept.time).max() < 1e-6
    assert np.abs(made.position_ned[rows] - kept.position_ned).max() < 1e-6
    assert np.abs(made.velocity_ned[rows] - kept.velocity_ned).max() < 1e-7
