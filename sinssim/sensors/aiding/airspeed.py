"""True airspeed: of a flight by JSBSim the aircraft's own, of any other motion the speed through still air."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array
from sinssim.scenario.aiding import AirspeedSection
from sinssim.sensors.aiding.lag import lagged
from sinssim.sensors.aiding.noise import turn_on, white
from sinssim.sensors.aiding.readings import Sensed, epochs, sensed
from sinssim.truth.trajectory import Trajectory
from sinssim.units import PPM


def airspeed(trajectory: Trajectory, section: AirspeedSection, seed: int = 0) -> Sensed:
    """Return what an airspeed sensor reads: (1 + k) V + b + ν, with V lagged.

    Args:
        trajectory: the true motion of the sensor block.
        section: the sensor.
        seed: the run's seed.

    Returns:
        Speeds. For the filter they are speeds along the forward axis of the velocity over ground less the wind, a lag
        being so much of a delay.

    Raises:
        InputError: the motion is over before the first reading, or the seed cannot be used.
    """
    s = section
    time = epochs(trajectory, s, "airspeed")
    logged = trajectory.channels.get("airspeed_mps")

    def speed(t: Array) -> Array:
        if logged is not None:
            return np.asarray(np.interp(t, logged.time, logged.values))
        return np.asarray(np.linalg.norm(trajectory.state(t).velocity_ned, axis=1))

    scale = PPM * turn_on(seed, "airspeed scale", s.scale_ppm, s.scale_sigma_ppm)
    bias = turn_on(seed, "airspeed bias", s.bias_mps, s.bias_sigma_mps)
    value = (1.0 + scale) * lagged(speed, trajectory.start, time, s.lag_s)[:, np.newaxis] + bias
    true = {
        "airspeed bias": np.array([bias]),
        "airspeed scale": np.array([scale]),
        "airspeed wind": _wind(trajectory, time),
    }
    value = value + white(seed, "airspeed noise", (s.sigma_mps,), len(time))
    return sensed("airspeed", "speed", s, time, value, (s.sigma_mps,), true, lag=s.lag_s)


def _wind(trajectory: Trajectory, time: Array) -> Array:
    """Return the wind to the north and east at some instants, (M, 2) m/s; still air where nobody tells."""
    found = [trajectory.channels.get(f"wind_{axis}_mps") for axis in ("north", "east")]
    return np.column_stack(
        [np.zeros(len(time)) if axis is None else np.interp(time, axis.time, axis.values) for axis in found]
    )
