"""Air data: a barometric altimeter, and the true airspeed.

The altimeter measures height with errors of the pressure field, of the instrument and of its tube. In a flight with
[flight.atmosphere] it reads the pressure altitude: the height at which the standard atmosphere has the pressure around
the aircraft. Otherwise the air is taken for the standard atmosphere, and it reads the height.

The airspeed is for a flight by JSBSim the aircraft's own, for any other motion the speed through still air. It is the
magnitude of the velocity through the air, independent of the angles of attack and sideslip, as a pitot tube measures
it. The wind has states to the north and east. A vertical wind, which hardly affects the airspeed in level flight, has
none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import Field

from sinssim.data import Array, NavState
from sinssim.sensors.aiding_sensor import (
    AidingReadings,
    AidingSensor,
    SensorState,
    Vehicle,
    correlated,
    lagged,
    turn_on,
    white,
)
from sinssim.sensors.measurement_kind import Comparison, MeasurementKind, R, compare_velocity
from sinssim.toml_section import CorrelationTime, Moment, Noise, Offset, Spread
from sinssim.truth.atmosphere import STANDARD_TEMPERATURE, Air
from sinssim.units import PPM

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory


def _signal(trajectory: Trajectory, channel: str, still: Callable[[NavState], Array]) -> Callable[[Array], Array]:
    """Return a quantity of the air at instants, (K,): as logged along the motion, or that of still standard air."""
    logged = trajectory.channels.get(channel)
    if logged is None:
        return lambda t: np.asarray(still(trajectory.state(t)))
    return lambda t: np.asarray(np.interp(t, logged.time, logged.values))


def compare_height(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare the height above the ellipsoid, m; residual −δr_D."""
    h = at.zeros(1)
    h[:, 0, R.start + 2] = -1.0
    return at.state.height[:, None] - value, h


class Barometer(AidingSensor):
    """A barometric altimeter, which measures the height above the ellipsoid."""

    table: ClassVar = "baro"
    kinds: ClassVar = (
        MeasurementKind(
            "baro-height",
            columns=("height_m",),
            unit="m",
            compare=compare_height,
            diagnosed={"bias": 1000.0, "scale": 0.3},
        ),
    )

    sigma_m: Noise = Field(default=1.0, description="white noise")
    bias_m: Offset = Field(default=0.0, description="constant error, which is unknown to the filter")
    bias_sigma_m: Spread = Field(default=10.0, description="1σ of the Gauss-Markov error due to the pressure field")
    bias_correlation_time_s: CorrelationTime = Field(default=7200.0, description="correlation time of this error")
    scale_ppm: Offset | None = Field(default=None, description="given relative error of the height")
    scale_sigma_ppm: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")
    lag_s: Moment = Field(default=0.0, description="time constant of the sensor's first-order lag")

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return heights (1 + k) h + b + b(t) + ν, with h lagged; h is the pressure altitude if the air has one.

        The filter models a lag τ as a delay by τ, which is exact in a steady climb.
        """
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        height = _signal(trajectory, "pressure_altitude_m", lambda state: state.height)
        scale = PPM * turn_on(seed, "baro scale", s.scale_ppm, s.scale_sigma_ppm)
        bias = s.bias_m + correlated(seed, "baro bias", (s.bias_sigma_m,), time, s.bias_correlation_time_s)
        value = (1.0 + scale) * lagged(height, trajectory.start, time, s.lag_s)[:, np.newaxis] + bias
        value += white(seed, "baro noise", (s.sigma_m,), len(time))
        true = {"baro bias": bias, "baro scale": np.array([scale])}
        if "pressure_altitude_m" in trajectory.channels:
            of_air = _scale_of_air(trajectory) if self.scale_sigma_ppm or self.scale_ppm else 0.0  # all in the bias
            true["baro scale"] = np.array([(1.0 + scale) * (1.0 + of_air) - 1.0])
            field = height(time) - (1.0 + of_air) * trajectory.state(time).height
            true["baro bias"] = bias + (1.0 + scale) * field[:, np.newaxis]
        return [s.readings("baro", "baro-height", time, value, (s.sigma_m,), true, lag=s.lag_s)]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the pressure field's error and of the scale factor."""
        yield SensorState("baro bias", (self.bias_sigma_m,), self.bias_correlation_time_s, key="bias_sigma_m")
        scale = PPM * math.hypot(self.scale_sigma_ppm, self.scale_ppm or 0.0)
        yield SensorState("baro scale", (scale,), key="scale_sigma_ppm")


def _scale_of_air(trajectory: Trajectory) -> float:
    """Return the relative error of the pressure altitude in the troposphere, −ΔT/(T0 + ΔT).

    Pressure falls with the power g/(RL) of (T0 + ΔT − L H)/(T0 + ΔT), so that equal pressures lie at geopotential
    heights H in the ratio of the temperatures at sea level.
    """
    temperature = trajectory.channels["static_temperature_k"]
    first = float(trajectory.state(temperature.time[:1]).height[0])
    deviation = float(temperature.values[0]) - Air().temperature(first)
    return -deviation / (STANDARD_TEMPERATURE + deviation)


_SLOWEST_MPS = 15.0
"""Lowest airspeed with readings, m/s: 30 kt, the lower limit of air-data computers (ARINC 706). Below it the dynamic
pressure is less than 140 Pa, and the wind may come from any side."""


def _through_the_air(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare |u|, u = v + C (ω × l) − w with the known wind w; residual u/|u| · (the velocity residual − δw)."""
    states = at.states("wind")
    wind = np.zeros(3) if states is None else np.append(at.known("wind"), 0.0)
    through_air, h = compare_velocity(at, wind)
    if states is not None:
        h[:, :2, states] = np.eye(2)  # true wind minus known wind, as for all parameters of a reading
    speed = np.linalg.norm(through_air, axis=1, keepdims=True)
    # at rest in still air the magnitude has no derivative: forward airflow is assumed
    ahead = np.divide(through_air, speed, out=at.c_nb[:, :, 0].copy(), where=speed > 0.0)
    return speed - value, ahead[:, None] @ h


class Airspeed(AidingSensor):
    """An airspeed sensor, which measures the magnitude of the velocity relative to the air; the filter does not know
    the wind."""

    table: ClassVar = "airspeed"
    kinds: ClassVar = (
        MeasurementKind(
            "airspeed",
            columns=("airspeed_mps",),
            unit="mps",
            compare=_through_the_air,
            rounding="accelerometers",
            of_north=True,
            own_errors={"wind": (("n", "e"), "mps")},
            diagnosed={"bias": 30.0, "scale": 0.3, "wind": 30.0},
        ),
    )

    sigma_mps: Noise = Field(default=1.0, description="white noise")
    bias_mps: Offset | None = Field(default=None, description="given constant error")
    bias_sigma_mps: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")
    scale_ppm: Offset | None = Field(default=None, description="given relative error of the airspeed")
    scale_sigma_ppm: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")
    lag_s: Moment = Field(default=0.0, description="time constant of the sensor's first-order lag")
    wind_sigma_mps: Spread = Field(
        default=10.0,
        description="1σ of the north wind, and of the east wind, in the model of the filter; vertical wind is not "
        "modelled",
    )
    wind_correlation_time_s: CorrelationTime = Field(
        default=1200.0, description="correlation time of the wind in the model of the filter"
    )

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return airspeeds (1 + k) V + b + ν, with V lagged.

        V is the magnitude of the velocity through the air, as a pitot tube measures it at usual angles of attack and
        sideslip. Below 15 m/s there is no reading. The filter models the readings as the magnitude of the ground
        velocity minus the wind, and a lag τ as a delay by τ.
        """
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        speed = _signal(trajectory, "airspeed_mps", lambda state: np.linalg.norm(state.velocity_ned, axis=1))
        scale = PPM * turn_on(seed, "airspeed scale", s.scale_ppm, s.scale_sigma_ppm)
        bias = turn_on(seed, "airspeed bias", s.bias_mps, s.bias_sigma_mps)
        value = (1.0 + scale) * lagged(speed, trajectory.start, time, s.lag_s)[:, np.newaxis] + bias
        true = {
            "airspeed bias": np.array([bias]),
            "airspeed scale": np.array([scale]),
            "airspeed wind": _wind(trajectory, time),
        }
        value = value + white(seed, "airspeed noise", (s.sigma_mps,), len(time))
        fast = speed(time) >= _SLOWEST_MPS
        return [s.readings("airspeed", "airspeed", time, value, (s.sigma_mps,), true, valid=fast, lag=s.lag_s)]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the sensor's errors and of the wind."""
        bias = math.hypot(self.bias_sigma_mps, self.bias_mps or 0.0)
        yield SensorState("airspeed bias", (bias,), key="bias_sigma_mps")
        scale = PPM * math.hypot(self.scale_sigma_ppm, self.scale_ppm or 0.0)
        yield SensorState("airspeed scale", (scale,), key="scale_sigma_ppm")
        tau = self.wind_correlation_time_s
        yield SensorState("airspeed wind", (self.wind_sigma_mps,) * 2, tau, key="wind_sigma_mps", drawn=False)


def _wind(trajectory: Trajectory, time: Array) -> Array:
    """Return the north and east wind at some instants, (M, 2) m/s; zero if the trajectory has no log of the wind."""
    axes = [trajectory.channels.get(f"wind_{axis}_mps") for axis in ("north", "east")]
    return np.column_stack(
        [np.zeros(len(time)) if axis is None else np.interp(time, axis.time, axis.values) for axis in axes]
    )
