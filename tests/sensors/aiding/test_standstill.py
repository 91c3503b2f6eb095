"""Standing still: where readings of zero are given, and how good they are, from stops whose times are known."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import ImuData, Measurements
from sinssim.errors import InputError
from sinssim.scenario.filter_section import AidingSection
from sinssim.sensors.aiding.standstill import (
    LEAST_S,
    RATIO,
    SIGMAS,
    Rest,
    Stops,
    ZeroRate,
    ZeroVelocity,
    find_stances,
    find_stops,
    learn_rest,
    standstill,
)  # fmt: skip
from sinssim.sensors.aiding_sensor import Vehicle, within
from sinssim.truth.motions.parked_and_great_circle import Parked

_RATE_HZ = 100.0
_SHAKE = np.array([2e-4, 3e-4, 4e-4, 0.01, 0.02, 0.03])
_MEAN = np.array([0.001, -0.002, 0.003, 0.1, 0.2, -9.8])


def _readings(seconds: float, moving: tuple[tuple[float, float], ...] = ()) -> ImuData:
    """Return readings that alternate by their shaking about a mean; in motion they shake ten times as much."""
    count = round(seconds * _RATE_HZ)
    middle = (np.arange(count) + 0.5) / _RATE_HZ
    size = np.where(within(middle, moving), 10.0, 1.0) * (-1.0) ** np.arange(count)
    values = (_MEAN + np.outer(size, _SHAKE)) / _RATE_HZ
    return ImuData(np.arange(count + 1) / _RATE_HZ, values[:, :3], values[:, 3:])


def test_constants() -> None:
    """Five windows of a second; the geometric mean of six variances; 5σ."""
    assert (LEAST_S, RATIO, SIGMAS) == (5.0, 3.0, 5.0)


def test_what_rest_is() -> None:
    """±a has the variance a²; its means do not scatter, so that they are good to a/√100 over a second."""
    rest = learn_rest(_readings(20.0, ((12.0, 20.0),)), spans=[(2.0, 4.5), (6.0, 9.0)])
    assert rest.window_s == 1.0
    assert rest.variance == pytest.approx(_SHAKE**2, rel=1e-6)
    assert rest.mean == pytest.approx(_MEAN, rel=1e-9)
    assert rest.scatter == pytest.approx(_SHAKE / 10.0, rel=1e-6)
    assert rest.seconds == pytest.approx(5.5)
    assert learn_rest(_readings(20.0), spans=[(2.0, 7.0)]).seconds == pytest.approx(LEAST_S)
    with pytest.raises(InputError, match=r"stands for 4\.9 s of the data; .* learned from 5 s or more"):
        learn_rest(_readings(20.0), spans=[(2.0, 4.5), (6.0, 8.4)])
    half = learn_rest(_readings(20.0), spans=[(2.0, 9.0)], window_s=0.5)
    assert half.scatter == pytest.approx(_SHAKE / np.sqrt(50.0), rel=1e-6)


def _fixes(speed: float) -> Measurements:
    """Return velocities each second with a 1σ of 0.1 m/s, of which one, at 5 s, has a component of so much."""
    time = np.arange(1.0, 20.0)
    value = np.zeros((19, 3))
    value[4, 1] = -speed
    return Measurements("gnss-velocity", time, time, value, np.full((19, 3), 0.1))


def test_fixes_show_rest_up_to_three_sigmas_and_motion_from_five() -> None:
    """Windows have to contain a fix, and not that at 5 s if it is beyond 3σ."""
    imu = _readings(20.0)
    whole, part = (learn_rest(imu, velocity=_fixes(speed)).seconds for speed in (0.29, 0.31))
    assert (whole, part) == (pytest.approx(20.0), pytest.approx(19.8))  # from 4.9 to 5.1 s there is no window
    rest = learn_rest(imu, spans=[(0.0, 20.0)])
    assert find_stops(imu, rest, velocity=_fixes(0.49)).spans == pytest.approx(np.array([[0.0, 20.0]]))
    assert find_stops(imu, rest, velocity=_fixes(0.51)).spans == pytest.approx(np.array([[0.0, 4.9], [5.1, 20.0]]))


def test_stops_of_a_drive() -> None:
    """Motion from 8 to 11 s and from 15 s on ends a stop; windows of a second lie within it."""
    imu = _readings(20.0, ((8.0, 11.0), (15.0, 20.0)))
    rest = learn_rest(imu, spans=[(0.0, 7.0)])
    assert find_stops(imu, rest).spans == pytest.approx(np.array([[0.0, 8.0], [11.0, 15.0]]), abs=0.11)
    turning = ImuData(imu.time, imu.dtheta + np.array([0.0, 0.0, 1.0]) * np.radians(0.21) / _RATE_HZ, imu.dvel)
    assert len(find_stops(turning, rest, rate_drift=np.radians(0.22)).spans) == 2
    assert len(find_stops(turning, rest, rate_drift=np.radians(0.19)).spans) == 0


def test_stances_of_a_foot() -> None:
    """Readings that alternate by ±a with a variance a² as learned: the ratio is 1, the mean 6 over 6. Shaking by √2.9
    times as much is rest, by √3.1 is none; and so is a force that is off by √12σ_f, which adds 12/6 to 1."""
    imu = _readings(20.0, ((8.6, 9.0),))
    rest = learn_rest(imu, spans=[(0.0, 7.0)])
    found = find_stances(imu, rest).spans
    assert found == pytest.approx(np.array([[0.0, 8.6], [9.0, 20.0]]), abs=1e-9)
    # 50 samples, one of which has a hundredfold variance: (49 + 100)/50 = 2.98
    assert find_stances(imu, rest, window_s=0.5).spans[1, 0] == pytest.approx(8.99)
    later = (imu.time[1:] > 10.0)[:, None]
    middle = np.array([*_MEAN[:3], *_MEAN[3:]]) / _RATE_HZ
    for factor, at_rest in ((2.9, True), (3.1, False)):
        shaken = np.where(later, np.sqrt(factor), 1.0) * (np.column_stack([imu.dtheta, imu.dvel]) - middle) + middle
        ends = find_stances(ImuData(imu.time, shaken[:, :3], shaken[:, 3:]), rest, window_s=0.1).spans[-1, 1]
        assert ends == pytest.approx(20.0 if at_rest else 10.0, abs=0.095)
    sigma = np.sqrt(np.mean(_SHAKE[3:] ** 2))
    along = _MEAN[3:] / np.linalg.norm(_MEAN[3:])
    for away, at_rest in ((3.4, True), (3.5, False)):  # √12 = 3.46
        off = ImuData(imu.time, imu.dtheta, imu.dvel + later * away * sigma * along / _RATE_HZ)
        assert find_stances(off, rest, window_s=0.1).spans[-1, 1] == pytest.approx(20.0 if at_rest else 10.0, abs=0.095)
    for away, at_rest in ((3.4, True), (3.5, False)):
        drift = away * np.sqrt(np.mean(_SHAKE[:3] ** 2)) * np.array([0.0, 0.6, 0.8])
        off = ImuData(imu.time, imu.dtheta + later * drift / _RATE_HZ, imu.dvel)
        assert find_stances(off, rest, window_s=0.1).spans[-1, 1] == pytest.approx(20.0 if at_rest else 10.0, abs=0.095)
    assert len(find_stances(imu, rest, ratio=0.9).spans) == 0
    assert find_stances(imu, rest, velocity=_fixes(0.51)).spans[0] == pytest.approx((0.0, 4.99), abs=0.02)
    with pytest.raises(InputError, match=r"a window of 0\.02 s needs at least 3 samples"):
        find_stances(imu, rest, window_s=0.02)


_STOPS = Stops(np.array([[3.2, 6.3], [11.0, 11.4], [20.05, 22.0]]), Rest(1.0, _SHAKE**2, _MEAN, _SHAKE / 10.0, 20.0))


def test_readings_of_stops() -> None:
    """Every half a second within a stop; a rate over it scatters √2 times as much as over a second."""
    velocity, rate = standstill(_STOPS, velocity_sigma=0.03, rate_hz=2.0)
    times = [3.7, 4.2, 4.7, 5.2, 5.7, 6.2, 20.55, 21.05, 21.55]
    for found, kind in ((velocity, "zero-velocity"), (rate, "zero-rate")):
        assert found.kind == kind
        assert found.time == pytest.approx(times)
        assert found.arrival == pytest.approx(times)
        assert found.value.tolist() == [[0.0] * 3] * 9
    assert velocity.sigma.tolist() == [[0.03] * 3] * 9
    assert rate.sigma == pytest.approx(np.tile(_SHAKE[:3] / 10.0 * np.sqrt(2.0), (9, 1)))
    assert [one.kind for one in standstill(_STOPS, velocity=False)] == ["zero-rate"]
    assert [one.kind for one in standstill(_STOPS, rate=False)] == ["zero-velocity"]


def test_zeros_from_the_readings_have_the_larger_sigma() -> None:
    """0.1 °/h is 4.8e-7 rad/s, less than what the means scatter; 10 °/h is 4.85e-5 rad/s, between two axes."""
    imu, learn = _readings(20.0), ((0.0, 20.0),)
    (velocity,) = ZeroVelocity(detect=True, learn_s=learn, sigma_mps=0.04, rate_hz=4.0).from_imu(imu)
    assert (velocity.kind, len(velocity.time)) == ("zero-velocity", 80)
    assert velocity.sigma[3].tolist() == [0.04] * 3
    scatter = _SHAKE[:3] / 10.0 * 2.0  # over a quarter of a second
    for told, least in ((0.1, np.radians(0.1) / 3600.0), (14.0, np.radians(14.0) / 3600.0)):
        (rate,) = ZeroRate(detect=True, learn_s=learn, sigma_deg_h=told, rate_hz=4.0).from_imu(imu)
        assert rate.sigma[3] == pytest.approx(np.maximum(scatter, least))
    assert scatter[0] < np.radians(14.0) / 3600.0 < scatter[2]


def test_a_third_of_the_sigma_is_rest() -> None:
    time = np.array([4.0, 5.0, 6.0, 7.0])
    size = 0.06 * np.array([0.33, 0.34, 0.5, 0.1])
    assert ZeroVelocity().stands(time, size, 0.06).tolist() == [True, False, False, True]
    told = ZeroVelocity(during_s=((5.0, 6.0),))
    assert told.stands(time, size, 0.06).tolist() == [False, True, True, False]


def test_detected_stops_of_a_run() -> None:
    """Readings at 2 Hz in stops from 0 to 8 s and from 11 to 15 s; mean rates begin within the stop."""
    level = np.array([1.0, 0.0, 0.0, 0.0])
    place = Parked(0.9, 0.2, 400.0, level, 20.0, (0.0, 0.0, 0.0), level)
    vehicle = Vehicle(place, 3, imu=_readings(20.0, ((8.0, 11.0), (15.0, 20.0))))
    learn = {"detect": True, "learn_s": ((0.0, 7.0),), "rate_hz": 2.0}
    section = AidingSection.model_validate({"zero_velocity": learn, "zero_rate": learn}).sensors()
    (velocity,), (rate,) = (section[name].read(vehicle) for name in ("zero_velocity", "zero_rate"))
    first, second = np.arange(0.5, 8.1, 0.5), np.arange(11.0, 15.1, 0.5)
    assert velocity.measurements.time == pytest.approx(np.concatenate([first, second]))
    assert rate.measurements.time == pytest.approx(np.concatenate([first, second[1:]]))
    assert velocity.measurements.sigma[0].tolist() == [0.01] * 3
    assert rate.measurements.sigma[0] == pytest.approx(np.full(3, np.radians(0.1) / 3600.0))
