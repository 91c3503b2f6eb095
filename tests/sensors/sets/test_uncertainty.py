"""What σ of the parity test includes: each error alone against the emulator, each noise against its variance."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.error_term_table import TERMS, of_triad
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.redundant_set_errors import Inputs, accumulated_inputs, noise_variance
from sinssim.sensors.sensor_set_section import READY
from sinssim.sensors.single_sensors import axes_about

RATE = 50.0
DRAWN = [term for term in TERMS if term.drawn]
AXES = READY["dodecahedron"]


def motion() -> ImuData:
    t = (np.arange(500) + 0.5) / RATE
    rate = np.column_stack((2.0 * np.sin(t), 1.0 * np.cos(0.7 * t), 0.5 * np.sin(0.3 * t)))
    force = np.column_stack((20.0 * np.cos(t), 5.0 * np.sin(2.0 * t), -9.8 + 10.0 * np.sin(0.5 * t)))
    return ImuData(np.arange(501) / RATE, rate / RATE, force / RATE)


@pytest.mark.parametrize("term", DRAWN, ids=lambda term: term.name)
def test_the_input_of_every_error_is_that_of_the_emulator(term: Any) -> None:
    """One value of one error at its 1σ, in one sensor, against the 1σ of its accumulated effect.

    A misalignment has two values per sensor and a cross-coupling too, a g-sensitivity three: their squares add up.
    """
    given = Imu.model_validate(
        {
            "grade": "ideal", "rate_hz": RATE, term.sigma_key: 0.5, "temperature_start_c": -20.0,
            "temperature_steady_c": 10.0, "warm_up_time_s": 5.0,
        }
    )  # fmt: skip
    ideal = motion()
    of_kind = ideal.dtheta if term.triad == "gyro" else ideal.dvel
    base, coefficients = accumulated_inputs(
        given, term.triad, AXES, Inputs(ideal.time - ideal.time[0], of_kind, ideal.dvel)
    )
    begin, end = 120, 431
    spread = np.sqrt(np.sum(np.einsum("kib,b->ki", coefficients, base[end] - base[begin]) ** 2, axis=0))
    sigma = float(np.max(given.stated(term)[1]))
    assert sigma > 0.0
    for i, direction in enumerate(AXES):
        axis = i % 3
        turn = axes_about(direction, axis).T
        own = ImuData(ideal.time, ideal.dtheta @ turn, ideal.dvel @ turn)
        places = {3: [(axis,)], 6: [(axis, j) for j in range(3) if j != axis], 9: [(axis, j) for j in range(3)]}
        squares = 0.0
        for place in places[term.size]:
            value = np.zeros(term.shape)
            value[place] = sigma
            errors = replace(ImuErrors(**{term.triad: TriadErrors(**{term.field: value})}), warm_up=given.warm_up)
            read = emulate(own, errors)
            off = (read.dtheta - own.dtheta) if term.triad == "gyro" else (read.dvel - own.dvel)
            squares += float(off[begin:end, axis].sum()) ** 2
        assert np.sqrt(squares) == pytest.approx(spread[i], rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "tolerance"),
    [
        ({"gyro_arw_deg_sqrt_h": 0.1}, 0.14),
        ({"gyro_instability_deg_h": 5.0, "gyro_correlation_time_s": 3.0}, 0.14),
        ({"gyro_flicker_deg_h": 5.0}, 0.14),
        ({"gyro_rrw_deg_h_sqrt_h": 50.0}, 0.14),
        ({"gyro_quantum_arcsec": 20.0, "gyro_arw_deg_sqrt_h": 0.15}, 0.14),
    ],
)
def test_the_variance_of_each_noise_is_that_of_the_emulator(keys: dict[str, float], tolerance: float) -> None:
    """Sums over windows of 600 channels: the 1σ of a variance is √(2/600) = 5.8 %, so 14 % is 2.4σ; fixed seeds."""
    given = Imu.model_validate({"grade": "ideal", "rate_hz": RATE, **keys})
    count, begin, samples = 500, 300, 150
    ideal = ImuData(np.arange(count + 1) / RATE, np.full((count, 3), 0.3 / RATE), np.zeros((count, 3)))
    sums = [
        (emulate(ideal, given, seed).dtheta - ideal.dtheta)[begin : begin + samples].sum(axis=0) for seed in range(200)
    ]
    constant, growth = noise_variance(given, "gyro", np.array([samples]), 1.0)[0]
    assert np.var(np.concatenate(sums)) == pytest.approx(constant + growth * begin / RATE, rel=tolerance)


def test_noises_of_both_kinds_are_known() -> None:
    """A term without draws is either a noise of `noise_variance` or the limit, which no sum exceeds."""
    for triad in ("gyro", "accel"):
        assert {term.field for term in of_triad(triad) if not term.drawn} == {
            "random_walk", "quantum", "instability", "correlation_time", "flicker", "rate_walk", "limit",
        }  # fmt: skip
