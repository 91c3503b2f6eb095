"""What a parked vehicle, a straight flight and a weaving one make observable."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import rotation
from sinssim.alignment.alignment_budget import expected_errors
from sinssim.estimation import Block, ErrorModel, error_model
from sinssim.estimation.consistency import observability
from sinssim.estimation.estimate import estimate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from tests.estimation.made import history
from tests.estimation.worlds import biases_only, errors_of, one_run, positions, standing, velocities, weaving
from tests.slow import slow


def test_a_parked_vehicle_hides_what_theory_says() -> None:
    """No reading tells the level accelerometers' biases from tilts and the east gyro's from heading.

    With C_nb = I an error φ of the attitude is hidden by the biases b_a = −f × φ and b_g = −ω_ie × φ (Bar-Itzhack and
    Berman, Control theoretic approach to inertial navigation systems, J. Guidance 11, 1988, 237). Zero velocity says
    nothing about the place either.
    """
    sigma = biases_only("laser-standard")
    model = error_model(sigma, position=1.0, velocity=0.1, attitude=(1e-3, 1e-3, 1e-2))
    place = Parked(0.8, 0.2, 100.0, rotation.quaternion_from_euler(0.0, 0.0, 0.0), 600.0)
    run = one_run(place, place.increments(5.0), model, sigma, 0)
    given = [standing(np.arange(1.0, 600.5), np.random.default_rng(0), 0.01)]
    result = estimate(run.imu, run.initial, given, model, rate_hz=1.0, history=True)
    assert result.history is not None
    found = observability(model, result.history)
    assert (found.singular[-1] > 10.0).sum() == 8
    assert found.singular[-1][8] < 1.0  # the down gyro, through the turn of the Earth, in hours
    limit = dict(zip(found.states, found.limit, strict=True))
    for name in ("velocity north", "velocity east", "velocity down", "accelerometer bias down"):
        assert limit[name] < 0.15, name
    for name in ("position north", "position east", "position down", "gyro bias down"):
        assert limit[name] > 0.95, name
    earth_rate = 7.292115e-5 * np.array([np.cos(0.8), 0.0, -np.sin(0.8)])
    force = np.array([0.0, 0.0, -9.81])
    for axis in range(3):
        phi = np.eye(3)[axis]
        x = np.concatenate([np.zeros(6), phi, -np.cross(earth_rate, phi), -np.cross(force, phi)]) / model.sigma
        x /= np.linalg.norm(x)
        assert np.linalg.norm(found.directions[:8] @ x) < 0.01, axis
        # half of it is something else: the attitude without its biases shows
        alone = np.concatenate([np.zeros(6), phi, np.zeros(6)]) / model.sigma
        alone /= np.linalg.norm(alone)
        assert np.linalg.norm(found.directions[:8] @ alone) > 0.9, axis
    # heading is as good as the east gyro's bias allows
    heading = list(found.states).index("attitude down")
    assert found.limit[heading] * 1e-2 == pytest.approx(sigma.gyro.bias[1] / earth_rate[0], rel=0.05)
    assert found.observable[heading]


def test_more_of_a_flight_shows_more_and_noise_drowns_some() -> None:
    sigma = biases_only("mems-tactical")
    model = error_model(sigma, position=5.0, velocity=0.1, attitude=(1e-3, 1e-3, 1e-2))
    flight, ideal = weaving(450.0, 20.0)
    time, rng = np.arange(1.0, 450.5), np.random.default_rng(0)
    run = one_run(flight, ideal, model, sigma, 0)
    result = estimate(
        run.imu, run.initial, [positions(flight, time, rng), velocities(flight, time, rng)], model, rate_hz=5.0,
        history=True,
    )  # fmt: skip
    assert result.history is not None
    found = observability(model, result.history)
    assert found.time[0] == 0.0
    assert found.time[-1] == 450.0
    assert np.all(np.diff(found.singular, axis=0) >= -1e-6 * found.singular[:-1])  # information only grows
    np.testing.assert_allclose(found.directions @ found.directions.T, np.eye(15), atol=1e-9)
    first = observability(model, result.history, end=100.0)
    assert first.time[-1] == 100.0
    np.testing.assert_allclose(first.singular[-1], found.singular[np.searchsorted(found.time, 100.0)], rtol=1e-9)
    assert found.seen.sum() > first.seen.sum()
    np.testing.assert_allclose(found.reduction, result.sigma[-1] / model.sigma, rtol=1e-9)
    assert np.all(found.reduction[found.observable] <= 0.5)
    assert np.all(found.observable <= found.seen)


def test_a_straight_flight_shows_no_scale_factors_and_turns_do() -> None:
    section = Imu(grade="tactical", gyro_scale_sigma_ppm=3000.0, accel_scale_sigma_ppm=3000.0)
    sigma = expected_errors(section).sigma
    model = error_model(
        sigma, position=5.0, velocity=0.1, attitude=(1e-3, 1e-3, 1e-2),
        imu=("gyro bias", "accelerometer bias", "gyro scale", "accelerometer scale"),
    )  # fmt: skip
    time = np.arange(1.0, 450.5)
    seen = {}
    for name in ("straight", "weaving"):
        flight, ideal = weaving(450.0, 20.0)
        if name == "straight":
            flight = GreatCircle(0.8, 0.2, 5000.0, 1.0, 200.0, 451.0)
            ideal = flight.increments(20.0)
        run, rng = one_run(flight, ideal, model, sigma, 0), np.random.default_rng(0)
        given = [positions(flight, time, rng), velocities(flight, time, rng)]
        result = estimate(run.imu, run.initial, given, model, rate_hz=5.0, history=True)
        assert result.history is not None
        found = observability(model, result.history)
        seen[name] = dict(zip(found.states, found.observable, strict=True))
        errors = errors_of(model, result, flight, run)[-1] / result.sigma[-1]
        assert np.abs(errors[found.observable]).max() < 3.0
    assert not any(seen["straight"][f"gyro scale {axis}"] for axis in ("forward", "right", "down"))
    assert seen["weaving"]["gyro scale forward"]
    assert sum(seen["weaving"].values()) > sum(seen["straight"].values())


@pytest.mark.parametrize(("runs", "seconds"), slow((3, 450.0), (30, 900.0)))
def test_biases_that_are_declared_observable_are_found(runs: int, seconds: float) -> None:
    """The errors that the emulator puts in come back within 3σ, σ at least halved, scale and misalignment with them."""
    section = Imu(
        grade="tactical", gyro_scale_sigma_ppm=1500.0, accel_scale_sigma_ppm=1500.0,
        gyro_misalignment_sigma_arcsec=500.0, accel_misalignment_sigma_arcsec=500.0,
    )  # fmt: skip
    sigma = expected_errors(section).sigma
    model = error_model(
        sigma, position=5.0, velocity=0.1, attitude=(1e-3, 1e-3, 1e-2),
        imu=("gyro bias", "accelerometer bias", "gyro scale", "accelerometer scale", "gyro misalignment",
             "accelerometer misalignment"),
    )  # fmt: skip
    assert model.size == 33
    flight, ideal = weaving(seconds, 20.0)
    time = np.arange(1.0, seconds + 0.5)
    off, declared = [], []
    for seed in range(runs):
        run, rng = one_run(flight, ideal, model, sigma, seed), np.random.default_rng([7, seed])
        given = [positions(flight, time, rng), velocities(flight, time, rng)]
        result = estimate(run.imu, run.initial, given, model, rate_hz=5.0, history=True, gate=None)
        assert result.history is not None
        found = observability(model, result.history)
        errors = errors_of(model, result, flight, run)[-1]
        off.append((errors / result.sigma[-1])[9:])
        declared.append(found.observable[9:])
        assert np.all(result.sigma[-1][found.observable] <= 0.5 * model.sigma[found.observable])
    ratio, mask = np.array(off), np.array(declared)
    assert mask[0].sum() >= 3
    # beyond 3σ is one number in 370
    assert np.mean(np.abs(ratio[mask]) < 3.0) >= (0.95 if runs == 3 else 0.99)
    assert np.abs(ratio[mask]).max() < (3.5 if runs == 3 else 4.0)
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=0.25 if runs == 3 else 0.1)


def test_fewer_rows_tell_the_same() -> None:
    """Rows ten times as rare: the same covariances, transition and decay from first to last, and singular values."""
    sigma = biases_only("mems-tactical")
    model = error_model(sigma, position=5.0, velocity=0.1, attitude=(1e-3, 1e-3, 1e-2))
    flight, ideal = weaving(60.0, 20.0)
    run = one_run(flight, ideal, model, sigma, 2)
    rng, seconds = np.random.default_rng(2), np.arange(1.0, 60.5)
    given = [positions(flight, seconds, rng), velocities(flight, seconds, rng)]
    every, some = (
        estimate(run.imu, run.initial, given, model, rate_hz=5.0, history=True, row_s=row_s).history
        for row_s in (0.0, 10.0)
    )
    assert every is not None
    assert some is not None
    assert len(some.time) < 0.2 * len(every.time)
    rare = np.flatnonzero(np.isin(every.time, some.time))
    assert len(rare) == len(some.time)
    np.testing.assert_array_equal(every.covariance[rare], some.covariance)
    for of in ("transition", "decay"):
        products = [np.linalg.multi_dot(getattr(history, of)[:0:-1]) for history in (every, some)]
        scale = model.sigma[:, None] / model.sigma
        np.testing.assert_allclose(products[0] / scale, products[1] / scale, rtol=1e-9, atol=1e-9)
    singular = [observability(model, history, every=1).singular[-1] for history in (every, some)]
    np.testing.assert_allclose(singular[0], singular[1], rtol=1e-6, atol=1e-9 * singular[0][0])
    # what was fed back between rows counts at the next: the error after the last row is the same
    ends = [history.state[-1] for history in (every, some)]
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-9, atol=0)
    for k, row in enumerate(rare[1:], start=1):
        before, fed = rare[k - 1], np.zeros(model.size)
        for j in range(before + 1, row + 1):
            fed = every.transition[j] @ fed + every.fed_back[j]
        np.testing.assert_allclose(some.fed_back[k], fed, rtol=1e-6, atol=1e-12)


def test_singular_values_by_the_stacked_matrix() -> None:
    """Rows R^(−½) H Ψ of readings in three intervals, each with Ψ from the first row, in units of σ₀."""
    rng = np.random.default_rng(6)
    model = ErrorModel(
        (Block("position", (2.0, 3.0, 0.0)), Block("velocity", 0.5), Block("attitude", (1e-3, 2e-3, 5e-3))), 1e-4, 1e-3
    )
    time = np.array([1.0, 2.0, 4.0, 7.0, 8.0])
    phi = np.eye(9) + 0.1 * rng.normal(size=(5, 9, 9))
    seen = rng.normal(size=(5, 2, 9)) / model.sigma.clip(0.1)  # H over σ of the readings
    seen[0] *= 50.0  # what was read before the part began
    information = np.einsum("kmi,kmj->kij", seen, seen)
    covariance = np.tile(np.diag(np.arange(1.0, 10.0) ** 2 * 1e-8), (5, 1, 1))
    made = history(time, transition=phi, information=information, covariance=covariance)
    for begin, end, rows in ((-np.inf, 7.5, [0, 1, 2, 3]), (2.0, np.inf, [1, 2, 3, 4])):
        found = observability(model, made, begin, end, every=2)
        psi, stack, values = np.eye(9), np.zeros((0, 9)), [np.zeros(9)]
        for row in rows[1:]:
            stack = np.vstack([stack, seen[row] @ psi * model.sigma])
            psi = phi[row] @ psi
            values.append(np.r_[np.linalg.svd(stack, compute_uv=False), np.zeros(9)][:9])
        np.testing.assert_array_equal(found.time, time[[rows[0], rows[2], rows[3]]])
        np.testing.assert_allclose(found.singular, np.array(values)[[0, 2, 3]], rtol=1e-6, atol=1e-6)
        limit = np.sqrt(np.diag(np.linalg.inv(np.eye(9) + stack.T @ stack)))
        np.testing.assert_allclose(found.limit, limit, rtol=1e-9)
        reduction = np.arange(1.0, 10.0) * 1e-4 / np.where(model.sigma > 0.0, model.sigma, np.inf)
        reduction[2] = 1.0  # a state without uncertainty
        np.testing.assert_allclose(found.reduction, reduction, rtol=1e-12)
        for value, direction in zip(found.singular[-1], found.directions, strict=True):
            assert np.linalg.norm(stack @ direction) == pytest.approx(value, abs=1e-6)
        assert found.seen.tolist() == [bool(one <= 0.5 and s > 0.0) for one, s in zip(limit, model.sigma, strict=True)]
        np.testing.assert_array_equal(found.observable, found.seen & (reduction <= 0.5))
