"""The backward solution: reverse time against the true motion, and both ways together against the smoother."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.alignment.alignment_budget import expected_errors
from sinssim.data import Array, Measurements, NavState, rows_of
from sinssim.earth.ellipsoids import WGS84, ellipsoid_by_name, in_reverse_time
from sinssim.estimation import Block, ErrorModel, Estimate, error_model
from sinssim.estimation.estimate import estimate
from sinssim.estimation.linearisation import Prediction, observe
from sinssim.scenario import Scenario
from sinssim.sensors.aiding_registry import KINDS, measurement_kind
from sinssim.sensors.imu.imu_section import Imu
from sinssim.simulation.backward_filter import (
    reversed_imu,
    reversed_readings,
    run_backward,
    signs_in_reverse_time,
    start_model,
)
from sinssim.strapdown.mechanization import Mechanization
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.curve import Curve
from tests.estimation.worlds import biases_only, errors_of, one_run, positions, velocities, weaving
from tests.slow import slow

SIGMA_ALL = expected_errors(Imu(grade="mems-industrial")).sigma
SIGMA = biases_only("laser-standard")
MODEL = error_model(SIGMA, position=(5.0, 5.0, 5.0), velocity=0.1, attitude=(3e-4, 3e-4, 3e-3))
OPTIONS: dict[str, Any] = {"rate_hz": 5.0, "mechanization": Mechanization()}


@pytest.mark.parametrize("frame", ["level", "wander", "inertial"])
def test_ideal_sensors_retrace_the_flight_from_its_end(frame: str) -> None:
    flight, ideal = weaving(300.0, 20.0)
    truth = _turned(flight.state(ideal.time[::-1]))
    turned = reversed_imu(ideal)
    options: dict[str, Any] = {"frame": frame, "vertical": "free"}
    found = navigate(turned, rows_of(truth, 0), ellipsoid=in_reverse_time("wgs84"), **options)
    error = navigation_error(truth, found)
    assert np.abs(error.position_ned).max() < 1e-6
    assert np.abs(error.velocity_ned).max() < 1e-8
    assert np.abs(error.attitude).max() < 1e-11
    # an Earth that goes on turning the same way is another motion
    wrong = navigation_error(truth, navigate(turned, rows_of(truth, 0), ellipsoid="wgs84", **options))
    assert np.abs(wrong.position_ned).max() > 1e3


def test_the_earth_in_reverse_time_has_the_same_gravity() -> None:
    turned = ellipsoid_by_name(in_reverse_time("wgs84"))
    assert turned.omega == -WGS84.omega
    assert (turned.gamma_e, turned.gamma_p, turned.j2, turned.m) == (WGS84.gamma_e, WGS84.gamma_p, WGS84.j2, WGS84.m)


def _turned(state: NavState) -> NavState:
    return replace(state, velocity_ned=-state.velocity_ned)


def _both_ways(seed: int) -> tuple[Curve, Any, Estimate, Estimate]:
    flight, ideal = weaving(300.0, 20.0)
    run = one_run(flight, ideal, MODEL, SIGMA, seed)
    time, rng = np.arange(1.0, 300.5), np.random.default_rng(seed)
    time = time[(time < 100.0) | (time > 200.0)]
    given = [positions(flight, time, rng), velocities(flight, time, rng)]
    forward = estimate(run.imu, run.initial, given, MODEL, smooth=True, **OPTIONS)
    return flight, run, forward, run_backward(forward, run.imu, given, 0.0, OPTIONS)


def test_forward_and_backward_together_are_the_smoother() -> None:
    flight, run, forward, backward = _both_ways(1)
    smoothed = forward.smoothed
    assert smoothed is not None
    assert backward.divergence is None
    np.testing.assert_allclose(backward.time[[0, -1]], forward.time[[0, -1]], atol=1e-9)
    prior = start_model(forward)
    states = {name: errors_of(MODEL, one, flight, run) for name, one in _named(forward, backward, smoothed)}
    worst_mean, worst_sigma, compared = 0.0, 0.0, 0
    for instant in (  # without readings, which both would use
        101.0,
        125.0,
        150.0,
        175.0,
        199.0,
    ):
        f, b, s = (_row(one.time, instant) for one in (forward, backward, smoothed))
        assert min(f, b, s) >= 0
        i_f, i_b = (np.linalg.inv(_covariance(one, k, MODEL)) for one, k in ((forward, f), (backward, b)))
        # the parameters' standard deviations at the start are in both, with an expectation of zero
        known = np.zeros(MODEL.size)
        known[9:] = prior.sigma[9:] ** -2.0
        both = np.linalg.inv(i_f + i_b - np.diag(known))
        parameters = _vector(run.parameters)
        x = both @ (i_f @ states["forward"][f] + i_b @ states["backward"][b] - known * parameters)
        size = smoothed.sigma[s]
        worst_mean = max(worst_mean, float(np.abs((x - states["smoothed"][s]) / size).max()))
        worst_sigma = max(worst_sigma, float(np.abs(np.sqrt(both.diagonal()) / size - 1.0).max()))
        compared += 1
        # each by itself knows less than both together
        assert np.all(smoothed.sigma[s, :9] < backward.sigma[b, :9])
    assert compared == 5
    # of the forward run's information at the end 1/100 is used twice
    assert worst_mean < 0.02
    assert worst_sigma < 0.02


def _named(forward: Estimate, backward: Estimate, smoothed: Any) -> list[tuple[str, Any]]:
    return [("forward", forward), ("backward", backward), ("smoothed", smoothed)]


def _row(time: Array, instant: float) -> int:
    found = np.flatnonzero(np.abs(time - instant) < 1e-6)
    return int(found[0]) if len(found) else -1


def _covariance(one: Estimate, row: int, model: ErrorModel) -> Array:
    at = np.flatnonzero(one.rows == row)
    assert len(at), row
    return one.covariance[int(at[0])]


def _vector(parameters: dict[str, Array]) -> Array:
    out = np.zeros(MODEL.size)
    for name, value in parameters.items():
        out[MODEL.slices[name]] = value
    return out


@pytest.mark.parametrize("runs", [2, *slow(4)])
def test_the_backward_errors_agree_with_their_covariance(runs: int) -> None:
    # the mean over the runs of the normalised squared error at three instants: N x 15 squares of unit variance, which
    # are beyond 5 standard deviations with a probability of 1e-5
    squares = []
    for seed in range(runs):
        flight, run, _, backward = _both_ways(seed)
        errors = errors_of(MODEL, backward, flight, run)
        for instant in (5.0, 150.0, 250.0):
            k = _row(backward.time, instant)
            squares.append(float(errors[k] @ np.linalg.solve(_covariance(backward, k, MODEL), errors[k])))
    mean = np.reshape(squares, (runs, 3)).mean(axis=0) / MODEL.size
    assert np.all(np.abs(mean - 1.0) < 5.0 * np.sqrt(2.0 / (runs * MODEL.size))), mean


_OWN = {
    "bias": 0.01, "scale": 0.02, "deviation": 0.03, "wind": 3.0, "mounting": 0.05, "lever arm": 0.7, "slip": 0.004,
}  # fmt: skip


@pytest.mark.parametrize("name", list(KINDS))
def test_every_kind_of_reading_is_the_same_in_reverse_time(name: str) -> None:
    """The residual of turned readings about a turned motion is the turned residual, and so is H of every state."""
    rng = np.random.default_rng(5)
    kind = measurement_kind(name)
    own = {error: len(axes) for error, (axes, _) in kind.own_errors.items()} | {"bias": kind.errors}
    own |= {"scale": 1} if kind.components == 1 else {}
    extra = [Block(f"{name} {error}", np.full(size, 0.1)) for error, size in own.items()]
    extra += [Block("gnss lever arm", 0.1)] if kind.at_antenna else []
    imu = ("gyro bias", "accelerometer bias", "gyro scale", "gyro misalignment")
    model = error_model(SIGMA_ALL, imu=imu, extra=extra)
    q = rng.standard_normal((4, 4))
    state = NavState(
        np.full(4, 0.8), np.full(4, 0.3), np.full(4, 500.0), 20.0 * rng.standard_normal((4, 3)),
        q / np.linalg.norm(q, axis=1)[:, None],
    )  # fmt: skip
    rate, arm = 0.2 * rng.standard_normal((4, 3)), np.array([1.0, 0.5, -0.3])
    value = rng.standard_normal((4, kind.components))
    if name == "gnss-position":
        value = np.column_stack([np.full((4, 2), (0.80001, 0.30001)), np.full(4, 510.0)])
    parameters = {
        b.name: rng.uniform(0.1, 1.0, b.size) * _OWN.get(b.name.removeprefix(name + " "), 0.01) for b in extra
    }
    signs = signs_in_reverse_time(model, {name: name})
    here = Measurements(name, np.arange(4.0), np.arange(4.0), value, np.ones((4, kind.errors)), arm)
    residual, h = observe(here, Prediction(state, rate, WGS84), model, parameters)

    turned_value = value.copy()
    turned_value[:, : kind.velocities] *= -1.0
    earth = ellipsoid_by_name(in_reverse_time("wgs84"))
    there = {block: signs[model.slices[block]] * p for block, p in parameters.items()}
    turned, turned_h = observe(
        replace(here, value=turned_value), Prediction(_turned(state), -rate, earth), model, there
    )
    of_residual = np.ones(kind.errors)
    of_residual[: kind.velocities] = -1.0
    np.testing.assert_allclose(turned, of_residual * residual, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(turned_h, of_residual[:, None] * h * signs, rtol=1e-9, atol=1e-9)


def test_means_of_rates_keep_their_intervals() -> None:
    edges = np.arange(0.0, 20.1, 0.1)
    time = np.array([0.5, 1.0, 1.5, 2.0, 9.0, 9.5, 10.0])
    here = Measurements("zero-rate", time, time, np.tile(time[:, None], 3), np.ones((7, 3)))
    turned = reversed_readings(here, edges)
    # readings of means over 0 ... 0.5, 0.5 ... 1.0 and so on; after the pause over the usual half second
    np.testing.assert_allclose(turned.time, 20.0 - np.array([9.5, 9.0, 8.5, 1.5, 1.0, 0.5, 0.0]), atol=1e-12)
    np.testing.assert_allclose(turned.value[:, 0], -np.array([10.0, 9.5, 9.0, 2.0, 1.5, 1.0, 0.5]))
    np.testing.assert_array_equal(turned.arrival, turned.time)


def test_a_time_offset_and_biases_are_found_with_their_signs() -> None:
    flight, ideal = weaving(300.0, 20.0)
    sensors = (Block("gnss time offset", 0.1), Block("gnss-velocity bias", np.full(3, 1.0)))
    model = error_model(SIGMA, position=(5.0, 5.0, 5.0), velocity=0.1, attitude=(3e-4, 3e-4, 3e-3), extra=sensors)
    run = one_run(flight, ideal, model, SIGMA, 3)
    offset, bias = 0.08, np.array([0.6, -0.5, 0.4])
    rng, time = np.random.default_rng(4), np.arange(1.0, 299.5)
    late = [m(flight, time - offset, rng) for m in (positions, velocities)]  # stamped too late
    late = [replace(m, time=time, arrival=time) for m in late]
    late[1] = replace(late[1], value=late[1].value + bias)
    forward = estimate(run.imu, run.initial, late, model, **OPTIONS)
    backward = run_backward(forward, run.imu, late, 0.0, OPTIONS)
    for one, row in ((forward, -1), (backward, 0)):
        for block, true in (("gnss time offset", np.array([offset])), ("gnss-velocity bias", bias)):
            where = model.slices[block]
            assert np.all(np.abs(one.parameters[block][row] - true) < 5.0 * one.sigma[row, where])
            assert np.all(np.abs(true) > 10.0 * one.sigma[row, where])


GREAT_CIRCLE = {"latitude_deg": 50.0, "course_deg": 60.0, "speed_mps": 200.0, "duration_s": 60.0}


def _scenario(**tables: Any) -> Scenario:
    own = {
        "name": "backward",
        "great_circle": GREAT_CIRCLE,
        "imu": {"grade": "laser-standard", "rate_hz": 20.0},
        "aiding": {"gnss": {"velocity": True}},
        "filter": {"backward": True},
    }
    return Scenario.model_validate({**own, **tables})


def test_a_simulated_run_has_a_backward_solution_with_true_errors() -> None:
    result = sinssim.run(_scenario())
    assert result.aided is not None
    backward, error = result.aided.estimate.backward, result.aided.backward_error
    assert backward is not None
    assert error is not None
    assert result.aided.backward_state_errors is not None
    np.testing.assert_allclose(error.time[[0, -1]], [0.0, 60.0], atol=1e-9)
    # it knows the start from what came later; six standard deviations of 1200 states are beyond by 2e-6
    ratio = result.aided.backward_state_errors[:, :9] / backward.sigma[:, :9]
    assert np.abs(ratio).max() < 6.0
    assert result.summary["filter"]["backward"]["rms_horizontal_error_m"] == pytest.approx(
        float(np.sqrt(np.mean(error.horizontal**2))), rel=1e-9
    )
    without = sinssim.run(_scenario(filter={}))
    assert "backward" not in without.summary["filter"]
    assert without.summary["filter"]["aided"] == result.summary["filter"]["aided"]


def test_a_filter_that_diverged_has_none_and_says_so() -> None:
    # a receiver that is off by kilometres from the first reading on: all readings are rejected
    jump = [{"from_s": 1.0, "north_m": 50000.0}]
    result = sinssim.run(_scenario(aiding={"gnss": {"velocity": False, "jumps": jump}}))
    assert result.aided is not None
    assert result.aided.estimate.divergence is not None
    assert result.aided.estimate.backward is None
    assert any("no backward solution" in remark for remark in result.summary["filter"]["remarks"])


def test_a_block_that_turns_is_refused_by_the_key() -> None:
    rotation = {"type": "continuous", "rate_deg_s": 10.0}
    with pytest.raises(ValueError, match=r"filter\.backward = true"):
        _scenario(imu={"grade": "laser-standard", "rotation": rotation})
