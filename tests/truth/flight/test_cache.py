"""Kept flights are the flights that were flown, and nothing that goes wrong with the cache harms."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from sinssim.truth.curve import Curve
from sinssim.truth.flight import flight_cache
from sinssim.truth.flight.flight_cache import cached_flight, flight_key
from sinssim.truth.flight.flight_log import FlightLog, flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_simulation import fly_plan


def flight(**changes: Any) -> FlightPlan:
    plan: dict[str, Any] = {
        "aircraft": "737",
        "start": {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 6000.0},
        "legs": [{"type": "hold", "duration_s": 3.0}],
    }
    return FlightPlan.model_validate({**plan, **changes})


def same(a: FlightLog, b: FlightLog) -> bool:
    return (
        a.events == b.events
        and list(a.channels) == list(b.channels)
        and all(
            np.array_equal(a.channels[name].values, b.channels[name].values)
            and np.array_equal(a.channels[name].time, b.channels[name].time)
            and a.channels[name].unit == b.channels[name].unit
            for name in a.channels
        )
        and all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("time", "position_ecef", "q_eb"))
    )


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    flights = tmp_path / "flights"
    monkeypatch.setattr(
        flight_cache, "_file", lambda plan, seed, errors: flights / f"{flight_key(plan, seed, errors)}.flight"
    )
    return flights


def count_flights(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    seeds: list[int] = []

    def counted(section: FlightPlan, seed: int, progress: Any, meanwhile: Any, errors: Any) -> FlightLog:
        seeds.append(seed)
        return flight_log(fly_plan(section, seed, progress))

    monkeypatch.setattr("sinssim.truth.flight.flight_process.fly_apart", counted)
    return seeds


@pytest.fixture(scope="module")
def three_seconds() -> FlightLog:
    return flight_log(fly_plan(flight()))


@pytest.fixture
def flown(monkeypatch: pytest.MonkeyPatch, three_seconds: FlightLog) -> list[int]:
    """The seeds of the flights that are asked for from now on; all are the one of three seconds."""
    seeds: list[int] = []

    def ready(section: FlightPlan, seed: int, progress: Any, meanwhile: Any, errors: Any) -> FlightLog:
        seeds.append(seed)
        return three_seconds

    monkeypatch.setattr("sinssim.truth.flight.flight_process.fly_apart", ready)
    return seeds


def test_second_time_is_read_bit_for_bit(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flown = count_flights(monkeypatch)
    cold = cached_flight(flight())
    seen: list[float] = []
    warm = cached_flight(flight(), 0, seen.append)
    assert flown == [0]
    assert seen == [1.0]
    assert same(cold, warm)
    assert same(cold, flight_log(fly_plan(flight())))
    assert [file.suffix for file in folder.iterdir()] == [".flight"]  # nothing half-written beside it


@pytest.mark.parametrize("mounting", [(1.0, 0.0, 0.0, 0.0), (0.6, 0.0, 0.0, 0.8)])
def test_stored_derivatives_give_the_curve_of_the_knots(
    folder: Path, flown: list[int], mounting: tuple[float, ...]
) -> None:
    cached_flight(flight())
    log = cached_flight(flight())
    assert flown == [0]
    assert log.derivatives is not None
    spline = CubicSpline(log.time, log.position_ecef)  # far from the ends another spline of the same knots agrees
    inner = slice(20, -20)
    assert np.abs(log.derivatives.second[inner, :3] - spline(log.time[inner], 2)).max() < 0.02
    knots = log.time, log.position_ecef, log.q_eb
    read = Curve(*knots, q_bs=mounting, derivatives=log.derivatives).increments(100.0)
    computed = Curve(*knots, q_bs=mounting).increments(100.0)
    assert np.array_equal(read.dtheta, computed.dtheta)
    assert np.array_equal(read.dvel, computed.dvel)


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty"])
def test_damaged_file_is_flown_again(
    damage: str, folder: Path, flown: list[int], caplog: pytest.LogCaptureFixture
) -> None:
    cold = cached_flight(flight())
    file = next(folder.iterdir())
    content = bytearray(file.read_bytes())
    if damage == "flipped":
        content[len(content) // 2] ^= 1
    file.write_bytes({"cut": content[:-100], "flipped": content, "empty": b""}[damage])
    with caplog.at_level(logging.WARNING):
        again = cached_flight(flight())
    assert flown == [0, 0]
    assert "damaged: it is flown again" in caplog.text
    assert same(cold, again)
    assert cached_flight(flight()).time[-1] == 3.0
    assert flown == [0, 0]  # and it was kept again


def test_folder_that_cannot_be_written_costs_a_warning(
    folder: Path, flown: list[int], caplog: pytest.LogCaptureFixture
) -> None:
    folder.write_text("a file where the folder should be")
    with caplog.at_level(logging.WARNING):
        log = cached_flight(flight())
    assert log.time[-1] == 3.0
    assert "cannot be stored" in caplog.text


def test_failed_write_leaves_nothing(folder: Path, flown: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    cached_flight(flight())
    assert list(folder.iterdir()) == []


def test_key_depends_on_what_determines_the_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    base = flight_key(flight(), 0)
    assert flight_key(flight(), 0) == base
    assert flight_key(flight(), 5) == base  # nothing random in calm air
    stirred = flight(turbulence={"severity": 3})
    assert flight_key(stirred, 0) != flight_key(stirred, 5)
    assert flight_key(flight(legs=[{"type": "hold", "duration_s": 4.0}]), 0) != base
    assert flight_key(flight(wind={"north_mps": 1.0}), 0) != base
    other = tmp_path / "other"
    other.mkdir()
    text = Path("aircraft/737/aircraft.toml").read_text()
    (other / "aircraft.toml").write_text(text)
    assert flight_key(flight(aircraft=str(other)), 0) == base
    (other / "aircraft.toml").write_text(text.replace("bank_gain = 1.2", "bank_gain = 1.3"))
    assert flight_key(flight(aircraft=str(other)), 0) != base


def test_key_depends_on_the_code_that_flies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    base = flight_key(flight(), 0)
    sources = {file.relative_to(flight_cache._PACKAGE).as_posix() for file in flight_cache._sources()}
    assert {
        "truth/flight/legs/turns.py",
        "truth/flight/autopilot.py",
        "truth/flight/aircraft.py",
        "units.py",
    } <= sources
    for source in sources:
        copy = tmp_path / source
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes((flight_cache._PACKAGE / source).read_bytes())
    monkeypatch.setattr(flight_cache, "_PACKAGE", tmp_path)
    flight_cache._sources.cache_clear()
    assert flight_key(flight(), 0) == base
    (tmp_path / "truth" / "flight" / "legs" / "turns.py").write_text("# another way to fly\n")
    assert flight_key(flight(), 0) != base
    flight_cache._sources.cache_clear()


def test_only_so_many_flights_are_kept(folder: Path, flown: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flight_cache, "_KEPT", 2)
    for duration in (1.0, 1.1, 1.2):
        cached_flight(flight(legs=[{"type": "hold", "duration_s": duration}]))
    assert flown == [0, 0, 0]
    assert len(list(folder.iterdir())) == 2
