"""Sizes of the errors of a turning block's angles, readings of the emulator, and what a filter is told."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.analyses.error_budget import source_effects
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.analyses.error_budget.error_sources import angle_errors, of_turning
from sinssim.analyses.error_budget.source_effects import given_readings
from sinssim.data import ImuData
from sinssim.scenario import Scenario
from sinssim.scenario.true_motion import block_of
from tests.analyses.error_budget.worlds import scenario

ARCSEC = math.radians(1.0 / 3600.0)


def turning(**keys: Any) -> Scenario:
    rotation = {"type": "continuous", "rate_deg_s": 6.0, "inner_rate_deg_s": 2.0, **keys}
    return scenario(parked={"latitude_deg": 50.0, "duration_s": 20.0}, imu={"rate_hz": 5.0, "rotation": rotation})


def test_errors_of_the_angles_of_two_axes() -> None:
    """1σ as given, that of a step Q is Q/√12; given ones are counted with their largest, and act with their sign."""
    plan = turning(
        encoder_bias_sigma_arcsec=30.0, encoder_noise_arcsec=3.0, encoder_quantum_arcsec=12.0,
        encoder_bias_arcsec=[9.0, -20.0], encoder_periodic_arcsec=7.0, wobble_arcsec=5.0,
    )  # fmt: skip
    block = block_of(sinssim.fly(plan), plan.imu)
    found = angle_errors(plan, block)
    told = [(one.source.name, one.source.label, one.what, one.source.value, one.source.unit) for one in found]
    assert told == [
        ("encoder_bias", "encoder bias", "constant", 30.0, "arcsec"),
        ("encoder_noise", "encoder noise", "noise", 3.0, "arcsec"),
        ("encoder_quantum", "step of the encoder", "noise", 12.0, "arcsec"),
        ("encoder_given", "encoder errors equal in every run", "given", pytest.approx(20.0), "arcsec"),
        ("wobble", "wobble of the axis", "given", 5.0, "arcsec"),
    ]
    sizes = [one.size.tolist() for one in found]
    step = 12.0 / math.sqrt(12.0) * ARCSEC
    assert sizes[:3] == [
        pytest.approx([30.0 * ARCSEC] * 2), pytest.approx([3.0 * ARCSEC] * 2), pytest.approx([step] * 2),
    ]  # fmt: skip
    assert sizes[3:] == [[1.0], [1.0]]
    assert {one.source.group for one in found} == {"rotation"}
    _, covariance, mean = of_turning(plan, block, np.array([3.0, 11.0]))
    assert set(covariance) == {"encoder_bias", "encoder_noise", "encoder_quantum"}
    assert set(mean) == {"encoder_given", "wobble"}
    for name, size in (("encoder_bias", 30.0 * ARCSEC), ("encoder_quantum", step)):
        # two axes of unit length: the trace is that of both
        assert np.trace(covariance[name], axis1=1, axis2=2) == pytest.approx(2.0 * size**2)
        assert not covariance[name][:, :6].any()
    wobble = np.linalg.norm(mean["wobble"][:, 6:], axis=1)
    assert wobble == pytest.approx(5.0 * ARCSEC, rel=1e-6)
    assert not mean["wobble"][:, :6].any()
    assert not angle_errors(turning(), block)
    (periodic,) = angle_errors(turning(encoder_bias_arcsec=[9.0, -20.0], encoder_periodic_arcsec=25.0), block)
    assert periodic.source.value == pytest.approx(25.0)


def increments() -> ImuData:
    """Ten intervals of 0.1 s from 3 s on at (0.3, −0.2, 0.5) rad/s under (1, −2, −9) m/s²."""
    return ImuData(
        3.0 + 0.1 * np.arange(11), np.tile([0.03, -0.02, 0.05], (10, 1)), np.tile([0.1, -0.2, -0.9], (10, 1))
    )


def test_readings_that_are_the_same_in_every_run() -> None:
    """A range of 0.5 g holds the third axis at 4.903 m/s²; a step of 2 deg/h from 3.4 s on; each by itself."""
    fault = {"type": "bias-step", "from_s": 3.4, "gyro_deg_h": [2.0, 0.0, 0.0]}
    sources, theta, velocity = given_readings(scenario(imu={"accel_range_g": 0.5, "faults": [fault]}), increments())
    assert [(one.name, one.label, one.group, one.kind) for one in sources] == [
        ("range", "range of the sensors", "gyros", "one run"), ("faults", "faults", "gyros", "one run"),
    ]  # fmt: skip
    assert velocity[0] == pytest.approx(np.tile([0.0, 0.0, 0.9 - 0.0490332 * 10.0], (10, 1)), abs=1e-6)
    rate = math.radians(2.0) / 3600.0
    assert theta[1][:, 0] == pytest.approx([0.0] * 4 + [0.1 * rate] * 6, abs=1e-12)
    assert np.abs(theta[0]).max() < 1e-12
    assert np.abs(velocity[1]).max() < 1e-12


def test_size_of_an_unknown_field(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is felt in 0.1 s is at most 5e-5 m/s: 5e-4 m/s² are 50 mGal; the readings are less by it."""
    felt = np.zeros((10, 3))
    felt[3], felt[7] = [3e-5, 0.0, -4e-5], [1e-5, 2e-5, 2e-5]
    monkeypatch.setattr(source_effects, "unknown_field", lambda scenario: "field")
    monkeypatch.setattr(source_effects, "Disturbed", lambda *_: SimpleNamespace(felt=lambda time, dtheta: felt))
    (source,), theta, velocity = source_effects.field_readings(scenario(), None, increments())  # type: ignore[arg-type]
    assert (source.name, source.kind, source.value, source.unit) == ("gravity_model", "given", 50.0, "mGal")
    assert velocity.tolist() == [(-felt).tolist()]
    assert theta.shape == (1, 10, 3)
    assert not theta.any()


def test_a_filter_that_is_told_larger_noise() -> None:
    """Its own covariance is that of sensors of this noise; what the true noise does to it is a quarter of theirs."""

    def plan(factor: float, sigma: float) -> Scenario:
        start = {
            "position_sigma_m": 5.0,
            "velocity_sigma_mps": 0.3,
            "tilt_sigma_arcmin": 1.0,
            "heading_sigma_arcmin": 9.0,
        }
        noise = {"position_sigma_m": sigma, "height_sigma_m": 2.0 * sigma, "velocity_sigma_mps": 0.1 * sigma}
        return scenario(
            parked={"latitude_deg": 50.0, "duration_s": 8.0}, imu={"grade": "laser-standard", "rate_hz": 10.0},
            navigation={"vertical": "free", "initial_error": start}, aiding={"gnss": {"rate_hz": 1.0, **noise}},
            filter={"rate_hz": 2.0, "measurement_noise_factor": factor},
        )  # fmt: skip

    told, noisy = budget(plan(2.0, 1.5)), budget(plan(1.0, 3.0))
    assert told.filter_covariance is not None
    assert told.filter_covariance == pytest.approx(noisy.filter_covariance, rel=1e-9, abs=1e-18)
    for name in ("gnss_position_noise_ne", "gnss_velocity_noise"):
        assert 4.0 * told.covariance[name] == pytest.approx(noisy.covariance[name], rel=1e-9, abs=1e-18)
    assert told.covariance["initial_heading"] == pytest.approx(noisy.covariance["initial_heading"], rel=1e-9, abs=1e-18)
