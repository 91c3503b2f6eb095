"""What KF-GINS computed from exported readings: the page's run, with the numbers that this C++ program wrote.

tests/data/kf_gins has every hundredth row of its results for the car of docs/your-navigator.md: the filter's solution
and standard deviations with measured readings, and inertial/ with ideal readings and without fixes. They are numbers
that the program wrote, no part of it. It was built from its published sources with Eigen 3.4.1.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from sinssim.earth.gravity import gravity_ned
from sinssim.logs.formats import read_file
from sinssim.logs.formats.export_streams import export
from sinssim.logs.solution_score import Judge

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data" / "kf_gins"


def test_ideal_readings_close_on_the_truth_by_another_program(judge: Judge) -> None:
    """KF-GINS has no north component of gravity above the ellipsoid: −3.65 µm/s² here. Nothing else differs."""
    error = judge.score(DATA / "inertial" / "KF_GINS_Navresult.nav").error
    truth = judge.run.solution("truth")
    lacking = -gravity_ned(truth.latitude[0], truth.height[0])[0]
    expected = 0.5 * lacking * error.time**2
    assert expected[-1] == pytest.approx(8.7e-3, abs=0.1e-3)
    # the solution has digits of 1e-9°, 0.1 mm; the vertical channel carries 1.3 µm/s² of the gravity formula
    np.testing.assert_allclose(error.position_ned[:, 0], expected, rtol=0, atol=3e-4)
    assert np.abs(error.position_ned[:, 1]).max() < 3e-4
    assert np.abs(error.position_ned[:, 2]).max() < 0.5 * 1.4e-6 * error.time[-1] ** 2
    assert np.linalg.norm(error.attitude, axis=1).max() < 1e-8


def test_two_filters_agree(judge: Judge) -> None:
    """Same states, same noise, same start: another program's filter, by other people, in other equations."""
    score = judge.score(DATA / "KF_GINS_Navresult.nav")
    assert score.sigma is not None
    assert any("KF_GINS_STD.txt" in sentence for sentence in score.sentences)
    ours, sigma = judge.run_errors(judge.span)["aided"], judge.run.table("filter")
    rows = np.searchsorted(ours.time, score.error.time - 1e-6)
    assert np.allclose(ours.time[rows], score.error.time, rtol=0, atol=1e-6)
    states = [("position", "m"), ("velocity", "mps")]
    names = [*(f"sigma_{what}_{axis}_{unit}" for what, unit in states for axis in "ned"), "sigma_phi_d_rad"]
    own = np.column_stack([sigma[name] for name in names])[np.searchsorted(sigma["time_s"], score.error.time - 1e-6)]
    theirs = score.sigma[:, [0, 1, 2, 3, 4, 5, 8]]
    # KF-GINS' transition is I + F dt: a difference that is halved with the interval
    assert np.abs(theirs / own - 1.0).max() < 3e-3
    difference = np.hstack(
        (
            score.error.position_ned - ours.position_ned[rows],
            score.error.velocity_ned - ours.velocity_ned[rows],
            (score.error.attitude - ours.attitude[rows])[:, 2:],
        )
    )
    assert np.abs(difference / theirs).max() < 0.011
    assert ours.horizontal.max() > 3.0, "the errors are far above these differences: metres without satellites"


def test_the_page_shows_the_configuration_that_is_written(judge: Judge, tmp_path: Path) -> None:
    export(judge.run.path, "kf-gins", tmp_path / "kf", solution=["quaternion"])
    written = (tmp_path / "kf" / "kf-gins.yaml").read_text()
    numbers = re.compile(r"-?\d+\.\d+")  # their last digit is rounding of the truth
    page = (ROOT / "docs" / "programs" / "kf-gins.yaml").read_text(encoding="utf-8")
    assert numbers.sub("0", written) == numbers.sub("0", page)
    shown = [float(number) for number in numbers.findall(page)]
    assert [float(number) for number in numbers.findall(written)] == pytest.approx(shown, rel=1e-8)
    first = (tmp_path / "kf" / "imu.txt").read_text().split()[0]
    assert f"starttime: {first} " in written, "KF-GINS refuses a start before the first reading"


def test_sigma_of_another_solution_are_not_taken(tmp_path: Path) -> None:
    for file in DATA.glob("KF_GINS*"):
        shutil.copy(file, tmp_path)
    found = read_file(tmp_path / "KF_GINS_Navresult.nav").solutions["solution"]
    assert found.position_sigma is not None
    assert found.position_sigma[0].tolist() == [0.832812313, 0.832814871, 0.949747178]
    assert found.attitude_sigma is not None
    assert np.isnan(found.attitude_sigma[:, :2]).all(), "those of roll and pitch are not in the file"
    rows = (tmp_path / "KF_GINS_STD.txt").read_text().splitlines()
    (tmp_path / "KF_GINS_STD.txt").write_text("\n".join(rows[1:]) + "\n")
    streams = read_file(tmp_path / "KF_GINS_Navresult.nav")
    assert streams.solutions["solution"].position_sigma is None
    assert any("other times" in note for note in streams.notes)
