"""The rotating IMU: rates against differences, increments against quadrature, sequences against what they cancel."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import TypeAdapter
from scipy.integrate import quad_vec

from sinssim import rotation
from sinssim.truth.motions.imu_rotation import Rotation, Turning, TurningBlock
from sinssim.truth.motions.mounted_block import Vibrating
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.truth.motions.vibration import Tone
from sinssim.units import DEG
from tests.slow import slow

KINDS: dict[str, dict[str, Any]] = {
    "continuous": {"type": "continuous", "rate_deg_s": -13.0, "inner_rate_deg_s": 7.0, "axis": (1.0, 0.2, 0.0)},
    "reversing": {"type": "reversing", "rate_deg_s": 10.0, "turn_deg": 90.0, "dwell_s": 2.0, "ramp_s": 0.7},
    "indexed": {"type": "indexed", "rate_deg_s": 30.0, "ramp_s": 1.5, "dwell_s": 3.0},
    "steps": {
        "type": "indexed",
        "steps": ({"turn_deg": 90.0}, {"axis": "inner", "turn_deg": -45.0}, {"turn_deg": -90.0}),
        "rate_deg_s": 30.0,
        "dwell_s": 1.0,
    },
}


def made(section: dict[str, Any], end: float) -> Turning:
    return TypeAdapter(Rotation).validate_python(section).turning(0.0, end)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("wobble", [0.0, 3000.0])
def test_rate_is_the_derivative_of_the_attitude(kind: str, wobble: float) -> None:
    turns = made({**KINDS[kind], "wobble_arcsec": wobble, "wobble_phase_deg": 40.0}, 200.0)
    t, h = np.linspace(0.1, 199.9, 501), 1e-4
    step = rotation.multiply(rotation.conjugate(turns.attitude(t - h)), turns.attitude(t + h))
    difference = rotation.rotation_vector_from_quaternion(step) / (2.0 * h)
    assert np.abs(difference - turns.rate(t)).max() < 1e-7


@pytest.mark.parametrize("kind", ["reversing", "indexed", "steps"])
def test_turns_have_their_angles_and_return(kind: str) -> None:
    section = TypeAdapter(Rotation).validate_python(KINDS[kind])
    turns = section.turning(0.0, 1000.0)
    per = [abs(turn) / section.rate_deg_s + section.ramp_s + section.dwell_s for _, turn in section.turns]
    expected = np.zeros((len(per) + 1, 2))
    for k, (axis, turn) in enumerate(section.turns):
        expected[k + 1] = expected[k]
        expected[k + 1, 0 if axis == "outer" else 1] += turn
    found = turns.angles(np.concatenate([[0.0], np.cumsum(per)])) / DEG
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("every", [13, *slow(1)])
@pytest.mark.parametrize("kind", ["continuous", "indexed", *slow("steps", "reversing")])
def test_increments_are_the_integrals_of_the_rates(kind: str, every: int) -> None:
    """Adaptive quadrature by scipy of the rates in each sample, some of which have a corner of the rate."""
    parked = Parked(0.8, 0.1, 50.0, rotation.quaternion_from_euler(0.1, -0.2, 2.0), 30.0)
    base = Vibrating(parked, (Tone("roll", 0.01, 1.3), Tone("down", 0.02, 2.0)))
    block = TurningBlock(base, made({**KINDS[kind], "wobble_arcsec": 500.0}, 30.0))
    imu = block.increments(2.0)
    for k in range(0, len(imu), every):

        def felt(t: float) -> NDArray[np.float64]:
            return np.concatenate(block.rates(np.asarray(t)))

        inside = [b for b in block.breaks if imu.time[k] < b < imu.time[k + 1]]
        edges = [imu.time[k], *inside, imu.time[k + 1]]
        total = sum(quad_vec(felt, a, b, epsabs=1e-13, epsrel=1e-13)[0] for a, b in pairwise(edges))
        assert np.abs(total - np.concatenate([imu.dtheta[k], imu.dvel[k]])).max() < 1e-11


def test_the_state_turns_and_stays_in_place() -> None:
    parked = Parked(0.8, 0.1, 50.0, rotation.quaternion_from_euler(0.1, -0.2, 2.0), 30.0)
    block = TurningBlock(parked, made(KINDS["continuous"], 30.0))
    here, there = parked.state(12.0), block.state(12.0)
    assert (here.latitude, here.height) == (there.latitude, there.height)
    turned = rotation.multiply(rotation.conjugate(here.q_nb), there.q_nb)
    assert turned == pytest.approx(block.turns.attitude(np.array([12.0]))[0], abs=1e-15)


def cycle_of(sequence: str, dwell: float = 20.0) -> tuple[Turning, float]:
    section = {"type": "indexed", "sequence": sequence, "rate_deg_s": 10.0, "ramp_s": 1.0, "dwell_s": dwell}
    whole = TypeAdapter(Rotation).validate_python(section)
    lasts = sum(abs(turn) / 10.0 + 1.0 + dwell for _, turn in whole.turns)
    return whole.turning(0.0, lasts), lasts


def left_of(sequence: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean of C over a cycle, (3, 3), and ∫C_im ω_j dt, by scale and misalignment, (3, 3, 3)."""
    turns, lasts = cycle_of(sequence)
    step = 2e-3
    t = np.arange(0.5 * step, lasts, step)
    c, omega = rotation.dcm_from_quaternion(turns.attitude(t)), turns.rate(t)
    return c.sum(axis=0) * step / lasts, np.einsum("tim,tj->imj", c, omega) * step


def test_eight_positions_cancel_scale_factors_misalignments_and_the_biases_at_rest() -> None:
    biases, products = left_of("8-position")
    # the half turns pass one side alone: what remains are the means over the turns, 8 of which last 18 + 1 s each
    assert 0.01 < np.abs(biases).max() < 0.35
    assert np.abs(products).max() < 1e-5  # rad per unit; a half turn has 3.14


def test_sixteen_positions_cancel_all_of_them() -> None:
    biases, products = left_of("16-position")
    assert np.abs(biases).max() < 1e-6
    assert np.abs(products).max() < 1e-5


def test_four_positions_cancel_all_but_the_bias_along_the_axis() -> None:
    biases, products = left_of("4-position")
    along = np.zeros((3, 3))
    along[2, 2] = 1.0
    assert np.abs(biases - along).max() < 1e-6
    assert np.abs(products).max() < 1e-5


def test_angles_and_rates_of_a_cycle_by_hand() -> None:
    """90° at 30°/s and −45° on the inner axis, ramps of 1 s, stops of 2 s: turns of 4 s and 2.5 s; then −90°.

    In the middle of a ramp the rate is half, and 13/32 of half the ramp's angle is behind: x³ − x⁴/2 at x = 1/2.
    """
    section = {**KINDS["steps"], "dwell_s": 2.0, "ramp_s": 1.0}
    turns = TypeAdapter(Rotation).validate_python(section).turning(100.0, 200.0)
    t = 100.0 + np.array([0.0, 0.5, 1.0, 2.0, 3.5, 4.0, 6.0, 6.5, 8.5, 11.0, 14.5, 16.5, 17.0])
    half = 30.0 * (0.125 - 0.03125)
    outer = [0.0, half, 15.0, 45.0, 90.0 - half, 90.0, 90.0, 90.0, 90.0, 90.0 - 15.0, half, 0.0, half]
    inner = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -half, -45.0, -45.0, -45.0, -45.0, -45.0]
    # turns of 4, 2.5 and 4 s with stops of 2 s: they begin at 0, 6, 10.5 and, in the next cycle, at 16.5 s
    outer[9] = 90.0 - 30.0 * (0.125 - 0.03125)
    outer[10] = 0.0
    np.testing.assert_allclose(turns.angles(t) / DEG, np.column_stack([outer, inner]), atol=1e-9)
    rates = turns.rate(100.0 + np.array([0.5, 2.0, 5.0, 6.5, 11.0])) / DEG
    across = np.linalg.norm(rates, axis=1)
    np.testing.assert_allclose(across, [15.0, 30.0, 0.0, 15.0, 15.0], atol=1e-9)
    begins = [0.0, 1.0, 3.0, 4.0, 6.0, 7.0, 7.5, 8.5, 10.5, 11.5, 13.5, 14.5, 16.5]
    np.testing.assert_allclose(turns.breaks[:12], 100.0 + np.array(begins[1:]), atol=1e-9)
    assert turns.breaks[-1] < 200.0
    assert turns.two_axes
    assert turns.fastest == pytest.approx(30.0 * DEG)


def test_contents_of_a_rotation() -> None:
    """Both rates of a continuous one; a wobble of n cycles multiplies the outer angle."""
    section = {"type": "continuous", "rate_deg_s": -13.0, "inner_rate_deg_s": 7.0, "axis": (0.0, 3.0, 4.0)}
    turns = made(section, 30.0)
    np.testing.assert_allclose(turns.outer, [0.0, 0.6, 0.8])
    assert turns.fastest == pytest.approx(20.0 * DEG)
    assert len(turns.breaks) == 0
    np.testing.assert_allclose(turns.angles(np.array([0.0, 10.0])) / DEG, [[0.0, 0.0], [-130.0, 70.0]])
    wobbling = made({**section, "wobble_arcsec": 36.0, "wobble_cycles": 3, "wobble_phase_deg": 20.0}, 30.0)
    assert wobbling.fastest == pytest.approx(80.0 * DEG)
    assert (wobbling.wobble, wobbling.cycles, wobbling.phase) == (
        pytest.approx(0.01 * DEG),
        3,
        pytest.approx(20.0 * DEG),
    )
    assert not made({"type": "continuous", "rate_deg_s": 5.0}, 30.0).two_axes
    # the wobble tilts by ε, across the axis, and goes round n times a turn
    still, tilted = turns.attitude(np.array([5.0])), wobbling.attitude(np.array([5.0]))
    nu = rotation.rotation_vector_from_quaternion(rotation.multiply(tilted, rotation.conjugate(still)))[0]
    assert np.linalg.norm(nu) == pytest.approx(0.01 * DEG, rel=1e-6)
    assert nu @ turns.outer == pytest.approx(0.0, abs=1e-12)


def test_what_a_rotating_unit_tells_of_itself() -> None:
    parked = Parked(0.8, 0.1, 50.0, np.array([1.0, 0.0, 0.0, 0.0]), 30.0)
    base = Vibrating(parked, (Tone("roll", 0.01, 1.5), Tone("down", 0.02, 2.0)))
    assert base.fastest == pytest.approx(2.0 * 4.0 * np.pi)  # products have twice the frequency
    block = TurningBlock(base, made(KINDS["reversing"], 30.0))
    assert block.fastest == pytest.approx(8.0 * np.pi + 10.0 * DEG)
    np.testing.assert_allclose(block.breaks, block.turns.breaks)
    assert (block.start, block.end, block.gravity) == (0.0, 30.0, "normal")
