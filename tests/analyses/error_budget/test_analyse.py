"""Scenarios that have no budget, instants, and the Python interface."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest

import sinssim
from sinssim.analyses.error_budget.covariance_budget import _OTHER_SETS
from sinssim.errors import InputError
from sinssim.sensors.aiding.air_data import Barometer
from sinssim.sensors.aiding_sensor import AidingReadings, Vehicle
from sinssim.sensors.sensor_set_section import SensorSet
from tests.analyses.error_budget.worlds import SHORT_TURN, scenario

_AIDED: dict[str, Any] = {"motion": SHORT_TURN, "navigation": {"vertical": "free"}, "filter": {}}


def test_one_component_has_no_budget() -> None:
    with pytest.raises(InputError, match=r"one_component.* has \[one_component\]"):
        sinssim.budget(sinssim.load_scenario("one_component"))


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("attitude_sensor", "measured and not integrated"),
        ("gyro_free", "differences of accelerometers"),
        ("parked", "gimbals rotate the sensors"),
    ],
)
def test_other_sets_of_sensors_have_no_budget(name: str, reason: str) -> None:
    settings = ("imu.sensor_set.type=platform", "navigation.algorithms=['platform']") if name == "parked" else ()
    with pytest.raises(InputError, match=rf"imu\.sensor_set\.type = .* has no budget: .*{reason}.* Use an ensemble"):
        sinssim.budget(sinssim.load_scenario(name, settings))


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ((), r"imu\.faults of a redundant set have no budget: the monitoring excludes sensors"),
        (
            (
                "imu.faults=[]",
                "imu.gyro_range_deg_s=1",
                "flight.legs.1.duration_s=30",
                "flight.legs.3.duration_s=10",
                "flight.legs.5.duration_s=10",
            ),
            "the gyro range of a redundant set has no budget: single sensors",
        ),
    ],
)
def test_what_a_redundant_set_has_no_budget_of(settings: tuple[str, ...], reason: str) -> None:
    with pytest.raises(InputError, match=rf"{reason}.* use an ensemble"):
        sinssim.budget(sinssim.load_scenario("redundant_set", settings))


def test_every_other_set_has_a_reason() -> None:
    kinds = {get_args(one.model_fields["type"].annotation)[0] for one in get_args(get_args(SensorSet)[0])}
    assert kinds - {"gyros", "redundant"} == set(_OTHER_SETS)


def test_an_alignment_in_motion_has_no_budget() -> None:
    with pytest.raises(InputError, match=r'filter.alignment = "in-motion" has no budget'):
        sinssim.budget(sinssim.load_scenario("align_in_motion"))


def test_a_master_has_no_budget() -> None:
    with pytest.raises(InputError, match=r"\[aiding.master\] has no budget"):
        sinssim.budget(scenario(**_AIDED, aiding={"master": {}}))


def test_a_sensor_with_other_random_errors_has_no_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """A key for a random error that does not have sigma in its name."""
    usual = Barometer.read

    def read(self: Barometer, vehicle: Vehicle) -> list[AidingReadings]:
        return usual(self.model_copy(update={"sigma_m": 1.0}), vehicle)

    monkeypatch.setattr(Barometer, "read", read)
    with pytest.raises(InputError, match=r"\[aiding.baro\] has no budget: baro has random errors in addition to"):
        sinssim.budget(scenario(**_AIDED, aiding={"baro": {}}))


def test_a_pole_has_no_budget() -> None:
    with pytest.raises(InputError, match=r"latitude 89\.9.* deg; .* 0\.5 deg of a pole"):
        sinssim.budget(scenario(parked={"latitude_deg": 89.9, "duration_s": 10.0}))


def test_wrong_names_and_times_are_refused() -> None:
    with pytest.raises(InputError, match='solution = "filter" needs a scenario with'):
        sinssim.budget(scenario(motion=SHORT_TURN), solution="filter")
    with pytest.raises(InputError, match="solution = 'both' must be"):
        sinssim.budget(scenario(motion=SHORT_TURN), solution="both")
    with pytest.raises(InputError, match="t = 100 s lies outside the run, which lasts 5"):
        sinssim.budget(scenario(motion=SHORT_TURN), times=(100.0,))


def test_without_errors_everything_is_zero() -> None:
    result = sinssim.budget(scenario(motion=SHORT_TURN))
    assert result.sources == ()
    assert not result.r95.any()
    assert not result.improvements()


def test_the_instants_that_are_asked_for() -> None:
    result = sinssim.budget(scenario(motion=SHORT_TURN, imu={"gyro_bias_sigma_deg_h": 1.0}), times=(7.35, 20.0))
    assert result.time[result.row(7.35)] == pytest.approx(7.35)
    assert result.time[0] == 0.0
    assert np.all(np.diff(result.time) > 0.0)
    with pytest.raises(InputError, match="the budget has no time"):
        result.row(7.33)
    with pytest.raises(InputError, match="gyro_bias"):
        result.source("gyro_bius")


def test_progress_reaches_the_end() -> None:
    said: list[tuple[str, float]] = []
    sinssim.budget(scenario(motion=SHORT_TURN), progress=lambda stage, fraction: said.append((stage, fraction)))
    assert said[-1] == ("budget", 1.0)


def test_a_sensor_faster_than_its_latency() -> None:
    """Several readings wait at a time; the published solution holds exactly those that have arrived."""
    aiding = {"gnss": {"rate_hz": 2.0, "latency_s": 1.7}}
    tables = {**_AIDED, "imu": {"grade": "tactical"}, "aiding": aiding}
    late = sinssim.budget(scenario(**tables))
    prompt = sinssim.budget(scenario(**{**tables, "aiding": {"gnss": {"rate_hz": 2.0}}}))
    assert np.all(late.sigma()[30:, :2] >= prompt.sigma()[30:, :2] * (1.0 - 1e-9))
    aided = sinssim.run(scenario(**tables)).aided
    assert aided is not None
    rows = np.searchsorted(aided.estimate.time, late.time + aided.trajectory.start - 1e-6)
    assert late.filter_covariance is not None
    own = np.sqrt(np.einsum("kii->ki", late.filter_covariance))
    assert own == pytest.approx(aided.estimate.sigma[rows, :9], rel=1e-3)
