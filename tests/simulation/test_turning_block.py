"""Navigation with a block that turns in the vehicle: residual drift, scale factor, encoders, and step halving."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim import rotation
from sinssim.experiments.run.run_execution import run
from sinssim.experiments.run.run_result import Run
from sinssim.scenario.schema import Scenario
from sinssim.strapdown.navigation_error import NavError
from sinssim.units import ARCSEC, DEG, DEG_H, PPM, UG
from tests.oracles.parked_errors import errors
from tests.simulation.test_published_oscillations import LATITUDE, NONE, F, driven
from tests.slow import slow

TURNING = {"type": "continuous", "rate_deg_s": 6.0}


def scenario(turning: dict[str, Any] | None, seconds: float, rate_hz: float = 10.0, **imu: Any) -> Scenario:
    rotating = {} if turning is None else {"rotation": turning}
    return Scenario.model_validate(
        {
            "name": "turning",
            "parked": {"latitude_deg": 45.0, "longitude_deg": 10.0, "altitude_m": 0.0, "duration_s": seconds},
            "imu": {"grade": "ideal", "rate_hz": rate_hz, **rotating, **imu},
            "navigation": {"vertical": "truth"},
        }
    )


def error_of(done: Run) -> NavError:
    (found,) = done.errors.values()
    return found


@pytest.mark.parametrize(
    ("key", "value", "size", "what"),
    [
        ("gyro_bias_deg_h", (0.1, 0.0, 0.0), -0.1 * DEG_H, 0),
        *slow(("gyro_bias_deg_h", (0.0, 0.1, 0.0), -0.1 * DEG_H, 1)),
        ("accel_bias_ug", (500.0, 0.0, 0.0), 500.0 * UG, 3),
    ],
)
def test_residual_drift_of_a_constant_error_in_the_plane_of_rotation(
    key: str, value: tuple[float, ...], size: float, what: int
) -> None:
    """Errors that turn with the block drive the classical equations as cos Ωt and sin Ωt: one matrix exponential."""
    hours, rate = 2.0, 6.0 * DEG
    found = error_of(run(scenario(TURNING, 3600.0 * hours, **{key: value})))
    along, across = np.zeros(7), np.zeros(7)
    first, second = (what, what + 1) if what != 1 else (1, 0)
    along[first], across[second] = size, size if what != 1 else -size
    expected = errors(F, NONE, NONE, along, across, rate, 5.0, int(hours * 720.0))
    rows = slice(None, None, 50)
    got = np.hstack([found.attitude[rows], found.velocity_ned[rows, :2], found.position_ned[rows, :2]])
    peak = np.abs(expected).max(axis=0)
    peak[:3] = peak[:2].max()  # a bias in the plane hardly reaches the heading
    assert np.all(np.abs(got - expected).max(axis=0) <= 0.02 * peak), np.abs(got - expected).max(axis=0) / peak
    # the same error at rest, without any turning
    still = errors(F, NONE, along, NONE, NONE, 1.0, 60.0, int(hours * 60.0))
    assert np.abs(got[:, 5:]).max() < 0.02 * np.abs(still[:, 5:]).max()


def test_the_bias_along_the_axis_stays() -> None:
    hours = 2.0
    found = error_of(run(scenario(TURNING, 3600.0 * hours, gyro_bias_deg_h=(0.0, 0.0, 0.1))))
    expected = errors(F, NONE, driven(drift=2, size=0.1 * DEG_H), NONE, NONE, 1.0, 60.0, int(hours * 60.0))
    largest = np.abs(expected[:, 5:]).max(axis=0)
    assert np.all(np.abs(found.position_ned[::600, :2] - expected[:, 5:]).max(axis=0) <= 0.02 * largest)


def test_the_scale_factor_drifts_with_the_turning_and_reversal_cancels_it() -> None:
    """A scale factor k turns the heading by −k Ω t; forwards and back it returns after each pair of turns."""
    scale, seconds = 10.0, 1240.0
    found = error_of(run(scenario(TURNING, seconds, gyro_scale_ppm=(0.0, 0.0, scale))))
    per_second = 6.0 * DEG * scale * PPM
    assert found.attitude[-1, 2] == pytest.approx(-per_second * seconds, rel=0.01)
    both = {"type": "reversing", "rate_deg_s": 6.0, "turn_deg": 360.0, "ramp_s": 1.0}  # 61 s a turn, 122 s a pair
    back = error_of(run(scenario(both, seconds, gyro_scale_ppm=(0.0, 0.0, scale))))
    assert np.abs(back.attitude[:, 2]).max() == pytest.approx(scale * PPM * 2.0 * np.pi, rel=0.05)
    # what remains after a pair is the scale factor times the Earth's rate
    earth_alone = 7.292115e-5 * np.sin(LATITUDE) * scale * PPM * 122.0
    assert abs(back.attitude[1220, 2]) == pytest.approx(earth_alone, rel=0.05)


def test_errors_of_the_angles_enter_the_attitude_alone_and_directly() -> None:
    turning = {
        **TURNING,
        "encoder_bias_arcsec": (20.0, 0.0),
        "encoder_periodic_arcsec": 8.0,
        "encoder_cycles": 2,
        "encoder_quantum_arcsec": 0.5,
        "wobble_arcsec": 12.0,
        "wobble_cycles": 3,
    }
    done = run(scenario(turning, 120.0))
    found, exact = error_of(done), error_of(run(scenario(TURNING, 120.0)))
    angle = 6.0 * DEG * done.truth.time
    expected = 20.0 + 8.0 * np.sin(2.0 * angle)
    assert found.attitude[:, 2] / ARCSEC == pytest.approx(expected, abs=0.26)  # half a step of the encoder
    # the axis tilts by the wobble, in a direction that goes round three times in a turn; the reading does not see it
    assert np.hypot(*found.attitude[:, :2].T) / ARCSEC == pytest.approx(np.full(len(angle), 12.0), rel=1e-3)
    around = np.unwrap(np.arctan2(found.attitude[:, 1], found.attitude[:, 0]))
    assert around[-1] - around[0] == pytest.approx(3.0 * angle[-1], rel=1e-3)
    assert np.abs(found.position_ned - exact.position_ned).max() < 1e-5


def test_noise_of_an_encoder_has_its_sigma() -> None:
    """10 000 readings: the 1σ is right to 4 %, five times its own standard error, a chance of failure of 1e-6."""
    found = error_of(run(scenario({**TURNING, "encoder_noise_arcsec": 5.0}, 1000.0)))
    assert np.std(found.attitude[:, 2]) / ARCSEC == pytest.approx(5.0, rel=0.04)


def test_step_halving_has_fourth_order() -> None:
    turning = {"type": "indexed", "rate_deg_s": 20.0, "ramp_s": 1.0, "dwell_s": 5.0, "wobble_arcsec": 100.0}
    at_rates = []
    for rate in (10.0, 20.0, 40.0):
        done = run(scenario({**turning, "wobble_arcsec": 0.0}, 240.0, rate))
        at_rates.append(np.abs(error_of(done).position_ned).max())
    assert at_rates[0] / at_rates[1] > 12.0
    assert at_rates[1] / at_rates[2] > 12.0


def test_the_same_sensors_at_rest_are_those_of_a_scenario_without_the_table() -> None:
    keys = {"grade": "laser-standard"}
    beside = run(scenario(TURNING, 300.0, **keys)).parts["rotation"].without_rotation
    alone = error_of(run(scenario(None, 300.0, **keys)))
    assert beside is not None
    np.testing.assert_array_equal(beside.position_ned, alone.position_ned)
    np.testing.assert_array_equal(beside.attitude, alone.attitude)


def test_the_solution_has_the_attitude_of_the_vehicle() -> None:
    done = run(
        scenario({"type": "continuous", "rate_deg_s": 10.0, "inner_rate_deg_s": 7.0, "axis": (1.0, 0.0, 0.0)}, 60.0)
    )
    (solution,) = done.solutions.values()
    roll, pitch, heading = rotation.euler_from_quaternion(solution.q_nb)
    assert np.abs(np.stack([roll, pitch, np.sin(heading)])).max() < 1e-9
