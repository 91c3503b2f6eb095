"""The parts of a one-component run, from readings and errors that are chosen."""

from __future__ import annotations

from math import cos, pi, sin
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import RunError
from sinssim.simulation import one_component_run
from sinssim.simulation.one_component_run import (
    PlaneReadings,
    _check_finite,
    _less,
    _with_middles,
    constant_errors,
    error_sources,
    navigate,
    only,
)
from sinssim.strapdown.one_component_system import PlaneErrors
from sinssim.truth.one_component import OneComponent

MICRO_G, DEG_H, SECOND, MINUTE = 9.80665e-6, pi / 648_000.0, pi / 648_000.0, pi / 10_800.0
TIME = np.array([3.0, 5.0, 9.0])
R = 2e6
INITIAL = {"position_m": 40.0, "velocity_mps": 0.7, "pitch_arcmin": 6.0}
SENSORS = {
    "measured": {
        "attitude_sensor": {"bias_arcsec": 20.0, "drift_deg_h": 0.3},
        "initial_error": {"position_m": 40.0, "velocity_mps": 0.7},
    },
    "one-integral": {"gyro": {"bias_deg_h": 0.3, "scale_ppm": 50.0}, "initial_error": INITIAL},
    "two-integrals": {
        "arm_accelerometer": {"arm_m": 0.5, "bias_ug": 30.0, "scale_ppm": 70.0},
        "initial_error": {**INITIAL, "rate_deg_h": 0.9},
    },
}


def section(variant: str) -> OneComponent:
    accelerometers = {
        "accelerometer_x": {"bias_ug": 100.0, "scale_ppm": 200.0},
        "accelerometer_y": {"bias_ug": -300.0, "scale_ppm": 500.0},
    }
    return OneComponent(
        variant=variant, duration_s=10.0, radius_m=R, gravity_mps2=8.0, **accelerometers, **SENSORS[variant]
    )


def test_constant_errors_of_a_body_at_rest() -> None:
    """At a pitch of 0.3 rad and g = 8 m/s², x feels g sin α and y feels g cos α; the third sensor sets Δω and Δω̇."""
    g, s, c = 8.0, sin(0.3), cos(0.3)
    x, y = 100.0 * MICRO_G + 200e-6 * g * s, -300.0 * MICRO_G + 500e-6 * g * c
    arm = (30.0 * MICRO_G + 70e-6 * g * c - y) / 0.5
    coordinate, tilt = 40.0 / R, 6.0 * MINUTE
    wanted = {
        "measured": (0.3 * DEG_H, 0.0, 20.0 * SECOND), "one-integral": (0.3 * DEG_H, 0.0, tilt - coordinate),
        "two-integrals": (0.9 * DEG_H, arm, tilt - coordinate),
    }  # fmt: skip
    for variant, (rate, acceleration, angle) in wanted.items():
        found = constant_errors(section(variant), 0.3)
        assert vars(found) == pytest.approx(
            {"force": x * c - y * s, "rate": rate, "acceleration": acceleration, "velocity": 0.7,
             "coordinate": coordinate, "angle": angle},
            rel=1e-12,
        ), variant  # fmt: skip


def readings(factor: float, **more: Any) -> PlaneReadings:
    return PlaneReadings(TIME, factor * np.array([[3.0, 5.0], [7.0, 11.0]]), **more)


@pytest.mark.parametrize("variant", list(SENSORS))
def test_what_drives_the_error_equations(variant: str) -> None:
    """Readings of twice the true ones: errors of the mean forces 1.5, 2.5 and 1.75, 2.75 m/s² over 2 and 4 s."""
    pairs = {
        "measured": {"angle": (np.array([0.1, 0.2, 0.4]), np.array([0.15, 0.35, 0.5]))},
        "one-integral": {"dtheta": (np.array([0.1, 0.2]), np.array([0.3, 1.0]))},
        "two-integrals": {"dvel_arm": (np.array([5.5, 11.25]), np.array([11.5, 22.5]))},
    }[variant]
    ideal, measured = (readings(k + 1.0, **{name: pair[k] for name, pair in pairs.items()}) for k in range(2))
    found = error_sources(ideal, measured, section(variant))
    assert found.force.tolist() == [[1.5, 2.5], [1.75, 2.75]]
    assert (found.velocity, found.coordinate) == (0.7, pytest.approx(2e-5))
    tilt = 6.0 * MINUTE - 2e-5
    if variant == "measured":  # errors of 0.05, 0.15, 0.1 rad
        rate, angle = [[0.05, 0.05], [-0.0125, -0.0125]], 0.05
    elif variant == "one-integral":  # 0.2 rad in 2 s, 0.8 rad in 4 s
        rate, angle = [[0.1, 0.1], [0.2, 0.2]], tilt
    else:  # the arm's errors 6 and 11.25 m/s less those of y, 5 and 11, over 0.5 m: 2 and 0.5 rad/s
        start = 0.9 * DEG_H
        rate, angle = [[start, start + 2.0], [start + 2.0, start + 2.5]], tilt
    np.testing.assert_allclose(found.rate, rate, rtol=1e-12, atol=1e-15)
    assert found.angle == pytest.approx(angle, rel=1e-12)


@pytest.mark.parametrize("variant", list(SENSORS))
def test_a_system_starts_with_its_initial_errors(variant: str, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: dict[str, Any] = {}
    for name in ("simulate", "simulate_measured", "simulate_two_integrals"):
        monkeypatch.setattr(
            one_component_run, name, lambda *args, name=name, **at: seen.update(name=name, args=args, at=at)
        )
    truth = SimpleNamespace(velocity=[200.0, 1.0], pitch=[0.3, 1.0], rate=[0.02, 1.0])
    increments = SimpleNamespace(coordinate=[0.4, 1.0])
    own = readings(
        1.0,
        **{"measured": {"angle": "a"}, "one-integral": {"dtheta": "d"}, "two-integrals": {"dvel_arm": "v"}}[variant],
    )
    navigate(own, section(variant), truth, increments)
    usual = {"velocity": 200.7, "coordinate": 0.4 + 2e-5, "radius": R}
    pitch = {"pitch": 0.3 + 6.0 * MINUTE}
    name, args, at = {
        "measured": ("simulate_measured", (own.time, "a", own.dvel), {}),
        "one-integral": ("simulate", (own.time, "d", own.dvel), pitch),
        "two-integrals": (
            "simulate_two_integrals",
            (own.time, "v", own.dvel, 0.5),
            {**pitch, "rate": 0.02 + 0.9 * DEG_H},
        ),
    }[variant]
    assert seen["name"] == name
    assert len(seen["args"]) == len(args)
    assert all(given is wanted or given == wanted for given, wanted in zip(seen["args"], args, strict=True))
    assert seen["at"] == pytest.approx({**usual, **at}, rel=1e-12)


@pytest.mark.parametrize("variant", list(SENSORS))
def test_one_group_of_sources_alone(variant: str) -> None:
    own = section(variant)
    third = {"measured": "attitude_sensor", "one-integral": "gyro", "two-integrals": "arm_accelerometer"}[variant]
    groups = {
        "accelerometers": ("accelerometer_x", "accelerometer_y"),
        "pitch sensor": (third,),
        "initial values": ("initial_error",),
    }
    for source in ("", *groups):
        alone = only(own, source)
        for name, tables in groups.items():
            for table in tables:
                same = getattr(alone, table) == getattr(own, table)
                assert same == (name == source), (source, table)
    if variant == "two-integrals":
        assert only(own, "").arm_accelerometer.arm_m == 0.5
        assert only(own, "").arm_accelerometer.bias_ug == 0.0


def test_differences_middles_and_errors_beyond_all_numbers() -> None:
    one = PlaneErrors(TIME, np.array([7.0, 8.0, 9.0]), np.array([1.0, 2.0, 4.0]), np.array([3.0, 5.0, 6.0]))
    two = PlaneErrors(TIME + 9.0, np.array([1.0, 3.0, 5.0]), np.array([9.0, 7.0, 1.0]), np.array([0.5, 0.25, 2.0]))
    found = _less(one, two)
    assert found.time is one.time
    assert (found.velocity.tolist(), found.coordinate.tolist(), found.pitch.tolist()) == (
        [6.0, 5.0, 4.0],
        [-8.0, -5.0, 3.0],
        [2.5, 4.75, 4.0],
    )
    assert _with_middles(TIME).tolist() == [3.0, 4.0, 5.0, 7.0, 9.0]
    _check_finite(one, two)
    bad = PlaneErrors(TIME, one.velocity, one.coordinate, np.array([3.0, np.inf, np.nan]))
    with pytest.raises(RunError, match=r"not finite from t = 5\.00 s on") as error:
        _check_finite(one, bad)
    assert error.value.time == 5.0


def test_the_noise_of_an_attitude_sensor() -> None:
    """Bias 20″, drift 3 deg/h and noise of 5″: σ of 4000 readings is 5″ to 4 % with 3.5 standard errors."""
    time = np.arange(4000.0) / 10.0
    ideal = PlaneReadings(time, np.zeros((3999, 2)), angle=np.zeros(4000))
    sensor = {"bias_arcsec": 20.0, "drift_deg_h": 3.0, "noise_arcsec": 5.0}
    system = OneComponent.model_validate({"variant": "measured", "duration_s": 400.0, "attitude_sensor": sensor})
    angle = one_component_run.with_errors(ideal, system, 3).angle
    assert angle is not None
    noise = angle / SECOND - 20.0 - 3.0 * time
    assert noise.std() == pytest.approx(5.0, rel=0.04)
    assert abs(noise.mean()) < 3.5 * 5.0 / 4000.0**0.5
