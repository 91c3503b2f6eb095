"""What the data do not show is asked, and what they show is not lost: standing, noise, clocks, freezes, spans."""

from __future__ import annotations

import tomllib
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sinssim import earth
from sinssim.analyses.inspection.inspected_files import inspect
from sinssim.analyses.inspection.quiet_spans import at_rest, motion_of
from sinssim.analyses.inspection.stream_findings import channel_findings
from sinssim.analyses.inspection.stream_inspection import Inspection, inspect_streams
from sinssim.analyses.inspection.velocity_match import seen
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, Streams
from sinssim.scenario import load_scenario
from sinssim.sensors.aiding.gnss import first_course
from sinssim.simulation.recorded_filter_run import prepare
from sinssim.units import DEG, G0
from tests.analyses.inspection import worlds

GPS = Clock("gps", 1_400_000_000)


def _still(seconds: float, rate_hz: float = 50.0, noise: float = 0.002) -> InertialStream:
    """Return a unit at rest with little noise."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, seconds, 1.0 / rate_hz)
    gyro, accel = (rng.normal(0.0, size, (len(time), 3)) for size in (noise, 0.02))
    return InertialStream(time, gyro, accel - (0.0, 0.0, G0))


def _fixes(seconds: float, speed: Array | float, rate_hz: float = 1.0, noise: float = 0.0) -> FixStream:
    """Return fixes of a vehicle that drives north."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, seconds, 1.0 / rate_hz)
    v = np.broadcast_to(speed, time.shape)
    north = np.cumsum(v) / rate_hz + rng.normal(0.0, noise, len(time))
    east = rng.normal(0.0, noise, len(time))
    r1, r2 = earth.radii(0.8)
    velocity = np.column_stack([v, np.zeros(len(time)), np.zeros(len(time))])
    velocity += rng.normal(0.0, 0.02, velocity.shape)
    return FixStream(
        time, 0.8 + north / r1, 0.2 + east / (r2 * np.cos(0.8)), np.full(len(time), 300.0), "ellipsoid",
        velocity_ned=velocity,
    )  # fmt: skip


def _together(unit: InertialStream, fixes: FixStream, clock: Clock = GPS, other: Clock = GPS) -> Inspection:
    return inspect_streams(
        [
            Streams(Path("imu.csv"), "text", clock, inertial={"imu": unit}),
            Streams(Path("gnss.csv"), "text", other, fixes={"gnss": fixes}),
        ]
    )


def _clocks(result: Inspection) -> str:
    return " ".join(f.sentence for f in result.findings if f.subject == "clocks")


def test_fixes_vote_on_standing() -> None:
    """A rover of calm sensors creeps at 0.4 m/s from 40 s on: only the time before is at rest."""
    unit = _still(120.0)
    unit = replace(unit, gyro=unit.gyro + np.where(unit.time > 40.0, 0.01, 0.0)[:, None])
    fixes = _fixes(120.0, np.where(np.arange(120.0) < 40.0, 0.0, 0.4))
    curve = seen(fixes)
    assert curve is not None
    moves = motion_of(curve, 0.0)
    assert moves.limit < 0.2
    alone = at_rest(unit.time, unit.gyro, unit.accel)
    voted = at_rest(unit.time, unit.gyro, unit.accel, moves)
    assert alone is not None
    assert voted is not None
    assert alone.spans[-1][1] > 100.0
    assert voted.spans[-1][1] == pytest.approx(40.0, abs=3.0)
    assert voted.in_motion == pytest.approx(80.0, abs=4.0)
    assert np.abs(voted.rate).max() < 1e-3 < np.abs(alone.rate).max()


def test_a_noisy_stop_counts_if_the_fixes_stand() -> None:
    """The engine runs at the first stop and not at the last: both are at rest, as the fixes say."""
    rng = np.random.default_rng(6)
    unit, fixes = _still(180.0), _fixes(180.0, np.where(np.abs(np.arange(180.0) - 100.0) < 40.0, 8.0, 0.0))
    shake = np.select([unit.time < 60.0, unit.time < 140.0], [0.01, 0.1], 0.0)
    unit = replace(unit, gyro=unit.gyro + shake[:, None] * rng.normal(size=unit.gyro.shape))
    curve = seen(fixes)
    assert curve is not None
    found = at_rest(unit.time, unit.gyro, unit.accel, motion_of(curve, 0.0))
    assert found is not None
    assert found.spans[0][1] - found.spans[0][0] > 55.0
    assert found.spans[-1][0] == pytest.approx(141.0, abs=3.0)


def test_a_rate_at_rest_beyond_any_data_sheet_is_asked() -> None:
    unit = _still(30.0)
    fast = replace(unit, gyro=unit.gyro - np.array((0.0, 0.0, 39.5 * DEG)))
    result = inspect_streams([Streams(Path("imu.csv"), "text", GPS, inertial={"imu": fast})])
    (said,) = (f for f in result.findings if f.subject == "gyros" and f.grade == "doubt")
    assert "Is that a bias?" in said.text


def test_a_dead_band_hides_the_noise() -> None:
    """Gyros that read zero below 0.3 °/s are no laser gyros: their noise may fill the band."""
    unit = _still(60.0, noise=0.1 * DEG)
    gyro = np.where(np.abs(unit.gyro) < 0.3 * DEG, 0.0, np.round(unit.gyro / (0.01 * DEG)) * 0.01 * DEG)
    found = at_rest(unit.time, gyro, unit.accel)
    assert found is not None
    assert found.hidden[0] == pytest.approx(2.0 * 0.3 * DEG / np.sqrt(12.0), rel=0.05)
    assert (found.gyro_density > 0.1 * DEG * np.sqrt(0.02)).all()
    fine = at_rest(unit.time, unit.gyro, unit.accel)
    assert fine is not None
    assert not fine.hidden.any()


def test_equal_numbers_of_a_coarse_resolution_are_no_freeze() -> None:
    """1 mg steps with a noise of 0.4 mg give long runs at rest; the same runs at 3 mg of noise are a freeze."""
    rng = np.random.default_rng(2)
    moving = 100.0 * np.sin(np.linspace(0.0, 60.0, 8000))
    calm = np.concatenate([rng.normal(0.0, 0.4, 8000), moving + rng.normal(0.0, 3.0, 8000)])
    axis = np.round(calm) * 1e-3 * G0
    longest = max(len(list(run)) for run in np.split(axis, np.flatnonzero(np.diff(axis)) + 1))
    assert longest >= 20
    values = np.column_stack([axis, np.roll(axis, 5), -axis])
    assert not any("same number" in f.text for f in channel_findings("accelerometers", values, "g", G0))
    values[12000:12030, 1] = values[12000, 1]
    (said,) = (f for f in channel_findings("accelerometers", values, "g", G0) if "same number" in f.text)
    assert said.numbers["frozen"] == 30


def test_runs_of_a_dead_band_are_no_freeze() -> None:
    """A laser gyro at rest counts 0 most of the time, for as long as the base does not swing."""
    rng = np.random.default_rng(3)
    swing = np.abs(np.sin(np.linspace(0.0, 200.0, 20000)))[:, None]
    values = np.round(rng.normal(0.0, 2.0, (20000, 3)) * swing)
    values[np.abs(values) < 2.0] = 0.0
    ends = np.flatnonzero(np.diff(values[:, 0]))
    assert np.diff(ends).max() > 40
    assert not any("same number" in f.text for f in channel_findings("gyros", values * DEG, "°/s", DEG))


@pytest.mark.slow
def test_leap_seconds_are_named() -> None:
    """Times of a unit that are GPS time but are taken for UTC run 18 s ahead."""
    unit = worlds.readings(50.0)
    late = Clock("utc", 1_400_000_000)
    result = _together(replace(unit, time=unit.time + 18.0), worlds.fixes(), late)
    assert result.late == pytest.approx(18.0, abs=0.05)
    said = _clocks(result)
    assert "18 s are the leap seconds between UTC and GPS time" in said
    assert "the times of the unit are GPS time, but are taken for UTC" in said


def test_an_offset_without_motion_is_asked() -> None:
    """Nothing is stated, and nothing is written, of clocks that no motion joins."""
    result = _together(_still(60.0), _fixes(60.0, 0.0))
    assert result.late == 0.0
    assert result.offset is None
    assert "does not show the offset" in _clocks(result)
    apart = _together(_still(60.0), _fixes(60.0, 0.0), Clock("machine"))
    assert apart.offset is None
    assert "?" in _clocks(apart)


def test_short_spans_that_overlap_are_said_to() -> None:
    said = _clocks(_together(_still(9.0), _fixes(9.0, 5.0, 2.0)))
    assert "overlap by 8.5 s with 18 fixes" in said
    assert "do not overlap" not in said
    far = _fixes(9.0, 5.0, 2.0)
    assert "do not overlap" in _clocks(_together(_still(9.0), replace(far, time=far.time + 50.0)))


def test_the_scenario_of_a_log_at_rest_runs_and_asks(tmp_path: Path) -> None:
    """The heading is a question; the σ of the fixes is that of their steps; wheels without a mounting are named."""
    unit, fixes = _still(60.0), _fixes(60.0, 0.0, noise=5.0)
    assert fixes.velocity_ned is not None
    rows = np.column_stack([unit.time, unit.gyro, unit.accel])
    np.savetxt(tmp_path / "imu.csv", rows, delimiter=",", fmt="%.6f", header="t_s,gx,gy,gz,ax,ay,az", comments="")
    place = np.degrees(np.column_stack([fixes.latitude, fixes.longitude]))
    rows = np.column_stack([fixes.time, place, fixes.height, fixes.velocity_ned])
    np.savetxt(tmp_path / "gnss.csv", rows, delimiter=",", fmt="%.9f", header="t_s,lat,lon,alt,vn,ve,vd", comments="")
    found = inspect([tmp_path / "imu.csv", tmp_path / "gnss.csv"], tmp_path, land=True)
    assert any("--vehicle land has no effect" in f.text for f in found.inspection.findings)
    assert found.scenario is not None
    told = tomllib.loads(found.scenario)
    assert told["log"]["gnss"]["position_sigma_m"][0] == pytest.approx(5.0, rel=0.25)
    assert "time_offset_s" not in told["log"]["imu"]
    assert told["log"]["start"]["heading_deg"] == 0.0
    (tmp_path / "log.toml").write_text(found.scenario)
    assert prepare(load_scenario(str(tmp_path / "log.toml"))).log.fixes is not None


def test_a_walk_has_a_course_from_the_accuracy_of_its_velocities() -> None:
    """1 m/s is enough for 10° with a σ of 0.1 m/s, and not with 0.2 m/s; 3 m/s counts where it is reached."""
    time = np.arange(60.0)
    walk = np.column_stack([np.where(time < 20.0, 0.0, 1.0), np.zeros(60)])
    assert first_course(time, walk, np.full(60, 0.1)) == (20, pytest.approx(0.0997, abs=1e-3))
    assert first_course(time, walk, np.full(60, 0.2)) is None
    assert first_course(time, walk, np.full(60, 0.1), least=1.5) is None
    faster = walk * np.where(time < 40.0, 1.0, 4.0)[:, None]
    found = first_course(time, faster, np.full(60, 0.1))
    assert found is not None
    assert found[0] == 40


@pytest.mark.parametrize("spoilt", ["gyros", "accelerometers"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300, 0.0])
def test_no_warning_of_columns_without_numbers_reaches_the_user(tmp_path: Path, spoilt: str, value: float) -> None:
    """Columns that are empty, infinite, huge or constant are refused in words."""
    unit = _still(20.0)
    rows = np.column_stack([unit.time, unit.gyro, unit.accel])
    rows[:, 1 : 4 if spoilt == "gyros" else 7][:, -3:] = value
    for names in ("t_s,gx,gy,gz,ax,ay,az", ""):
        np.savetxt(tmp_path / "imu.csv", rows, delimiter=",", fmt="%.6g", header=names, comments="")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with pytest.raises(InputError):
                inspect([tmp_path / "imu.csv"])


def _odd() -> list[tuple[str, InertialStream, FixStream]]:
    """Return inputs that divide by nothing where nobody looks."""
    unit, fixes = _still(30.0), _fixes(30.0, 5.0)
    assert fixes.velocity_ned is not None
    nan = np.full((len(fixes), 3), np.nan)
    first = slice(0, 1)
    return [
        ("constant gyros", replace(unit, gyro=np.zeros_like(unit.gyro)), fixes),
        ("constant accelerometers", replace(unit, accel=np.tile((0.0, 0.0, -G0), (len(unit), 1))), fixes),
        ("all zero", replace(unit, gyro=0.0 * unit.gyro, accel=0.0 * unit.accel), fixes),
        ("missing gyros", replace(unit, gyro=np.full_like(unit.gyro, np.nan)), fixes),
        ("one sample", InertialStream(unit.time[first], unit.gyro[first], unit.accel[first]), fixes),
        ("two samples", InertialStream(unit.time[:2], unit.gyro[:2], unit.accel[:2]), fixes),
        ("one instant", replace(unit, time=np.zeros(len(unit))), fixes),
        ("one fix", unit, fixes.rows(np.array([3]))),
        ("two fixes", unit, fixes.rows(np.array([3, 4]))),
        (
            "fixes at one place",
            unit,
            replace(fixes, latitude=fixes.latitude * 0.0 + 0.8, velocity_ned=0.0 * nan[:, :0]),
        ),
        ("no place", unit, replace(fixes, latitude=nan[:, 0], longitude=nan[:, 0])),
        ("no velocity", unit, replace(fixes, velocity_ned=nan)),
        ("no sigma", unit, replace(fixes, velocity_sigma=nan, position_sigma=nan)),
        ("fixes of one instant", unit, replace(fixes, time=np.zeros(len(fixes)))),
        ("increments", replace(unit, kind="increments", interval=np.zeros((len(unit), 2))), fixes),
    ]


@pytest.mark.parametrize(("unit", "fixes"), [pytest.param(u, f, id=name) for name, u, f in _odd()])
def test_no_warning_reaches_the_user(unit: InertialStream, fixes: FixStream) -> None:
    if fixes.velocity_ned is not None and not fixes.velocity_ned.size:
        fixes = replace(fixes, velocity_ned=None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert _together(unit, fixes).findings
