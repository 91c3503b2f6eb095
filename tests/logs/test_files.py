"""Fixes and solutions of any registered format as tracks."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError
from sinssim.logs import track as track_file
from sinssim.logs.formats import FORMATS, Format
from sinssim.logs.recorded_streams import Clock, FixStream, SolutionStream, Streams
from sinssim.logs.track import Track, _filled, read_samples
from sinssim.system.registries import Entry
from sinssim.truth.track_samples import TrackSamples, checked_samples
from sinssim.truth.track_smoothing import TrackOptions, knots_of_samples
from sinssim.truth.vehicle_attitude import VEHICLES

T = np.arange(60.0)


@pytest.fixture
def receiver(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, Any]:
    """Register a format whose reader returns what the test puts into this dictionary."""
    streams: dict[str, Any] = {"path": tmp_path / "log.bin"}
    streams["path"].write_bytes(b"FAKE")
    module = ModuleType("sinssim.logs.formats.fake")
    module.FORMAT = Format(  # type: ignore[attr-defined]
        lambda path, head: head.startswith(b"FAKE"),
        lambda path: Streams(
            path, "fake", Clock("gps"), fixes=streams.get("fixes", {}), solutions=streams.get("solutions", {})
        ),
    )
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(FORMATS.shipped, "fake", Entry("fake:FORMAT", "for tests"))
    return streams


def fixes(**change: Any) -> FixStream:
    return FixStream(**{
        "time": T, "latitude": 0.8 + 1e-6 * T, "longitude": 0.2 + 0.0 * T, "height": 100.0 + 0.0 * T,
        "datum": "ellipsoid", **change,
    })  # fmt: skip


def section(receiver: dict[str, Any], **keys: Any) -> Track:
    return Track(file=str(receiver["path"]), **keys)


def test_fixes_without_a_position_are_left_out(receiver: dict[str, Any]) -> None:
    lost = np.where((T > 10) & (T < 14), np.nan, 0.8 + 1e-6 * T)
    receiver["fixes"] = {"gnss": fixes(latitude=lost, longitude=np.where(np.isnan(lost), np.nan, 0.2))}
    samples = checked_samples(read_samples(section(receiver), WGS84), VEHICLES["land"])
    assert len(samples) == 57
    assert "3 fixes without a position are left out." in samples.notes
    assert samples.at(11) == "log.bin, fix 15 (at 14 s)"


def test_worse_fixes_count_less(receiver: dict[str, Any]) -> None:
    """A fix that is 20 m off with σ = 30 m hardly moves the curve; with σ = 1 m it does."""
    height = 100.0 + np.where(T == 30, 20.0, 0.0)
    moved = []
    for bad in (1.0, 30.0):
        sigma = np.ones((60, 3))
        sigma[30] = bad
        receiver["fixes"] = {"gnss": fixes(height=height, position_sigma=sigma)}
        samples = checked_samples(read_samples(section(receiver), WGS84), VEHICLES["land"])
        knots = knots_of_samples(samples, TrackOptions(smoothing=2.0), "normal", WGS84)
        radius = np.linalg.norm(knots.position, axis=1)
        moved.append(float(np.ptp(radius - np.polyval(np.polyfit(knots.time, radius, 1), knots.time))))
    assert moved[0] > 3.0
    assert moved[1] < 0.1


def test_solution_is_preferred_and_stream_chooses(receiver: dict[str, Any]) -> None:
    q = np.tile((1.0, 0.0, 0.0, 0.0), (60, 1))
    place = fixes()
    solution = SolutionStream(T, place.latitude, place.longitude, place.height + 5.0, "ellipsoid", q_nb=q)
    receiver["fixes"], receiver["solutions"] = {"gnss": place}, {"ins": solution}
    assert read_samples(section(receiver), WGS84).q_nb is not None
    assert read_samples(section(receiver, attitude=False), WGS84).q_nb is None
    chosen = read_samples(section(receiver, stream="gnss"), WGS84)
    assert chosen.height[0] == 100.0
    with pytest.raises(InputError, match="Known: gnss, ins"):
        read_samples(section(receiver, stream="imu"), WGS84)


def test_heights_of_another_datum_are_said(receiver: dict[str, Any]) -> None:
    receiver["fixes"] = {"gnss": fixes(datum="mean sea level")}
    assert "above mean sea level" in read_samples(section(receiver), WGS84).notes[0]
    assert read_samples(section(receiver, height_offset_m=47.0), WGS84).notes == ()


def test_nothing_but_an_imu(receiver: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="neither fixes nor a solution"):
        read_samples(section(receiver), WGS84)


def test_gaps_are_bridged_with_a_word(receiver: dict[str, Any]) -> None:
    """Between two stands, half a minute without samples: straight across, not swinging out."""
    time = np.where(T < 30, T, T + 30.0)
    receiver["fixes"] = {"gnss": fixes(time=time, latitude=np.where(T < 30, 0.8, 0.8 + 300.0 / 6.37e6))}
    samples = checked_samples(read_samples(section(receiver), WGS84), VEHICLES["land"])
    knots = knots_of_samples(samples, TrackOptions(smoothing=0.5), "normal", WGS84)
    assert "a gap of 31 s after fix 30, at 29 s: bridged" in knots.notes[0]
    assert np.linalg.norm(knots.velocity, axis=1).max() < 1.3 * 300.0 / 31.0


def test_a_sample_has_the_mean_sigma_of_its_axes(receiver: dict[str, Any]) -> None:
    """σ of 3 and 4 m north and east are √(25/2) m horizontally."""
    sigma = np.tile([3.0, 4.0, 7.0], (60, 1))
    receiver["fixes"] = {"gnss": fixes(position_sigma=sigma)}
    samples = read_samples(section(receiver), WGS84)
    assert samples.sigma is not None
    np.testing.assert_allclose(samples.sigma, np.tile([np.sqrt(12.5), 7.0], (60, 1)))
    assert (samples.source, samples.noun) == ("log.bin", "fix")
    np.testing.assert_array_equal(samples.longitude, np.full(60, 0.2))
    np.testing.assert_array_equal(samples.latitude, 0.8 + 1e-6 * T)


def test_the_part_between_two_instants(receiver: dict[str, Any]) -> None:
    """Counted from the first sample, here at 100 s; both ends belong to it."""
    receiver["fixes"] = {"gnss": fixes(time=100.0 + 2.0 * T)}
    cut = read_samples(section(receiver, start_s=6.0, end_s=11.0), WGS84)
    assert cut.time.tolist() == [106.0, 108.0, 110.0]
    assert cut.rows.tolist() == [4, 5, 6]
    assert read_samples(section(receiver, end_s=4.0), WGS84).time.tolist() == [100.0, 102.0, 104.0]
    with pytest.raises(InputError) as error:
        read_samples(section(receiver, start_s=200.0), WGS84)
    assert str(error.value) == ("track.start_s = 200 and track.end_s = 118 leave no fix of log.bin, which lasts 118 s.")


def test_a_path_is_travelled_with_a_point_each_second() -> None:
    """50 m north and 24 m up at 10 m/s: 5 s and 2.6 s of 26 m; then three pieces of 2.6/3 s."""
    north = np.array([0.0, 50.0, 60.0]) / 6.3354393e6  # the meridian's radius at the equator
    points = TrackSamples("p.kml", "point", np.arange(3.0), north, np.full(3, 0.3), np.array([0.0, 0.0, 24.0]))
    filled = _filled(points, np.array([0.0, 5.0, 7.6]))
    np.testing.assert_allclose(filled.time, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0 + 2.6 / 3.0, 5.0 + 5.2 / 3.0, 7.6])
    np.testing.assert_allclose(filled.height, [0.0] * 6 + [8.0, 16.0, 24.0], atol=1e-12)
    way = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 50.0 + 10.0 / 3.0, 50.0 + 20.0 / 3.0, 60.0]
    np.testing.assert_allclose(filled.latitude * 6.3354393e6, way, atol=1e-8)
    np.testing.assert_allclose(filled.longitude, 0.3, rtol=1e-14)
    assert filled.rows.tolist() == [1, 1, 1, 1, 1, 2, 2, 2, 2]


def test_a_path_without_times_and_with_missing_heights(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five points of which the third repeats the second, heights 10, unknown, unknown, 40 and 60 m, at 5 m/s."""
    step = np.degrees(30.0 / WGS84.a)
    points = np.array([[7.0, 0.0, 10.0], [7.0 + step, 0.0, np.nan], [7.0 + step, 0.0, np.nan],
                       [7.0 + 2.0 * step, 0.0, 40.0], [7.0 + 3.0 * step, 0.0, 60.0]])  # fmt: skip
    points[2, 2] = np.nan
    paths = SimpleNamespace(read_path=lambda path: points)
    monkeypatch.setattr(track_file, "format_of", lambda kind: paths)
    found = track_file._travelled(Path("way.kml"), "kml", 5.0, WGS84)
    # heights by number: 10, 20, 30, 40, 60 m; the second and third are apart by 10 m, so that both remain
    legs = [np.hypot(30.0, 10.0), 10.0, np.hypot(30.0, 10.0), np.hypot(30.0, 20.0)]
    assert found.time[-1] == pytest.approx(sum(legs) / 5.0, rel=1e-5)
    assert (found.source, found.noun) == ("way.kml", "point")
    assert np.degrees(found.longitude[0]) == pytest.approx(7.0)
    assert found.latitude.max() == 0.0
    assert found.notes == (
        "The path has no times: it is travelled at 5 m/s, and the smoothing rounds its corners.",
        "2 of 5 points have no height; it is interpolated, or 0 m.",
    )
    points[:, 2] = np.nan
    flat = track_file._travelled(Path("way.kml"), "kml", 5.0, WGS84)
    assert flat.time[-1] == pytest.approx(18.0, rel=1e-6)
    assert flat.height.tolist() == [0.0] * len(flat)
    assert flat.notes[1:] == (
        "5 of 5 points have no height; it is interpolated, or 0 m.",
        "Points equal to the previous point are left out: 1.",
    )
