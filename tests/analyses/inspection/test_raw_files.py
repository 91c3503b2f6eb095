"""Arguments of a run that are recorded files, and the words of what another reading of the columns would be."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.analyses.inspection import inspected_files, unit_axes
from sinssim.analyses.inspection.inspected_files import Inspected, _track, are_raw, suggest
from sinssim.analyses.inspection.stream_findings import doubt, fact, wrong
from sinssim.analyses.inspection.stream_inspection import Inspection
from sinssim.analyses.inspection.unit_axes import Reading, _others, judge_reading
from sinssim.analyses.inspection.velocity_match import Match, Seen
from sinssim.errors import InputError


def test_what_is_a_recorded_file(tmp_path: Path) -> None:
    log, scenario = tmp_path / "imu.csv", tmp_path / "drive.toml"
    log.write_text("1,2\n")
    scenario.write_text("")
    assert are_raw([str(log)])
    assert are_raw([str(log), "gnss.pos"])
    assert not are_raw([str(scenario)])
    assert not are_raw(["drive"])  # the name of a scenario
    with pytest.raises(InputError, match=r"missing\.csv does not exist; give a scenario, or recorded files\."):
        are_raw([str(tmp_path / "missing.csv")])
    with pytest.raises(InputError, match=r"drive\.toml is a scenario, one of 3 arguments\."):
        are_raw([str(log), str(scenario), "x.csv"])
    (tmp_path / "run").mkdir()
    with pytest.raises(InputError, match="is a folder, but of no format that is a folder"):
        suggest([tmp_path / "run"])
    (tmp_path / "run" / "summary.json").write_text("{}")
    with pytest.raises(InputError, match=r"is a run directory: `sinssim run .*run/scenario\.toml -o DIR` repeats"):
        suggest([tmp_path / "run"])


def test_the_doubt_on_the_navigation_is_the_first_one(monkeypatch: pytest.MonkeyPatch) -> None:
    findings = [doubt("fixes", "No σ.", "Give it."), fact("imu", "Fast."), doubt("trial", "Worse.", "Use the fixes.")]
    found = Inspected(Inspection(findings), (), 'name = "x"')
    tried: list[bool] = []
    monkeypatch.setattr(inspected_files, "inspect", lambda *_, trial, **__: tried.append(trial) or found)
    files = [Path("imu.csv"), Path("gnss.pos")]
    assert suggest(files).doubts == ("Worse. Use the fixes.", "No σ. Give it.")
    suggest(files, trial=False)
    assert tried == [True, False]


def test_a_track_with_a_simulated_unit(tmp_path: Path) -> None:
    assert tomllib.loads(_track(tmp_path / "Mein Weg-2.gpx", "gpx")) == {
        "name": "mein_weg_2",
        "description": "Along the track Mein Weg-2.gpx",
        "track": {"file": (tmp_path / "Mein Weg-2.gpx").resolve().as_posix(), "format": "gpx", "vehicle": "land"},
        "imu": {"grade": "mems-tactical"},
    }


def test_other_readings_and_their_matrices() -> None:
    """What the numbers mean, what would be right, and the factors of gyros and accelerometers, for samples of 20 ms."""
    own = {meaning: (right, gyro, accel) for meaning, right, gyro, accel in _others(0.02, "rates")}
    scales = {
        "the rates are in °/s and were taken for rad/s": ('the unit "deg/s"', np.pi / 180.0),
        "the rates are in rad/s and were taken for °/s": ('the unit "rad/s"', 180.0 / np.pi),
        "the rates are in mrad/s and were taken for rad/s": ('the unit "mrad/s"', 0.001),
        "the rates are in °/h and were taken for °/s": ('the unit "deg/h"', 1.0 / 3600.0),
        "the rates are in °/h and were taken for rad/s": ('the unit "deg/h"', np.pi / 648_000.0),
        # 1 mrad/s is 0.0573 °/s
        "the rates are in mrad/s and were taken for °/s": ('the unit "mrad/s"', 0.05729577951308232),
        "the gyros give increments, not rates": ('kind = "increments"', 50.0),
    }
    for meaning, (right, factor) in scales.items():
        assert own[meaning][0] == right
        np.testing.assert_allclose(own[meaning][1], factor * np.eye(3), rtol=1e-12)
        np.testing.assert_array_equal(own[meaning][2], np.eye(3))
    other = {meaning: gyro for meaning, _, gyro, _ in _others(0.02, "increments")}
    np.testing.assert_allclose(other["the gyros give rates, not increments"], 0.02 * np.eye(3))
    np.testing.assert_array_equal(own["the y gyro has the opposite sign"][1], np.diag((1.0, -1.0, 1.0)))
    _, gyro, accel = own["the x and z gyros have the opposite sign"]
    np.testing.assert_array_equal(gyro, np.diag((-1.0, 1.0, -1.0)))
    _, gyro, accel = own["the accelerometers give gravity's direction (down at rest)"]
    np.testing.assert_array_equal((gyro, accel), (np.eye(3), -np.eye(3)))
    right, gyro, accel = own["gyros and accelerometers have left-handed axes"]
    assert right == "one axis of both with the other sign"
    np.testing.assert_array_equal(gyro, accel)
    assert np.linalg.det(gyro) == -1.0
    _, gyro, accel = own["the gyros' columns are in another order: y, z, x"]
    assert (gyro @ (5.0, 6.0, 7.0)).tolist() == [6.0, 7.0, 5.0]
    assert sum("another order" in meaning for meaning in own) == 5


_NONE = np.zeros(0)


def _judged(monkeypatch: pytest.MonkeyPatch, own: float, other: float, moved: float, turn: float = 8.0) -> Reading:
    """Judge readings whose stated meaning leaves `own`, and another sign of the z gyro `other`, m/s."""
    time = 0.02 * np.arange(500)
    rate, force = np.tile((0.1, 0.2, 0.3), (500, 1)), np.tile((1.0, 2.0, -9.0), (500, 1))

    def curve(_: object, rates: np.ndarray, forces: np.ndarray, __: float) -> SimpleNamespace:
        return SimpleNamespace(rate=rates[0], force=forces[0])

    def residual(curve: SimpleNamespace, *_: object, **__: object) -> Match:
        stated = np.allclose(curve.rate, rate[0]) and np.allclose(curve.force, force[0])
        flipped = np.allclose(curve.rate, (0.1, 0.2, -0.3)) and np.allclose(curve.force, force[0])
        size = own if stated else other if flipped else 99.0
        return Match(size, np.array([size]), _NONE, np.zeros((0, 4)), _NONE, np.zeros(6), 10.0, moved)

    monkeypatch.setattr(unit_axes, "pushed", curve)
    monkeypatch.setattr(unit_axes, "match", residual)
    relative = np.zeros((30, 3))
    relative[20:, 1] = turn
    fixes = Seen(np.arange(30.0), relative, relative, relative, relative, relative[:, 0], 0.05)
    return judge_reading(time, rate, force, fixes, 0.3, 0.0, 10.0, np.eye(3), "rates")


def test_the_reading_that_fits_clearly_better_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice as well is clear; the sign of the z gyro is the best other reading."""
    meaning = "the z gyro has the opposite sign"

    def text(own: str, other: str) -> str:
        return (
            f"In windows of 10 s the data agree with the velocities of the fixes to {own} m/s rms; the best "
            f"alternative interpretation, that {meaning}, agrees to {other} m/s."
        )

    found = _judged(monkeypatch, 0.9, 0.44, 5.0)
    numbers = {"residual_mps": 0.9, "residual_of_best_other_mps": 0.44, "best_other": meaning}
    fix = "Describe the log with the z gyro with the other sign."
    assert found.findings == [wrong("units and axes", text("0.9", "0.44"), fix, **numbers)]
    assert found.gyro is not None
    assert found.accel is not None
    np.testing.assert_array_equal(found.gyro, np.diag((1.0, 1.0, -1.0)))
    np.testing.assert_array_equal(found.accel, np.eye(3))
    found = _judged(monkeypatch, 0.2, 0.41, 5.0)
    numbers = {"residual_mps": 0.2, "residual_of_best_other_mps": 0.41, "best_other": meaning}
    right = fact("units and axes", f"{text('0.2', '0.41')} Units, signs and handedness are correct.", **numbers)
    assert (found.findings, found.gyro) == ([right], None)
    found = _judged(monkeypatch, 0.4, 0.41, 5.0)
    numbers |= {"residual_mps": 0.4}
    fix = "The motion does not distinguish the two: verify the description."
    assert found.findings == [doubt("units and axes", text("0.4", "0.41"), fix, **numbers)]


def test_readings_that_explain_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """More than half of the change of the velocity is left over; or there is no change: ten times 0.05 m/s."""
    (found,) = _judged(monkeypatch, 0.4, 0.41, 0.75).findings
    assert found.text == (
        "In windows of 10 s the velocity of the fixes changes by 0.75 m/s rms, and the data explain it to 0.4 m/s "
        "only; so does every other interpretation of the columns."
    )
    assert found.fix == (
        "Navigation with these inertial data is probably worse than the fixes alone. Likely causes: the unit moves "
        "in the vehicle or is beyond its range, or the files are not of the same vehicle and time."
    )
    (found,) = _judged(monkeypatch, 0.4, 0.41, 0.85).findings
    assert found.fix.startswith("The motion does not distinguish")
    still = "The velocity of the fixes changes by 0.49 m/s at most: too little to verify units and axes."
    fix = "Inspect a part of the log with manoeuvres."
    assert _judged(monkeypatch, 0.4, 0.1, 5.0, 0.49).findings == [doubt("units and axes", still, fix)]
    assert _judged(monkeypatch, 0.9, 0.44, 5.0, 0.51).findings[0].grade == "wrong"
