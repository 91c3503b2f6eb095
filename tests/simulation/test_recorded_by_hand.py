"""What follows from recorded files and from a scenario's tables before a filter runs, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.alignment.initial_conditions import RecordedStart
from sinssim.data import ImuData, Measurements, NavSolution, NavState
from sinssim.errors import InputError
from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.filter_start import Start
from sinssim.scenario import Scenario
from sinssim.simulation import recorded_filter_run
from sinssim.simulation.aided_run import _assumed_mounting, coarse_alignment, navigate_beside
from sinssim.simulation.recorded_filter_run import RecordedAided, all_readings, as_reference, compare_recorded, prepare
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.units import ARCMIN

TIME = np.array([2.0, 2.5, 3.5, 4.0])
IMU = ImuData(TIME, np.array([[1.0, 2, 2], [3, 4, 0], [0, 0, 5]]) * 1e-3, np.array([[0.0, 3, 4], [1, 2, 2], [2, 3, 6]]))
STATE = NavState(np.asarray(0.8), np.asarray(0.2), np.asarray(5.0), np.zeros(3), np.array([1.0, 0, 0, 0]))


def described(monkeypatch: pytest.MonkeyPatch, rate: float, **more: Any) -> Any:
    log = SimpleNamespace(imu=IMU, rate_hz=rate, axes=None, sensed=())
    start = RecordedStart(STATE, np.array([3.0, 7.0, 5.0]), 0.4, 6.0 * ARCMIN, 90.0 * ARCMIN, "so")
    monkeypatch.setattr(recorded_filter_run, "recorded_log", lambda section, mounting: log)
    monkeypatch.setattr(recorded_filter_run, "recorded_start", lambda *given: start)
    scenario = {"name": "x", "log": {"imu": {"file": "x.csv"}}, "imu": {"grade": "tactical"}, "filter": {},
                "aiding": {"baro": {}}}  # fmt: skip
    for table, keys in more.items():
        scenario[table] = {**scenario[table], **keys}  # type: ignore[dict-item]
    return prepare(Scenario.model_validate(scenario))


def test_what_is_written_out_of_a_log(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rate to six digits, span, 1σ of the start, and ∫ω² dt and ∫f² dt of the samples."""
    found = described(monkeypatch, 100.00012345)
    assert found.scenario.imu.rate_hz == 100.0
    assert (found.scenario.log.from_s, found.scenario.log.to_s) == (2.0, 4.0)
    own = found.scenario.filter.initial_sigma
    assert (own.position_m, own.height_m, own.velocity_mps) == (7.0, 5.0, 0.4)
    assert (own.tilt_arcmin, own.heading_arcmin) == (pytest.approx(6.0), pytest.approx(90.0))
    assert found.moved.duration == 2.0
    assert found.moved.rate == pytest.approx((9.0 / 0.5 + 25.0 / 1.0 + 25.0 / 0.5) * 1e-6)
    assert found.moved.force == pytest.approx(25.0 / 0.5 + 9.0 / 1.0 + 49.0 / 0.5)
    own = described(monkeypatch, 100.0, filter={"initial_sigma": {"height_m": 60.0}}).scenario.filter.initial_sigma
    assert (own.position_m, own.height_m) == (7.0, 60.0)
    assert described(monkeypatch, 101.9, imu={"rate_hz": 100.0}).scenario.imu.rate_hz == 101.9
    with pytest.raises(InputError) as info:
        described(monkeypatch, 97.0, imu={"rate_hz": 100.0})
    assert str(info.value) == (
        "imu.rate_hz = 100, but x.csv has 97 samples per second: remove imu.rate_hz, or check the unit of its times."
    )


def test_sensors_that_need_a_reference_or_are_there_twice() -> None:
    scenario = Scenario.model_validate(
        {"name": "x", "log": {"imu": {"file": "x.csv"}}, "imu": {"grade": "tactical"}, "filter": {},
         "aiding": {"baro": {}, "odometer": {}}}
    )  # fmt: skip
    log = SimpleNamespace(sensed=(), imu=IMU, reference=None)
    with pytest.raises(InputError) as info:
        all_readings(SimpleNamespace(log=log, scenario=scenario))  # type: ignore[arg-type]
    assert str(info.value) == (
        "[aiding] has baro, odometer, which are simulated from a reference: add [log.reference], or remove them. "
        "Standstill with detect = true and land_vehicle follow from the inertial data."
    )
    plain = SimpleNamespace(aiding=None)
    sensed = (object(),)
    assert all_readings(SimpleNamespace(log=SimpleNamespace(sensed=sensed), scenario=plain)) is sensed  # type: ignore[arg-type]


MODEL = ErrorModel(
    (Block("position", 1.0), Block("velocity", 1.0), Block("attitude", 1e-3), Block("gyro bias", 0.1)), 1e-4, 1e-3
)


def test_differences_from_a_reference() -> None:
    """Errors of navigation are those that the reference gives; of parameters nothing is known."""
    rng = np.random.default_rng(3)
    time = np.array([1.0, 2.0])
    errors = NavError(time, *(rng.normal(size=(2, 3)) for _ in range(3)))
    reference: Any = SimpleNamespace(error_of=lambda solution: errors if solution == "smooth" else None)
    further = SimpleNamespace(time=time, solution="smooth")
    estimated: Any = SimpleNamespace(
        model=MODEL, smoothed=further, backward=None, parameters={"gyro bias": np.ones((4, 3))}, solution=None
    )
    found = compare_recorded(estimated, (), reference, 9.0)
    assert found.smoothed_error is errors
    assert found.smoothed_state_errors is not None
    expected = np.hstack([errors.position_ned, errors.velocity_ned, errors.attitude, np.full((2, 3), np.nan)])
    np.testing.assert_array_equal(found.smoothed_state_errors, expected)
    assert (found.backward_error, found.backward_state_errors, found.end) == (None, None, 9.0)
    assert found.nominal_errors.shape == (0, 12)
    assert not found.true_parameters_known
    assert np.isnan(found.block_error("gyro bias")).all()
    assert found.block_error("gyro bias", slice(1, 3)).shape == (2, 3)
    nothing = compare_recorded(estimated, (), None, 9.0)
    assert nothing.smoothed_state_errors is not None
    assert np.isnan(nothing.smoothed_state_errors).all()
    assert isinstance(found, RecordedAided)


def test_a_solution_as_a_reference() -> None:
    rng = np.random.default_rng(4)
    s = NavSolution(
        np.arange(2.0), *rng.normal(size=(3, 2)), rng.normal(size=(2, 3)), rng.normal(size=(2, 4)), np.zeros(2)
    )
    found = as_reference("smoothed", s)
    assert found.name == "smoothed"
    for name in ("time", "latitude", "longitude", "height", "velocity_ned", "q_nb"):
        np.testing.assert_array_equal(getattr(found, name), getattr(s, name))
    assert found.position_sigma is None


def driven(mounting: list[float] | None = None, **aiding: Any) -> Scenario:
    imu = {"grade": "tactical", **({} if mounting is None else {"mounting_deg": mounting})}
    return Scenario.model_validate(
        {
            "name": "x",
            "parked": {"latitude_deg": 50.0, "duration_s": 10.0},
            "imu": imu,
            "filter": {},
            "aiding": {"gnss": {}, **aiding},
        }
    )


def test_the_mounting_that_an_alignment_by_course_assumes() -> None:
    """The pitch and yaw of the vehicle's forward axis in the block's: a block that looks 20° to the right sees it 20°
    to the left; of one whose nose is 15° up it is 15° below."""
    for mounting, expected in (
        ([0.0, 0.0, 20.0], (0.0, -20.0)),
        ([0.0, 15.0, 0.0], (-15.0, 0.0)),
        ([40.0, 0.0, 0.0], (0.0, 0.0)),
    ):
        angles, sigma = _assumed_mounting(driven(mounting), [])
        assert np.degrees(angles) == pytest.approx(expected, abs=1e-9)
        assert sigma == 0.0
    one = np.ones(1)
    wheels = Measurements("land-velocity", one, one, np.array([[0.0, 0.0, 0.11, -0.22]]), np.ones((1, 2)))
    scenario = driven(land_vehicle={"mounting_sigma_deg": 2.0})
    assert _assumed_mounting(scenario, [wheels]) == ((0.11, -0.22), pytest.approx(np.radians(2.0)))
    assert _assumed_mounting(driven(), [wheels]) == ((0.11, -0.22), 0.0)


def test_an_alignment_as_long_as_the_run() -> None:
    scenario = driven().model_copy(update={"filter": driven().filter.model_copy(update={"alignment_s": 2.0})})  # type: ignore[union-attr]
    with pytest.raises(InputError) as info:
        coarse_alignment(scenario, "wgs84", Start(IMU, STATE, None), [], MODEL)
    assert str(info.value) == (
        "filter.alignment_s = 2: the run lasts 2 s, and the filter needs time after the alignment."
    )


def test_another_system_of_the_vehicle_has_noise_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its grade at its own place, the rate of the scenario, the true height; its seed is that of no run."""
    scenario = driven().model_copy(update={"seed": 12})
    scenario = scenario.model_copy(update={"imu": scenario.imu.model_copy(update={"rate_hz": 10.0})})
    truth = Parked(0.8, 0.2, 300.0, np.array([1.0, 0.0, 0.0, 0.0]), 10.0)
    seen: list[tuple[Any, int]] = []

    def emulated(ideal: ImuData, section: Any, seed: int) -> ImuData:
        seen.append((section, seed))
        return ideal

    monkeypatch.setattr("sinssim.simulation.aided_run.emulate", emulated)
    found = navigate_beside(scenario, truth, "laser-standard", (3.0, 2.0, -1.0))
    ((section, seed),) = seen
    assert (section.grade, section.rate_hz) == ("laser-standard", 10.0)
    assert seed > 1 << 40
    assert len(found.time) == 101
    np.testing.assert_allclose((found.latitude - 0.8) * 6.37e6, 3.0, rtol=0.01)
    np.testing.assert_allclose((found.longitude - 0.2) * 6.39e6 * np.cos(0.8), 2.0, rtol=0.01)
    np.testing.assert_allclose(found.height, 301.0, rtol=0, atol=1e-3)
    np.testing.assert_allclose(found.velocity_ned, 0.0, rtol=0, atol=1e-4)
