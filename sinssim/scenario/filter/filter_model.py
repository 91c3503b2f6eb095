"""The error model of a scenario's filter: its states, their standard deviations and correlation times.

The standard deviations are those from which the emulated errors are drawn. An error that a scenario gives as a number
is unknown to the filter; its standard deviation is the magnitude of the number.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sinssim import units
from sinssim.estimation.model import Block, ErrorModel, error_model
from sinssim.scenario.filter.filter_states import inertial_sigma, states
from sinssim.scenario.filter.redundant_set import of_combination

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.sensors.aiding.base.sensor import SensorState

_LEAST_POSITION_M, _LEAST_VELOCITY_MPS, _LEAST_ANGLE_ARCMIN = 0.1, 0.01, 0.1
"""Assumed 1σ of an initial state that is exact, so that the covariance is not singular."""


class HasStates(Protocol):
    """A sensor with errors that are states of the filter."""

    def states(self) -> Iterator[SensorState]:
        """Yield them."""
        ...


def filter_model(scenario: Scenario, duration: float = 3600.0, recorded: Sequence[HasStates] = ()) -> ErrorModel:
    """Return the error model of a scenario's filter.

    Args:
        duration: of the run, s.
        recorded: descriptions of recorded sensors, beside the emulated ones of [aiding].

    Returns:
        The model with the blocks of navigation, of the inertial sensors (those that the section names or that matter),
        and of the aiding sensors.
    """
    f, start = scenario.filter, scenario.navigation.initial_error
    assert f is not None
    sensors = [*recorded, *(scenario.aiding.sensors().values() if scenario.aiding is not None else ())]

    def sigma_of(given: float | None, least: float, *known: float) -> float:
        return max(least, math.hypot(*known)) if given is None else given

    own, s = f.initial_sigma, start
    north = sigma_of(own.position_m, _LEAST_POSITION_M, s.position_sigma_m, s.north_m)
    east = sigma_of(own.position_m, _LEAST_POSITION_M, s.position_sigma_m, s.east_m)
    height = sigma_of(own.height_m, _LEAST_POSITION_M, s.height_sigma_m, s.height_m)
    velocity = [
        sigma_of(own.velocity_mps, _LEAST_VELOCITY_MPS, s.velocity_sigma_mps, v)
        for v in (s.velocity_north_mps, s.velocity_east_mps, s.velocity_down_mps)
    ]
    tilt = sigma_of(own.tilt_arcmin, _LEAST_ANGLE_ARCMIN, s.tilt_sigma_arcmin, s.roll_arcmin, s.pitch_arcmin)
    heading = sigma_of(own.heading_arcmin, _LEAST_ANGLE_ARCMIN, s.heading_sigma_arcmin, s.heading_arcmin)
    model = error_model(
        inertial_sigma(scenario),
        position=(north, east, height),
        velocity=velocity,
        attitude=np.array([tilt, tilt, heading]) * units.ARCMIN,
        imu=states(scenario),
        extra=_sensor_blocks(sensors, f.measurement_noise_factor),
        duration=duration,
    )
    return of_combination(model, scenario)


def _sensor_blocks(sensors: Sequence[HasStates], factor: float) -> Iterator[Block]:
    """Yield the blocks of the aiding sensors' errors, where the sensors have them."""
    for sensor in sensors:
        for state in sensor.states():
            if any(state.sigma):
                yield Block(state.block, factor * np.array(state.sigma), correlation_time=state.correlation_time)
