"""Vibration as the sensors tell it: rectification, coning and sculling against closed forms, and on shock mounts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.data import ImuData
from sinssim.scenario import Scenario
from sinssim.scenario.true_motion import fly
from sinssim.sensors import draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.size_effect import rectified
from sinssim.truth.motions.mounted_block import Vibrating
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.truth.motions.vibration import Mount, Tone, band_noise

G0 = 9.80665
UG = 1e-6 * G0
DEG = np.pi / 180.0
LEVEL = [1.0, 0.0, 0.0, 0.0]


def parked(duration: float = 4.0) -> Parked:
    return Parked(0.8, 0.3, 100.0, LEVEL, duration)


def shaken(name: str, rms_g: float, frequency: float, phase: float = 0.0) -> Tone:
    """A displacement whose acceleration is √2 rms_g sin(ωt + phase)."""
    return Tone(name, -np.sqrt(2.0) * rms_g * G0 / (2.0 * np.pi * frequency) ** 2, frequency, phase)


def mean_error(truth: Vibrating, section: Imu, rate_hz: float = 100.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean errors of the readings, rad/s and m/s²."""
    ideal, errors = truth.increments(rate_hz), draw(section)
    measured = emulate(rectified(truth, ideal, errors), errors)
    t = ideal.time[-1] - ideal.time[0]
    return (measured.dtheta - ideal.dtheta).sum(axis=0) / t, (measured.dvel - ideal.dvel).sum(axis=0) / t


@pytest.mark.parametrize("frequency", [7.0, 73.0, 250.0])
def test_vibration_rectification_of_a_sinusoid(frequency: float) -> None:
    """K₂ = 20 µg/g² under 0.3 g rms: 20 · (1 + 0.09) µg, whether the samples see the vibration or not."""
    truth = Vibrating(parked(), [shaken("down", 0.3, frequency, 0.7)])
    section = Imu(grade="ideal", accel_quadratic_ug_per_g2=(0.0, 0.0, 20.0))
    gravity = truth.increments(100.0).dvel[:, 2].sum() / 4.0 / G0  # and a vibration in whole periods has no mean
    assert mean_error(truth, section)[1][2] / UG == pytest.approx(20.0 * (gravity**2 + 0.3**2), rel=1e-6)


def test_vibration_rectification_of_noise() -> None:
    """K₂σ² of noise of 0.5 g between 50 and 500 Hz; K₃ leaves 3K₃x̄σ² on top of gravity."""
    noise = band_noise("down", 0.5 * G0, 50.0, 500.0, 3, of_acceleration=True)
    truth = Vibrating(parked(5.0), noise)
    still = Vibrating(parked(5.0))
    for errors, expected in (
        ({"accel_quadratic_ug_per_g2": (0.0, 0.0, 20.0)}, 20.0 * 0.25),
        ({"accel_cubic_ug_per_g3": (0.0, 0.0, 20.0)}, 3.0 * 20.0 * -1.0 * 0.25),
    ):
        section = Imu(grade="ideal", **errors)
        extra = mean_error(truth, section)[1][2] - mean_error(still, section)[1][2]
        assert extra / UG == pytest.approx(expected, rel=0.02)  # 50 tones, not all beats in whole periods


@pytest.mark.parametrize("phase", [0.0, 60.0, 90.0, 180.0])
def test_vibro_pendulous_error(phase: float) -> None:
    """C_xz under 0.2 g forward and 0.3 g down, rms, in step: C a_x a_z cos φ; at rest there is no input forward."""
    tones = [shaken("forward", 0.2, 61.0), shaken("down", 0.3, 61.0, phase * DEG)]
    section = Imu(grade="ideal", accel_cross_axis_ug_per_g2=(0.0, 30.0, 0.0, 0.0, 0.0, 0.0))
    found = mean_error(Vibrating(parked(), tones), section)[1]
    assert found[0] / UG == pytest.approx(30.0 * 0.2 * 0.3 * np.cos(phase * DEG), abs=1e-5)
    assert np.abs(found[1:]).max() < 1e-12


@pytest.mark.parametrize(("asymmetry", "left"), [(0.0, 1e-4), (1.0, 0.02)])
def test_all_bent_responses_against_fast_samples(asymmetry: float, left: float) -> None:
    """What the emulator makes of samples that are fast against the vibration, summed: an error of (ωT)²/12 of it.

    The corner of |x| costs more, since quadrature goes over it.
    """
    tones = [
        Tone("roll", 2e-3, 31.0, 0.3),
        Tone("pitch", 3e-3, 31.0, 1.2),
        Tone("yaw", 1e-3, 47.0),
        shaken("forward", 0.4, 61.0),
        shaken("down", 0.2, 61.0, 0.4),
        shaken("right", 0.3, 83.0, 2.0),
    ]
    truth = Vibrating(parked(1.0), tones)
    errors = draw(
        Imu(
            grade="ideal",
            gyro_misalignment_arcsec=(300.0, -200.0, 100.0, 50.0, 20.0, -10.0),
            gyro_asymmetry_ppm=(200.0 * asymmetry, 100.0 * asymmetry, -50.0 * asymmetry),
            gyro_quadratic_ppm_per_deg_s=(20.0, -10.0, 5.0),
            gyro_cubic_ppm_per_deg2_s2=(1.0, 0.5, -0.3),
            accel_misalignment_arcsec=(-300.0, 200.0, 100.0, 150.0, 20.0, -60.0),
            accel_asymmetry_ppm=(100.0 * asymmetry, -200.0 * asymmetry, 30.0 * asymmetry),
            accel_quadratic_ug_per_g2=(20.0, 30.0, -10.0),
            accel_cubic_ug_per_g3=(10.0, 5.0, -3.0),
            accel_cross_axis_ug_per_g2=(10.0, 20.0, -30.0, 5.0, 15.0, 25.0),
            accel_scale_ppm=(300.0, -200.0, 100.0),
        )
    )
    ideal = truth.increments(50.0)
    slow = emulate(rectified(truth, ideal, errors), errors)
    fine = truth.increments(50.0 * 400)
    fast = emulate(fine, errors)
    sums = ImuData(ideal.time, *(rows.reshape(50, 400, 3).sum(axis=1) for rows in (fast.dtheta, fast.dvel)))
    for name in ("dtheta", "dvel"):
        missing = np.abs(getattr(emulate(ideal, errors), name) - getattr(sums, name)).max()
        assert np.abs(getattr(slow, name) - getattr(sums, name)).max() < left * missing


@pytest.mark.parametrize("frequency", [7.0, 73.0, 250.0])
def test_size_effect_of_fast_turns(frequency: float) -> None:
    """Turns φ sin Ωt about the down axis: the forward accelerometer at r feels −½(φΩ)²r, however slow the samples."""
    amplitude, arm = 1e-4, 0.05
    truth = Vibrating(parked(), [Tone("yaw", amplitude, frequency)])
    section = Imu(grade="ideal", accel_arms_mm=((1e3 * arm, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    expected = -0.5 * (amplitude * 2.0 * np.pi * frequency) ** 2 * arm
    assert mean_error(truth, section)[1][0] == pytest.approx(expected, rel=1e-3, abs=1e-9)  # and Earth rate's 4e-10


def test_size_effect_as_accelerometers_at_their_places_feel_it() -> None:
    """Each sample, against ∫[ω̇ × r + ω × (ω × r)] dt by many points, ω̇ from differences of ω."""
    tones = [Tone("roll", 1e-3, 31.0, 0.3), Tone("pitch", 2e-3, 83.0, 1.2), Tone("yaw", 1e-3, 147.0)]
    arms = np.array([[0.05, -0.02, 0.03], [-0.03, 0.06, 0.02], [0.01, 0.03, -0.06]])
    block = Vibrating(parked(1.0), [*tones, shaken("down", 0.2, 61.0)])
    ideal, errors = block.increments(100.0), ImuErrors(arms=arms)
    found = emulate(rectified(block, ideal, errors), errors).dvel - ideal.dvel

    step, points = 2e-6, 1000
    middles = (ideal.time[:-1, None] + (np.arange(points) + 0.5) * 0.01 / points).ravel()
    omega = block.rates(middles)[0]
    change = (block.rates(middles + step)[0] - block.rates(middles - step)[0]) / (2.0 * step)
    for i, arm in enumerate(arms):
        pull = np.cross(change, arm) + np.cross(omega, np.cross(omega, arm))
        exact = pull[:, i].reshape(-1, points).sum(axis=1) * 0.01 / points
        assert np.abs(found[:, i] - exact).max() < 1e-5 * np.abs(exact).max()
        assert np.abs(emulate(ideal, errors).dvel[:, i] - ideal.dvel[:, i] - exact).max() > 1e-2 * np.abs(exact).max()


def test_arms_and_bent_responses_together_are_both_alone() -> None:
    """Gyros, too: what they do to a turn is no arm of an accelerometer."""
    block = Vibrating(parked(1.0), [Tone("roll", 1e-3, 31.0, 0.3), Tone("yaw", 2e-3, 83.0), shaken("down", 0.2, 61.0)])
    ideal = block.increments(100.0)
    arms = np.array([[0.05, -0.02, 0.03], [-0.03, 0.06, 0.02], [0.01, 0.03, -0.06]])
    gyro, accel = (TriadErrors(quadratic=size * np.array([1.0, -2.0, 3.0])) for size in (1e-3, 1e-4))
    both, armed, bent = (
        rectified(block, ideal, errors)
        for errors in (ImuErrors(gyro, accel, arms=arms), ImuErrors(arms=arms), ImuErrors(gyro, accel))
    )
    for name in ("dtheta", "dvel"):
        parts = [getattr(one, name) - getattr(ideal, name) for one in (both, armed, bent)]
        np.testing.assert_allclose(parts[0], parts[1] + parts[2], rtol=0.0, atol=1e-15)
        assert np.abs(parts[2]).max() > 1e-10
    np.testing.assert_array_equal(armed.dtheta, ideal.dtheta)
    assert np.abs(armed.dvel - ideal.dvel).max() > 1e-8


def test_nothing_to_add() -> None:
    truth = Vibrating(parked(), [shaken("down", 0.3, 73.0)])
    ideal = truth.increments(100.0)
    assert rectified(truth, ideal, draw(Imu(grade="tactical"))) is ideal
    bent = draw(Imu(grade="ideal", accel_quadratic_ug_per_g2=(0.0, 0.0, 20.0)))
    still = parked()
    ideal = still.increments(100.0)
    assert rectified(still, ideal, bent) is ideal


SHAKEN: dict[str, Any] = {
    "name": "shaken",
    "parked": {"latitude_deg": 45.0, "duration_s": 8.0},
    "imu": {"grade": "ideal", "accel_quadratic_ug_per_g2": [0.0, 0.0, 20.0]},
    "vibration": [{"coordinate": "down", "rms_g": 0.4, "low_hz": 120.0}],
}


def test_rectification_in_a_run_on_shock_mounts() -> None:
    """A run has it: K₂σ² of what the mounts let through."""
    found = []
    for isolator in (None, {"linear_hz": 60.0, "linear_damping": 0.15, "angular_hz": 60.0}):
        result = sinssim.run(Scenario.model_validate({**SHAKEN, "isolator": isolator}))
        extra = (result.sensed.measured.dvel - result.truth.ideal.dvel)[:, 2].sum() / 8.0 / UG
        gravity = result.truth.ideal.dvel[:, 2].sum() / 8.0 / G0
        found.append(extra / 20.0 - gravity**2)
    assert found[0] == pytest.approx(0.16, rel=1e-5)
    assert found[1] == pytest.approx(0.16 * abs(Mount(60.0, 0.15).transfer(120.0)) ** 2, rel=1e-5)


@pytest.mark.parametrize("phase", [90.0, 30.0, -45.0])
def test_coning_in_the_gyros(phase: float) -> None:
    """Pitch and yaw out of step: the roll gyro turns at ½ φ_p φ_y ω sin phase, the block not at all."""
    pitch, yaw, frequency = 1e-3, 2e-3, 40.0
    mount = Mount(25.0, 0.2)
    vibrations = [
        {"coordinate": "pitch", "rms_arcsec": pitch / np.sqrt(2.0) / DEG * 3600.0, "low_hz": frequency},
        {"coordinate": "yaw", "rms_arcsec": yaw / np.sqrt(2.0) / DEG * 3600.0, "low_hz": frequency, "phase_deg": phase},
    ]
    scenario = {"name": "cone", "parked": {"latitude_deg": 45.0, "duration_s": 4.0}, "vibration": vibrations}
    still = fly(Scenario.model_validate({**scenario, "vibration": []})).increments(100.0)
    drift = 0.5 * pitch * yaw * 2.0 * np.pi * frequency * np.sin(phase * DEG)
    for isolator, gain in (
        (None, 1.0),
        ({"linear_hz": 9.0, "angular_hz": 25.0}, abs(mount.transfer(frequency)) ** 2),
    ):
        imu = fly(Scenario.model_validate({**scenario, "isolator": isolator})).increments(100.0)
        rate = (imu.dtheta - still.dtheta).sum(axis=0)[0] / 4.0
        assert rate == pytest.approx(gain * drift, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("phase", [0.0, 70.0, 90.0, 180.0])
def test_sculling_in_the_accelerometers(phase: float) -> None:
    """Roll and a push to the right in step: the down accelerometer reads −½ θ a cos phase, and the tilt's ¼ θ² g."""
    theta, frequency = 2e-3, 30.0
    push = shaken("right", 0.5, frequency, phase * DEG)
    truth = Vibrating(parked(), [Tone("roll", theta, frequency), push])
    still = parked().increments(100.0).dvel[:, 2].sum() / 4.0
    found = truth.increments(100.0).dvel[:, 2].sum() / 4.0 - still
    a = np.sqrt(2.0) * 0.5 * G0
    assert found == pytest.approx(-0.5 * theta * a * np.cos(phase * DEG) - 0.25 * theta**2 * still, abs=2e-8)
