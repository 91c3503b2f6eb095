"""Quiet spans, and what is said of them: exact numbers from readings whose means and scatter are written down."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.inspection.quiet_spans import (
    AtRest,
    Moves,
    at_rest,
    cell,
    fast_noise,
    rates_of,
    rest_findings,
    scale_finding,
    vibration_finding,
)
from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact, wrong
from sinssim.data import Array
from sinssim.logs.recorded_streams import InertialStream
from sinssim.units import DEG, DEG_H, G0

_FORCE = np.array([2.0, -6.0, 9.0]) * 9.8 / 11.0  # of the size 9.8 m/s²


_NOISE = np.random.default_rng(8).normal(size=(1000, 6))


def _log() -> tuple[Array, Array, Array]:
    """Return 20 s at 50 Hz from 7 s on: at rest but for 5 to 9 s, in which it shakes."""
    time = 7.0 + 0.02 * np.arange(1000)
    shake = np.where((time >= 12.0 - 1e-9) & (time < 16.0 - 1e-9), 40.0, 1.0)[:, None]
    rate = np.array((0.001, -0.002, 0.004)) + shake * _NOISE[:, :3] * (1e-4, 2e-4, 4e-4)
    return time, rate, _FORCE + shake * _NOISE[:, 3:] * (0.01, 0.02, 0.03)


def _density(*spans: Array) -> Array:
    """Return the scatter about a straight line through each span, times the root of the interval."""
    left = [part - np.polynomial.polynomial.polyval(x := np.arange(len(part)), np.polyfit(x, part, 1)[::-1]).T
            for part in spans]  # fmt: skip
    return np.asarray(np.sqrt(0.02 * np.mean(np.square(np.concatenate(left)), axis=0)))


def test_quiet_spans_and_the_readings_in_them() -> None:
    """Means and scatter are those of both spans together; the last sample ends the last window."""
    time, rate, force = _log()
    found = at_rest(time, rate, force)
    assert found is not None
    assert found.spans == [(7.0, pytest.approx(12.0)), (pytest.approx(16.0), pytest.approx(26.98))]
    rows = np.r_[0:250, 450:999]
    assert np.flatnonzero(found.rows).tolist() == rows.tolist()
    assert found.rate == pytest.approx(rate[rows].mean(axis=0), rel=1e-12)
    assert found.specific_force == pytest.approx(force[rows].mean(axis=0), rel=1e-12)
    assert found.gyro_density == pytest.approx(_density(rate[:250], rate[450:999]), rel=1e-9)
    assert found.accel_density == pytest.approx(_density(force[:250], force[450:999]), rel=1e-9)
    assert found.hidden.tolist() == [[0.0] * 3] * 2  # no two samples are equal
    assert found.in_motion == 0.0


def test_fixes_that_move_make_no_rest() -> None:
    """From 20.5 s on, the fixes move by 0.3 m/s; windows count by their middles, and unknown ones as at rest."""
    moves = Moves(np.array([8.0, 20.0, 21.0, 24.0]), np.array([0.0, 0.0, 0.3, 0.3]), 0.15)
    assert moves.at(np.array([7.0, 19.9, 20.2, 22.0, 23.7]), np.array([8.2, 21.0, 21.2, 23.0, 24.7])).tolist() == [
        False, False, True, True, False,
    ]  # fmt: skip
    found = at_rest(*_log(), moves)
    assert found is not None
    assert found.spans == [(7.0, pytest.approx(12.0)), (pytest.approx(16.0), pytest.approx(21.0))]
    assert found.in_motion == pytest.approx(
        3.0
    )  # windows from 21 to 24 s; that from 20 to 21 s has its middle at the limit


def test_no_span_of_three_seconds_is_quiet() -> None:
    time, rate, force = (part[150:350] for part in _log())  # from 10 to 14 s, of which two are quiet
    assert at_rest(time, rate, force) is None


def test_the_most_frequent_value_hides_a_noise() -> None:
    """A step of 0.4 hides 0.4/√12. A dead band of ±1.5 beside steps of 0.4 hides 3/√12."""
    assert cell(np.array([0.4, 0.8, 0.8, 0.8, 1.2, 2.0])) == pytest.approx(0.4 / np.sqrt(12.0))
    assert cell(np.array([-1.9, -1.5, 0.0, 0.0, 0.0, 1.5, 1.9])) == pytest.approx(3.0 / np.sqrt(12.0))
    assert cell(np.array([0.4, 0.8, 1.2])) == 0.0
    time, rate, force = _log()
    rate[:, 1] = np.where(np.arange(1000) % 5 == 0, 0.003, 0.001)  # four of five samples are equal
    rate[:, 1] += np.where((time >= 12.0 - 1e-9) & (time < 16.0 - 1e-9), 0.1 * (-1.0) ** np.arange(1000), 0.0)
    found = at_rest(time, rate, force)
    assert found is not None
    assert found.hidden == pytest.approx(np.array([[0.0, 0.002 / np.sqrt(12.0), 0.0], [0.0] * 3]))
    assert found.gyro_density[1] == pytest.approx(_density(rate[:250], rate[450:999])[1])  # 0.0008, more than is hidden


def test_rates_of_increments() -> None:
    time = np.array([3.0, 3.1, 3.3])
    gyro, accel = np.array([[1.0, 2.0, 3.0]] * 3), np.array([[4.0, 5.0, 6.0]] * 3)
    rates = InertialStream(time, gyro, accel)
    assert [part is whole for part, whole in zip(rates_of(rates), (time, gyro, accel), strict=True)] == [True] * 3
    increments = replace(rates, kind="increments")
    _, rate, force = rates_of(increments)
    assert rate[:, 0] == pytest.approx([10.0, 10.0, 5.0])  # the first interval is taken for the second
    assert force[:, 2] == pytest.approx([60.0, 60.0, 30.0])
    _, rate, force = rates_of(replace(increments, interval=np.array([[0.5, 0.2], [0.25, 0.1], [0.0, 0.4]])))
    assert rate[:, 1] == pytest.approx([4.0, 8.0, np.nan], nan_ok=True)
    assert force[:, 0] == pytest.approx([20.0, 40.0, 10.0])


def test_fast_noise_of_white_noise() -> None:
    """A single spike of 6 has the third differences 6, −18, 18, −6, whose squares sum up to 20 · 36."""
    time, values = 0.05 * np.arange(103), np.zeros((103, 3))
    values[50] = 6.0, 0.6, 3.0
    every = np.ones(103, dtype=bool)
    expected = np.sqrt(0.05 / 20.0 * 20.0 * np.array((36.0, 0.36, 9.0)) / 100.0)
    assert fast_noise(time, values, every) == pytest.approx(expected)
    some = every.copy()
    some[:51] = False  # the difference that ends at row 50 does not count
    part = np.sqrt(0.05 / 20.0 * 19.0 * np.array((36.0, 0.36, 9.0)) / 52.0)
    assert fast_noise(time, values, some) == pytest.approx(part)


def _quiet(**other: Any) -> AtRest:
    return replace(
        AtRest(
            [(7.5, 12.25), (16.0, 26.0)], np.zeros(1000, dtype=bool), _FORCE, np.radians((0.02, -0.03, 0.06)),
            np.radians((0.001, 0.002, 0.002)), 1e-6 * G0 * np.array((50.0, 60.0, 70.0)), np.zeros((2, 3)),
        ),
        **other,
    )  # fmt: skip


_WHITE = fact(
    "noise",
    "White noise there: gyros 0.001, 0.002, 0.002 °/s/√Hz, accelerometers 50, 60, 70 µg/√Hz.",
    gyro_deg_s_sqrt_hz=[pytest.approx(0.001), pytest.approx(0.002), pytest.approx(0.002)],
    accel_ug_sqrt_hz=[pytest.approx(50.0), pytest.approx(60.0), pytest.approx(70.0)],
)


def test_what_is_said_of_quiet_spans() -> None:
    """|(2, −3, 6)| = 7: 0.07 °/s are 252 °/h. |(1, 2, 2)| = 3: 0.003 °/s/√Hz are 2.81 °/h over 14.75 s."""
    assert rest_findings(_quiet(in_motion=8.0), Moves(np.zeros(2), np.zeros(2), 0.25)) == [
        fact(
            "standing",
            "Quiet spans, 14.75 s in all: 7.5–12.25 s, 16–26 s. Another 8 s are as quiet, but the fixes move there by "
            "0.25 m/s or more.",
            spans_s=[(7.5, 12.25), (16.0, 26.0)],
        ),
        _WHITE,
        fact(
            "gyros",
            "The gyros read 252 °/h in the quiet spans (noise of this mean 2.8 °/h; the Earth's rate is 15.04 °/h): "
            "biases of x, y, z of 0.02, -0.03, 0.06 °/s.",
            rate_deg_h=pytest.approx(252.0),
            noise_deg_h=pytest.approx(10.8 / np.sqrt(14.75)),
        ),
    ]
    many = [(10.0 * k, 10.0 * k + 4.0) for k in range(10)]
    shown = ", ".join(f"{10 * k}–{10 * k + 4} s" for k in range(8))
    assert rest_findings(_quiet(spans=many))[0].text == f"Quiet spans, 40 s in all: {shown} and 2 more."


@pytest.mark.parametrize(
    ("rate_deg_h", "density", "senses"),
    [(15.1, 0.001, True), (13.6, 0.001, True), (13.4, 0.001, False), (16.7, 0.001, False), (15.1, 0.002, False)],
)
def test_gyros_that_sense_the_earth(rate_deg_h: float, density: float, senses: bool) -> None:
    """The size of the rate is that of the Earth within a tenth, and so is the noise of its mean: 1.5 °/h at most."""
    still = _quiet(
        rate=rate_deg_h * DEG_H * np.array((2.0, -3.0, 6.0)) / 7.0,
        gyro_density=DEG * density * np.array((1.0, 2.0, 2.0)) / 2.0,
    )
    noise = 3600.0 * 1.5 * density / np.sqrt(14.75)
    text = f"The gyros read {rate_deg_h:.4g} °/h in the quiet spans (noise of this mean {noise:.2g} °/h"
    found = rest_findings(still)[-1]
    if senses:
        assert found.text == f"{text}); the Earth turns by 15.04 °/h: they sense it."
    else:
        assert found.text.startswith(f"{text}; the Earth's rate is 15.04 °/h): biases")


def test_a_rate_beyond_any_bias() -> None:
    still = _quiet(rate=np.radians((1.5, -20.5, 4.0)))
    size = 3600.0 * np.sqrt(1.5**2 + 20.5**2 + 16.0)
    (*_, found) = rest_findings(still)
    assert (found.grade, found.fix) == (
        "doubt",
        "See the unit and the columns of the gyros, and whether the vehicle turns there.",
    )
    assert found.text == (
        f"The gyros read {size:.4g} °/h in the quiet spans (noise of this mean 2.8 °/h): 1.5, -20.5, 4 °/s about x, y, "
        "z. Is that a bias? Data sheets have 20 °/s at most."
    )
    assert rest_findings(_quiet(rate=np.radians((1.5, -19.5, 4.0))))[-1].grade == "fact"


def test_what_a_resolution_hides() -> None:
    found = rest_findings(_quiet(hidden=np.array([[0.0, 0.2 * DEG, 0.35 * DEG], [0.004 * G0, 0.0, 0.0]])))
    text = "Most samples of the {} are equal at rest: a dead band or a coarse resolution, which may hide a noise of {}."
    fix = "The noise at rest is not known: see the data sheet."
    assert found[2:4] == [
        doubt("gyros", text.format("gyros", "y 0.2 °/s, z 0.35 °/s"), fix),
        doubt("accelerometers", text.format("accelerometers", "x 0.004 g"), fix),
    ]


def test_no_rest() -> None:
    fix = "Alignment at rest is impossible; biases and noise at rest are unknown."
    assert rest_findings(None) == [doubt("standing", "No span of 3 s or longer is quiet.", fix)]
    slow = rest_findings(None, Moves(np.zeros(2), np.zeros(2), 0.14))
    assert slow[0].text == "No span of 3 s or longer is quiet while the fixes move by less than 0.14 m/s."


def _scale(size: float, quiet: bool = True, kind: Any = "rates", gravity: float = 9.81) -> Finding:
    time = 4.0 + 0.02 * np.arange(50)
    unit = np.array([2.0, -6.0, 9.0]) / 11.0
    increments = 0.02 if kind == "increments" else 1.0
    stream = InertialStream(time, np.zeros((50, 3)), np.tile(size * increments * unit, (50, 1)), kind)
    return scale_finding(stream, _quiet(specific_force=size * unit) if quiet else None, gravity)


def _numbers(size: float) -> dict[str, Any]:
    return {"specific_force_mps2": pytest.approx(size), "of_gravity": pytest.approx(size / 9.81)}


def test_the_scale_by_gravity() -> None:
    text = "The specific force in the quiet spans is {} m/s², {} times gravity (9.81 m/s²)."
    assert _scale(9.9081) == fact("accelerometers", text.format("9.9081", "1.01"), **_numbers(9.9081))
    assert _scale(1.021 * 9.81).grade == "doubt"
    assert _scale(0.979 * 9.81).grade == "doubt"
    biased = "The accelerometers have a large bias or scale error, or the span was not at rest: calibrate them."
    found = doubt("accelerometers", text.format("11.772", "1.2"), biased, **_numbers(11.772))
    assert _scale(11.772) == found
    none = "No common unit explains this: the columns, their unit, or the time differ from the description."
    assert _scale(0.65 * 9.81) == wrong("accelerometers", text.format("6.3765", "0.65"), none, **_numbers(6.3765))
    assert [_scale(k * 9.81).grade for k in (0.69, 0.71, 1.49, 1.51)] == ["wrong", "doubt", "doubt", "wrong"]


def test_the_scale_in_motion() -> None:
    where = "over the whole log (median; no span is quiet, and manoeuvres increase it)"
    text = f"The specific force {where} is 13.342 m/s², 1.36 times gravity (9.81 m/s²)."
    assert _scale(1.36 * 9.81, False) == fact("accelerometers", text, **_numbers(1.36 * 9.81))
    ratios = (0.3, 0.35, 0.79, 0.81, 1.39, 1.41, 2.9, 3.05)
    expected = ["wrong", "doubt", "doubt", "fact", "fact", "doubt", "doubt", "wrong"]
    assert [_scale(k * 9.81, False).grade for k in ratios] == expected
    rocket = "Is it the motion, of a rocket, a runner or a centrifuge? Otherwise the unit is another one."
    assert _scale(1.6 * 9.81, False).fix == rocket


@pytest.mark.parametrize(
    ("factor", "kind", "meaning"),
    [
        (1.0 / 9.80665, "rates", "the numbers are in g"),
        (9.80665, "rates", "the numbers are in m/s² and were taken for g"),
        (1000.0 / 9.80665, "rates", "the numbers are in mg"),
        (100.0, "rates", "the numbers are in cm/s²"),
        (1.0 / 0.3048, "rates", "the numbers are in ft/s²"),
        (0.02, "rates", "the numbers are increments (velocity over each interval), not rates"),
        (50.0, "increments", "the numbers are rates (specific force), not increments"),
    ],
)
def test_the_unit_that_explains_gravity(factor: float, kind: str, meaning: str) -> None:
    """Within twice the tolerance of 2 % a unit explains the number; 100 cm/s² lie below 102 mg."""
    beside, beyond = (0.965, 0.955) if "cm" in meaning else (1.035, 1.045)
    found = _scale(beside * factor * 9.81, kind=kind)
    assert (found.grade, found.fix) == ("wrong", f"This fits if {meaning}: correct the unit or the kind.")
    assert found.numbers == {**_numbers(beside * factor * 9.81), "of_right_unit": pytest.approx(factor)}
    assert "of_right_unit" not in _scale(beyond * factor * 9.81, kind=kind).numbers


def test_vibration_in_motion() -> None:
    """What alternates by ±a has third differences of 8a: the density is a √(64 Δt/20)."""
    time = 7.0 + 0.02 * np.arange(1000)
    rows = time < 15.0 - 1e-9
    shake = (-1.0) ** np.arange(1000)[:, None]
    rate = np.radians(0.05) * shake * np.array((1.0, 0.5, 0.25))
    force = 1e-4 * G0 * shake * np.array((3.0, 2.0, 1.0))
    still = _quiet(
        rows=rows, gyro_density=np.radians((0.01, 0.02, 0.04)), accel_density=1e-6 * G0 * np.array((100.0, 10.0, 30.0))
    )
    root = np.sqrt(64.0 * 0.02 / 20.0)
    gyro, accel = 0.05 * root * np.array((1.0, 0.5, 0.25)), 100.0 * root * np.array((3.0, 2.0, 1.0))
    (found,) = vibration_finding(time, rate, force, still)
    assert found.text == (
        "In motion, the fast part of the data (third differences, treated as white noise) has: gyros 0.0126, 0.00632, "
        "0.00316 °/s/√Hz, accelerometers 75.89, 50.6, 25.3 µg/√Hz, up to 5.06 times that at rest."
    )
    assert found.fix == (
        "A filter that uses the noise at rest becomes overconfident: increase the noise, or set vibration_noise."
    )
    assert found.grade == "doubt"
    assert found.numbers == {
        "gyro_deg_s_sqrt_hz": pytest.approx(gyro),
        "accel_ug_sqrt_hz": pytest.approx(accel),
        "times_at_rest": pytest.approx(accel[1] / 10.0),
    }
    (calm,) = vibration_finding(time, rate, force, replace(still, accel_density=1e-6 * G0 * np.full(3, 40.0)))
    assert (calm.grade, calm.fix, calm.numbers["times_at_rest"]) == ("fact", "", pytest.approx(accel[0] / 40.0))
    assert vibration_finding(time, rate, force, None) == []
    assert vibration_finding(time, rate, force, _quiet(rows=np.ones(1000, dtype=bool))) == []
