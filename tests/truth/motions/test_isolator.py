"""Shock mounts: the transfer function against the mount's own differential equation, and from a scenario."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp

from sinssim.errors import InputError
from sinssim.scenario import Scenario
from sinssim.scenario.true_motion import fly
from sinssim.truth.motions.mounted_block import Vibrating
from sinssim.truth.motions.vibration import Isolator, Mount, Tone, Vibration
from tests.slow import slow

PARKED = {"name": "x", "parked": {"latitude_deg": 45.0, "duration_s": 8.0}}


@pytest.mark.parametrize("frequency", [30.0, 70.0, *slow(3.0, 27.0)])
def test_transfer_is_the_steady_state_of_the_mount(frequency: float) -> None:
    omega = 2.0 * np.pi * frequency
    w, z = 2.0 * np.pi * 30.0, 0.2

    def moved(t: float, y: np.ndarray) -> list[float]:
        base, base_rate = np.sin(omega * t + 0.4), omega * np.cos(omega * t + 0.4)
        return [y[1], -2.0 * z * w * (y[1] - base_rate) - w * w * (y[0] - base)]

    settled = 40.0 / (z * w)  # e⁻⁴⁰ of the start is left
    t = settled + np.linspace(0.0, 5.0 / frequency, 201)
    solution = solve_ivp(moved, (0.0, t[-1]), [0.0, 0.0], method="DOP853", t_eval=t, rtol=1e-11, atol=1e-12)
    isolator = Isolator(linear_hz=30.0, linear_damping=0.2, angular_hz=1.0)
    (tone,) = isolator.transmitted([Tone("down", 1.0, frequency, 0.4)])
    np.testing.assert_allclose(solution.y[0], tone.amplitude * np.sin(omega * t + tone.phase), rtol=0.0, atol=1e-8)


def test_known_points_of_the_transfer() -> None:
    mount = Mount(40.0, 0.1)
    assert mount.transfer(0.0) == 1.0
    assert abs(mount.transfer(40.0)) == pytest.approx(np.sqrt(1.0 + 1.0 / (4.0 * 0.1**2)), rel=1e-14)
    assert abs(mount.transfer(40.0 * np.sqrt(2.0))) == pytest.approx(1.0, rel=1e-14)  # whatever the damping
    assert abs(mount.transfer(4e5)) == pytest.approx(2.0 * 0.1 / 1e4, rel=1e-4)


def test_turns_and_displacements_have_mounts_of_their_own() -> None:
    tones = (Tone("yaw", 1e-3, 20.0), Tone("right", 1e-3, 20.0))
    turn, shift = Isolator(linear_hz=10.0, linear_damping=0.3, angular_hz=80.0, angular_damping=0.1).transmitted(tones)
    assert turn.amplitude == pytest.approx(1e-3 * abs(Mount(80.0, 0.1).transfer(20.0)), rel=1e-14)
    assert shift.amplitude == pytest.approx(1e-3 * abs(Mount(10.0, 0.3).transfer(20.0)), rel=1e-14)


def test_from_a_scenario() -> None:
    """A block on a mount of 25 Hz, shaken at 50 Hz: the specific force shrinks by |H|, and slow turns do not."""
    shaken = {**PARKED, "vibration": [{"coordinate": "down", "rms_g": 0.1, "low_hz": 50.0}]}
    free = fly(Scenario.model_validate(shaken))
    on_mounts = fly(Scenario.model_validate({**shaken, "isolator": {"linear_hz": 25.0, "angular_hz": 30.0}}))
    t = np.linspace(1.0, 3.0, 1000, endpoint=False)
    spread = [np.std(truth.rates(t)[1][:, 2]) for truth in (free, on_mounts)]
    assert spread[0] == pytest.approx(0.1 * 9.80665, rel=1e-9)
    ratio = np.sqrt((1.0 + 0.8**2) / (9.0 + 0.8**2))  # at twice the natural frequency, damping 0.2
    assert spread[1] / spread[0] == pytest.approx(ratio, rel=1e-9)
    assert free.rates(0.0)[1][2] - free.rates(0.01)[1][2] == pytest.approx(0.0, abs=1e-9)  # phase 0 of the acceleration


def test_noise_of_acceleration_has_a_flat_spectrum_of_it() -> None:
    section = {"coordinate": "forward", "rms_g": 0.5, "low_hz": 20.0, "high_hz": 80.0}
    truth = fly(Scenario.model_validate({**PARKED, "seed": 4, "vibration": [section]}))
    assert isinstance(truth, Vibrating)
    t = np.arange(0.0, 8.0, 0.002)
    force = truth.rates(t)[1][:, 0]
    assert np.std(force) == pytest.approx(0.5 * 9.80665, rel=0.03)
    power = np.abs(np.fft.rfft(force * np.hanning(len(force)))) ** 2
    f = np.fft.rfftfreq(len(force), 0.002)
    assert power[(f > 19.5) & (f < 50.0)].sum() / power.sum() == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (
            {"coordinate": "yaw", "rms_g": 0.1, "low_hz": 5.0},
            "yaw must be given by rms_arcsec; here it is given by rms_g",
        ),
        ({"coordinate": "down", "rms_g": 0.1, "rms_mm": 1.0, "low_hz": 5.0}, "rms_mm or rms_g; .* rms_mm and rms_g"),
        ({"coordinate": "down", "low_hz": 5.0}, "given by no key"),
    ],
)
def test_sizes_that_do_not_fit(data: dict[str, object], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        Vibration.model_validate(data)


@pytest.mark.parametrize("values", [(0.0, 0.1), (30.0, 0.0), (np.nan, 0.1), (30.0, np.inf)])
def test_mounts_that_cannot_be(values: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="both must be positive"):
        Mount(*values)
