"""Recorded data are judged: faults that people make are named, and numbers that the data hold are found."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sinssim import rotation
from sinssim.analyses.inspection.quiet_spans import at_rest
from sinssim.analyses.inspection.stream_findings import doubt
from sinssim.analyses.inspection.stream_inspection import Inspection, inspect_streams
from sinssim.analyses.inspection.suggested_scenario import suggested_scenario
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, Streams
from tests.analyses.inspection import worlds
from tests.slow import slow

GPS = Clock("gps", 1_400_000_000)


def _inspect(unit: InertialStream, seen: FixStream | None, clock: Clock = GPS) -> Inspection:
    files = [Streams(Path("imu.csv"), "text", clock, inertial={"imu": unit})]
    if seen is not None:
        files.append(Streams(Path("gnss.pos"), "rtklib-pos", GPS, fixes={"gnss": seen}))
    return inspect_streams(files)


def _said(result: Inspection, subject: str, grade: str) -> str:
    return " ".join(f.sentence for f in result.findings if f.subject == subject and f.grade == grade)


def test_a_good_log() -> None:
    """The offset, the delay and the mounting that the world was made with are found, and nothing is wrong.

    The unit's time 0 is 3 s before that of the receiver, and its stamps are 0.08 s late besides.
    """
    result = _inspect(worlds.readings(late=3.08), worlds.fixes(delay=0.125), Clock("gps", 1_399_999_997))
    assert result.usable
    assert result.offset == pytest.approx(3.08, abs=0.01)
    assert result.late == pytest.approx(0.08, abs=0.01)
    assert result.drift == 0.0
    assert result.velocity_delay == pytest.approx(0.125, abs=0.01)
    assert result.mounting is not None
    assert result.mounting.axes == ("forward", "right", "down")
    # v_b = C_bs v_s: the unit's forward axis is turned by the angles of TO_UNIT
    assert np.degrees(result.mounting.angles) == pytest.approx([0.0, -4.0, 6.0], abs=0.3)
    assert "Units, signs and handedness are correct" in _said(result, "units and axes", "fact")
    assert result.quiet is not None
    assert result.quiet.spans[0][0] - 3.0 < 3.0
    assert result.quiet.spans[0][1] - 3.0 == pytest.approx(30.0, abs=3.0)


@pytest.mark.parametrize("turn_deg", [pytest.param((0.0, 0.0, 130.0), marks=pytest.mark.slow), (80.0, 30.0, -60.0)])
def test_the_attitude_at_the_start_needs_no_mounting(turn_deg: tuple[float, float, float]) -> None:
    """The match gives the attitude of a unit in any position, while the vehicle still stands."""
    unit = worlds.readings()
    turned = rotation.dcm_from_quaternion(rotation.quaternion_from_euler(*np.radians(turn_deg)))
    result = _inspect(replace(unit, gyro=unit.gyro @ turned, accel=unit.accel @ turned), worlds.fixes())
    assert result.attitude is not None
    found = result.attitude(10.0)
    assert found is not None
    angles, sigma = found
    right = rotation.dcm_from_quaternion(worlds.drive().state(np.array([10.0])).q_nb[0]) @ worlds.TO_UNIT @ turned
    error = rotation.dcm_from_quaternion(rotation.quaternion_from_euler(*angles)) @ right.T
    off = np.abs(rotation.rotation_vector_from_quaternion(rotation.quaternion_from_dcm(error)))
    assert off[:2].max() < np.radians(1.0)
    assert off[2] < 3.0 * sigma < np.radians(30.0)
    if result.mounting is not None:
        of_vehicle = rotation.euler_from_quaternion(worlds.drive().state(np.array([10.0])).q_nb[0])
        assert result.mounting.of_vehicle(angles) == pytest.approx(np.array(of_vehicle), abs=3.0 * sigma)


@pytest.mark.slow
def test_clocks_without_a_common_origin() -> None:
    unit = worlds.readings(late=5321.7)
    result = _inspect(unit, worlds.fixes(), Clock("machine"))
    assert result.offset == pytest.approx(5321.7, abs=0.02)


def test_a_clock_that_runs_fast() -> None:
    """The drift is found within four times its 1σ, with the offset of the first row."""
    unit = worlds.readings()
    result = _inspect(replace(unit, time=0.08 + unit.time * (1.0 + 2e-3)), worlds.fixes())
    (numbers,) = (f.numbers for f in result.findings if "imu_clock_drift_ppm" in f.numbers)
    assert numbers["sigma_ppm"] < 100.0
    assert numbers["imu_clock_drift_ppm"] == pytest.approx(2000.0, abs=4.0 * numbers["sigma_ppm"])
    assert result.offset == pytest.approx(0.08, abs=0.015)
    assert "Units, signs and handedness are correct" in _said(result, "units and axes", "fact")


@pytest.mark.parametrize(
    ("spoil", "named"),
    [
        *slow(  # an inspection takes three seconds; the first two are corrected in `test_corrections.py`, and all
            # meanings are listed in `test_hypotheses_by_hand.py`
            (lambda u: replace(u, gyro=np.degrees(u.gyro)), "taken for rad/s"),
            (lambda u: replace(u, gyro=u.gyro * (1.0, 1.0, -1.0)), "z gyro has the opposite sign"),
            (lambda u: replace(u, gyro=np.radians(u.gyro)), "taken for °/s"),
            (lambda u: replace(u, gyro=-u.gyro), "signs are opposite"),
            (lambda u: replace(u, accel=-u.accel), "gravity's direction"),
            (lambda u: replace(u, gyro=u.gyro[:, [0, 2, 1]]), "another order: x, z, y"),
            (lambda u: replace(u, gyro=u.gyro * (1, -1, 1), accel=u.accel * (1, -1, 1)), "left-handed"),
        ),
    ],
)
def test_readings_that_mean_something_else(spoil: Callable[[InertialStream], InertialStream], named: str) -> None:
    result = _inspect(spoil(worlds.readings()), worlds.fixes())
    assert not result.usable
    assert named in _said(result, "units and axes", "wrong")


@pytest.mark.parametrize(
    ("factor", "kind", "named"),
    [
        (1.0 / 9.80665, "rates", "the numbers are in g:"),
        (9.80665, "rates", "taken for g"),
        (0.01, "rates", "are increments"),
        (1.0, "increments", "are rates"),
        (3.7, "rates", "No common unit"),
    ],
)
def test_a_scale_that_cannot_be_right(factor: float, kind: str, named: str) -> None:
    unit = worlds.readings()
    # gyros of increments are kept plausible: the scale of the accelerometers is what is judged
    spoilt = InertialStream(unit.time, unit.gyro, factor * unit.accel, kind)  # type: ignore[arg-type]
    result = _inspect(spoilt, None)
    assert not result.usable
    assert named in _said(result, "accelerometers", "wrong")


def test_manoeuvres_and_poor_accelerometers_are_no_wrong_scale() -> None:
    unit = worlds.readings()
    off = _inspect(replace(unit, accel=1.03 * unit.accel), None)
    assert off.usable
    assert "large bias or scale error" in _said(off, "accelerometers", "doubt")
    moving = slice(len(unit) // 2, None)  # no span of it is quiet
    turns = InertialStream(unit.time[moving], unit.gyro[moving], 1.2 * unit.accel[moving])
    assert _inspect(turns, None).usable


@pytest.mark.parametrize(("missing", "longest"), [(4, "0.05 s"), (200, "2.01 s")])
def test_samples_that_are_missing(missing: int, longest: str) -> None:
    unit = worlds.readings()
    keep = np.ones(len(unit), dtype=bool)
    keep[5000 : 5000 + missing] = False
    gap = replace(unit, time=unit.time[keep], gyro=unit.gyro[keep], accel=unit.accel[keep])
    words = f"1 gap with about {missing} missing samples, the longest {longest}"
    assert words in _said(_inspect(gap, None), "imu", "doubt")


def test_times_that_repeat_or_go_back() -> None:
    unit = worlds.readings()
    time = unit.time.copy()
    time[7000:] -= 50.0
    assert "goes back 1 time, first in row 7001" in _said(_inspect(replace(unit, time=time), None), "imu", "wrong")
    time = unit.time.copy()
    time[7000] = time[6999]
    assert "the preceding one, first in row 7001" in _said(_inspect(replace(unit, time=time), None), "imu", "doubt")


def test_the_run_begins_at_the_first_row_with_a_fix() -> None:
    """The receiver has its first fix at 9 s; its rows before show the place of its last switching off."""
    whole = worlds.fixes()
    waits = whole.time < 9.0
    seen = replace(
        whole, quality=np.where(waits, 0, 3), quality_words={0: "no fix", 3: "3D"},
        latitude=np.where(waits, whole.latitude - 1e-5, whole.latitude),
    )  # fmt: skip
    result = _inspect(worlds.readings(), seen)
    assert result.usable
    text = suggested_scenario(result, (Path("imu.csv"), {}, GPS), (Path("gnss.pos"), {}, GPS), Path())
    assert tomllib.loads(text)["log"]["from_s"] == pytest.approx(9.0, abs=0.05)


def test_instants_of_an_epoch_long_ago_are_told_to_a_tenth_of_a_second() -> None:
    unit = worlds.readings()
    text = _said(_inspect(replace(unit, time=unit.time + 1_710_770_000.0), None), "imu", "fact")
    assert "15000 samples from 1710770000.0 s to 1710770150.0 s (149.99 s), 100 a second" in text


@pytest.mark.parametrize("away", slow(1e9, 1e12))
def test_a_wrong_stamp_years_away(away: float) -> None:
    """The last sample and the last fix have the time of a clock that was not set: there are no windows until then."""
    unit, seen = worlds.readings(), worlds.fixes()
    times = [np.append(one.time[:-1], one.time[-1] + away) for one in (unit, seen)]
    assert _inspect(replace(unit, time=times[0]), replace(seen, time=times[1])).as_dict()


def test_channels_that_saturate_freeze_or_die() -> None:
    unit = worlds.readings()
    gyro = unit.gyro.copy()
    gyro[:, 2] = np.clip(gyro[:, 2], -0.05, 0.05)
    assert "z channel of the gyros stays at its" in _said(_inspect(replace(unit, gyro=gyro), None), "gyros", "doubt")
    gyro = unit.gyro.copy()
    gyro[4000:4100, 0] = gyro[4000, 0]
    assert "same number 100 times in a row, from row 4001" in _said(
        _inspect(replace(unit, gyro=gyro), None), "gyros", "doubt"
    )
    gyro[:, 1] = 0.0
    assert "y channel of the gyros never changes" in _said(_inspect(replace(unit, gyro=gyro), None), "gyros", "wrong")


@pytest.mark.slow
def test_axes_of_a_format_that_gravity_contradicts() -> None:
    """A unit whose x, y, z point right, up and backward, in a file whose format says forward, left and up."""
    unit = worlds.readings()
    gyro, accel = (np.column_stack([of[:, 1], -of[:, 2], -of[:, 0]]) for of in (unit.gyro, unit.accel))
    turned = replace(unit, gyro=gyro, accel=accel, axes=("forward", "left", "up"))
    result = _inspect(turned, worlds.fixes())
    said = _said(result, "mounting", "doubt")
    assert "The y axis, which the format says points left, points up: the mean specific force along it is 9.7" in said
    files = (Path("imu.csv"), {}, GPS), (Path("gnss.pos"), {}, GPS)
    assert tomllib.loads(suggested_scenario(result, *files, Path()))["log"]["imu"]["axes"] == [
        "right",
        "up",
        "backward",
    ]
    alone = replace(result, mounting=None, attitude=None)  # as in a log that hardly moves
    told = tomllib.loads(suggested_scenario(alone, *files, Path()))
    assert told["log"]["imu"]["axes"] == ["forward", "right", "down"]
    assert told["filter"]["initial_sigma"]["heading_arcmin"] == 5400.0
    right = replace(unit, axes=("forward", "right", "down"))
    result = _inspect(right, worlds.fixes())
    assert result.stated_axes == ("forward", "right", "down")
    assert "axes" not in tomllib.loads(suggested_scenario(result, *files, Path()))["log"]["imu"]


def test_a_fix_that_steps_and_swapped_coordinates() -> None:
    seen = worlds.fixes(sigma=0.005)
    latitude = seen.latitude.copy()
    latitude[400:] += 0.3 / 6.37e6
    said = _said(_inspect(worlds.readings(), replace(seen, latitude=latitude)), "fixes", "doubt")
    assert "1 step of the position contradicts" in said
    assert f"at {seen.time[400]:.6g} s" in said
    swapped = replace(seen, latitude=np.full_like(seen.latitude, np.radians(-105.1)))
    assert "swapped" in _said(_inspect(worlds.readings(), swapped), "fixes", "wrong")


def test_gyros_that_sense_the_earth() -> None:
    """Quiet gyros without bias read the Earth's rate at rest."""
    unit = worlds.readings(noise=0.0)
    rng = np.random.default_rng(7)
    gyro = unit.gyro - np.radians((0.1, -0.2, 0.15)) @ worlds.TO_UNIT + rng.normal(0.0, 2e-6, unit.gyro.shape)
    accel = unit.accel + rng.normal(0.0, 1e-3, unit.accel.shape)
    said = _said(_inspect(replace(unit, gyro=gyro, accel=accel), None), "gyros", "fact")
    assert "they sense it" in said
    assert "15.0" in said


@pytest.mark.parametrize(("rate_hz", "residual"), [(50.0, 0.05), (50.0, None), (10.0, 0.05)])
def test_shaking_that_nothing_confirms_is_noise(rate_hz: float, residual: float | None, tmp_path: Path) -> None:
    """A part of the shaking is described where fixes confirm the readings and the samples show it; else all of it."""
    unit = worlds.readings(rate_hz)
    quiet = at_rest(unit.time, unit.gyro, unit.accel)
    shaking = np.full(3, 0.004), np.full(3, 0.1)
    shakes = doubt("vibration", "It shakes.", "Increase the noise.")
    result = Inspection([shakes], unit, worlds.fixes(), quiet, shaking, residual=residual)
    files = (tmp_path / "imu.csv", {}, GPS), (tmp_path / "gnss.pos", {}, GPS)
    told = tomllib.loads(suggested_scenario(result, *files, tmp_path))
    if residual is not None and rate_hz > 15.0:
        assert told["filter"]["vibration_noise"] == 0.4
        assert told["imu"]["accel_vrw_ug_sqrt_hz"] < 1e3
    else:
        assert "vibration_noise" not in told["filter"]
        assert told["imu"]["gyro_arw_deg_sqrt_h"] == pytest.approx(np.degrees(0.004) * 60.0, rel=0.01)
        assert told["imu"]["accel_vrw_ug_sqrt_hz"] == pytest.approx(0.1 / 9.80665e-6, rel=0.01)
    assert told["log"]["start"] == {}  # nothing shows the attitude: it is a question
