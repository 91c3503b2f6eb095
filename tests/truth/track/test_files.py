"""Fixes and solutions of any registered format as tracks."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from sinssim.earth.models import WGS84
from sinssim.errors import InputError
from sinssim.logs.formats.registry import FORMATS
from sinssim.logs.streams import Clock, FixStream, SolutionStream, Streams
from sinssim.truth.track.files import read_samples
from sinssim.truth.track.knots import TrackOptions, knots_of_samples
from sinssim.truth.track.samples import checked_samples
from sinssim.truth.track.section import TrackSection
from sinssim.truth.track.vehicles import VEHICLES

T = np.arange(60.0)


@pytest.fixture
def receiver(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, Any]:
    """Register a format whose reader returns what the test puts into this dictionary."""
    streams: dict[str, Any] = {"path": tmp_path / "log.bin"}
    streams["path"].write_bytes(b"FAKE")
    module = ModuleType("sinssim.logs.formats.fake")
    module.recognises = lambda path, head: head.startswith(b"FAKE")  # type: ignore[attr-defined]
    module.read = lambda path: Streams(  # type: ignore[attr-defined]
        path, "fake", Clock("gps"), fixes=streams.get("fixes", {}), solutions=streams.get("solutions", {})
    )
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(FORMATS, "fake", ("fake", "for tests"))
    return streams


def fixes(**change: Any) -> FixStream:
    return FixStream(**{
        "time": T, "latitude": 0.8 + 1e-6 * T, "longitude": 0.2 + 0.0 * T, "height": 100.0 + 0.0 * T,
        "datum": "ellipsoid", **change,
    })  # fmt: skip


def section(receiver: dict[str, Any], **keys: Any) -> TrackSection:
    return TrackSection(file=str(receiver["path"]), **keys)


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
