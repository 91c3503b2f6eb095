"""The filter's own report, and ensembles: consistent if the filter is told the truth, and found out if it is not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom, chi2

from sinssim.data import Array, Measurements
from sinssim.estimation import Block, ErrorModel, Innovations, error_model
from sinssim.estimation.consistency import Consistency, consistency, nees, sensor_consistency
from sinssim.estimation.estimate import estimate
from sinssim.estimation.filter_result import Divergence
from tests.estimation.worlds import balanced, biases_only, errors_of, metres, one_run, positions, velocities, weaving
from tests.slow import slow

SIGMA = biases_only("laser-standard")
MODEL = error_model(SIGMA, position=(5.0, 5.0, 5.0), velocity=0.1, attitude=(3e-4, 3e-4, 3e-3))


def lower_of(covariance: Array) -> Array:
    """Return the lower triangle of each matrix, row by row."""
    return covariance[:, *np.tril_indices(covariance.shape[1])]


def innovations(e: Array, bound: float = np.inf) -> Innovations:
    """Return innovations whose whitened values are e."""
    rng = np.random.default_rng(99)
    count, k = e.shape
    root = np.tril(rng.uniform(0.2, 1.0, (count, k, k)))
    value = np.einsum("nij,nj->ni", root, e)
    nis = np.sum(e * e, axis=1)
    accepted = nis <= bound
    return Innovations(
        "gnss", "gnss-position", np.arange(1.0, count + 1.0), value,
        lower_of(root @ root.transpose(0, 2, 1)), nis, accepted,
        tuple("" if a else "gate" for a in accepted), bound,
    )  # fmt: skip


def test_verdicts_on_made_innovations() -> None:
    rng = np.random.default_rng(1)
    white = rng.standard_normal((4000, 3))
    sound = sensor_consistency(innovations(white))
    assert sound.verdict == "consistent"
    assert sound.tests[0].value == pytest.approx(np.mean(white**2))
    low, high = chi2.ppf((0.025, 0.975), 12000) / 12000
    assert (sound.tests[0].lower, sound.tests[0].upper) == pytest.approx((low, high))
    assert np.abs(sound.autocorrelation).max() < 4.0 / np.sqrt(12000.0)
    assert sensor_consistency(innovations(1.1 * white)).verdict == "optimistic"
    assert sensor_consistency(innovations(0.9 * white)).verdict == "pessimistic"
    # most fixes better than they claim, some far off: the noise is not larger than assumed
    spoilt = 0.5 * white
    spoilt[::100] *= 20.0
    assert sensor_consistency(innovations(spoilt, float(chi2.isf(1e-4, 3)))).verdict == "outliers"
    # an error of a tenth of the noise that lasts a hundred readings: nothing to be seen of it in NIS
    slow = np.repeat(rng.standard_normal((40, 3)), 100, axis=0)
    found = sensor_consistency(innovations((white + 0.3 * slow) / np.sqrt(1.0 + 0.09)))
    assert found.tests[0].lower < found.tests[0].value < found.tests[0].upper
    assert found.verdict == "optimistic"
    # alternating: white in the long run, coloured from one to the next
    tied = white.copy()
    tied[1:] -= 0.3 * white[:-1]
    tied /= np.sqrt(1.09)
    assert sensor_consistency(innovations(tied)).autocorrelation[0] == pytest.approx(-0.3 / 1.09, abs=0.03)
    assert sensor_consistency(innovations(tied)).verdict in ("coloured", "pessimistic")
    assert sensor_consistency(innovations(white[:5])).verdict == "unknown"


def test_tests_by_their_definitions() -> None:
    e = np.random.default_rng(7).standard_normal((130, 2))
    found = sensor_consistency(innovations(e))
    rho = [sum(e[i] @ e[i + lag] for i in range(130 - lag)) / np.sum(e * e) for lag in range(1, 21)]
    np.testing.assert_allclose(found.autocorrelation, rho, rtol=1e-12)
    # Ljung and Box: Q = n(n + 2) Σ ρ²/(n − l) of n values; here n = 260 with 2l fewer products at the lag l
    whiteness = 260.0 * 262.0 * sum(r * r / (260.0 - 2 * lag) for lag, r in enumerate(rho, 1))
    slow = sum(float(np.sum(e[16 * i : 16 * (i + 1)].sum(axis=0) ** 2)) / 16.0 for i in range(8))
    expected = {
        "NIS": (float(np.sum(e * e)), 260),
        "whiteness": (whiteness, 20),
        "slow part, 16 readings": (slow, 16),
    }
    assert [test.name for test in found.tests] == list(expected)
    for test, (statistic, freedom) in zip(found.tests, expected.values(), strict=True):
        assert test.value == pytest.approx(statistic / freedom, rel=1e-12)
        assert (test.lower, test.upper) == pytest.approx(tuple(chi2.ppf((0.025, 0.975), freedom) / freedom))
        below = chi2.cdf(statistic, freedom)
        assert test.probability == pytest.approx(2.0 * min(below, 1.0 - below))


@pytest.mark.parametrize(
    ("count", "tests", "lags"),
    [(7, 0, 0), (8, 2, 2), (127, 2, 20), (128, 3, 20), (512, 4, 20), (2048, 5, 20)],
)
def test_eight_readings_or_windows_are_the_fewest(count: int, tests: int, lags: int) -> None:
    found = sensor_consistency(innovations(np.random.default_rng(8).standard_normal((count, 1))))
    assert (len(found.tests), len(found.autocorrelation)) == (tests, lags)
    assert (found.verdict == "unknown") == (count < 8)


@pytest.mark.parametrize("verdict", ["optimistic", "pessimistic"])
def test_each_test_has_its_share_of_the_false_alarms(verdict: str) -> None:
    """Four tests and the gate: NIS speaks at 0.01/5, on either side at half of that, and not a twentieth before."""
    white = np.random.default_rng(9).standard_normal((1000, 1))
    quantile = chi2.isf if verdict == "optimistic" else chi2.ppf
    for share, expected in ((0.95, verdict), (1.05, "consistent")):
        size = np.sqrt(quantile(share * 0.01 / 5.0 / 2.0, 1000) / np.sum(white**2))
        found = sensor_consistency(innovations(size * white))
        assert len(found.tests) == 4
        assert found.verdict == expected


def test_a_gate_may_reject_as_many_as_chance_does() -> None:
    bound = float(chi2.isf(1e-3, 1))
    white = np.random.default_rng(10).standard_normal((4000, 1))
    white = white[white[:, 0] ** 2 < bound][:2000]
    most = next(n for n in range(2000) if binom.sf(n, 2000, 1e-3) < 0.01 / 5.0)  # of more, the probability is less
    for rejected, verdict in ((most, "consistent"), (most + 1, "optimistic")):
        spoilt = white.copy()
        spoilt[:rejected] = 4.0
        found = sensor_consistency(innovations(spoilt, bound))
        assert (found.count, found.rejected, len(found.tests)) == (2000, rejected, 4)
        assert found.verdict == verdict
    none = sensor_consistency(innovations(np.full((5, 1), 4.0), bound))
    assert (none.verdict, none.tests, none.rejected) == ("optimistic", (), 5)


def test_slow_parts_and_colour() -> None:
    white = np.random.default_rng(11).standard_normal((4097, 1))
    quiet = (white[1:] - 0.7 * white[:-1]) / np.sqrt(1.49)
    assert sensor_consistency(innovations(quiet)).verdict == "pessimistic"
    # too quiet over 16 readings, too much over 256: the longest window that fails says what is wrong
    drift = np.repeat(np.tile([0.15, -0.15], 8), 256)[:, None]
    found = sensor_consistency(innovations(np.sqrt(1.0 - 0.15**2) * quiet + drift))
    assert found.tests[2].value < 0.6
    assert found.tests[4].value > 3.0
    assert found.verdict == "optimistic"
    # an echo and its opposite: nothing is left of them in sums
    echo = white.copy()
    echo[5:] += 0.2 * white[:-5]
    echo[6:] -= 0.2 * white[:-6]
    assert sensor_consistency(innovations(echo / np.sqrt(1.08))).verdict == "coloured"


def test_a_reading_whose_covariance_has_broken_down_is_left_out() -> None:
    sound = innovations(np.random.default_rng(12).standard_normal((50, 2)))
    covariance = sound.covariance.copy()
    covariance[20] = np.diag([1.0, -1e-9])
    kept = np.arange(50) != 20
    without = replace(sound, accepted=kept)
    found = sensor_consistency(replace(sound, lower=lower_of(covariance)))
    assert found.tests == sensor_consistency(without).tests


def test_a_covariance_is_as_broken_as_its_largest_variance_makes_it() -> None:
    """Twelve digits between the smallest and the largest of three eigenvalues, wherever the middle one is."""
    sound = innovations(np.random.default_rng(12).standard_normal((50, 3)))
    covariance = sound.covariance.copy()
    covariance[20] = np.diag([1.0, 1.0, -1e-9])
    covariance[30] = np.diag([1.0, 0.1, 5e-13])
    kept = (np.arange(50) != 20) & (np.arange(50) != 30)
    found = sensor_consistency(replace(sound, lower=lower_of(covariance)))
    assert found.tests == sensor_consistency(replace(sound, accepted=kept)).tests


def test_the_covariance_of_an_innovation_is_its_lower_triangle_twice() -> None:
    a = np.array([[4.0, 1.0, 2.0], [1.0, 9.0, 3.0], [2.0, 3.0, 16.0]])
    whole = np.stack([a, 2.0 * a, 3.0 * a])
    found = replace(innovations(np.zeros((3, 3))), lower=lower_of(whole))
    assert found.lower[0].tolist() == [4.0, 1.0, 9.0, 2.0, 3.0, 16.0]
    np.testing.assert_array_equal(found.covariance, whole)
    np.testing.assert_array_equal(found.covariance_at(np.array([2, 0])), whole[[2, 0]])
    np.testing.assert_array_equal(found.sigma_at(slice(0, 1)), [[2.0, 3.0, 4.0]])


def test_a_report_names_what_is_wrong_and_nothing_else() -> None:
    white = np.random.default_rng(13).standard_normal((500, 1))
    refused = innovations(np.full((5, 1), 4.0), float(chi2.isf(1e-3, 1)))
    of_run: Any = SimpleNamespace(innovations=(innovations(white), replace(refused, sensor="baro")), divergence=None)
    (sentence,) = consistency(of_run).sentences
    assert sentence == (
        "baro: optimistic, the noise is larger than assumed: none accepted; 5 of 5 measurements rejected "
        "where 0.005 are expected."
    )
    # each sensor has half of a hundredth, shared with the others
    square = chi2.isf(0.5 * 0.8 * 0.005 / 2.0 / 4.0, 500)
    loud = innovations(np.sqrt(square / np.sum(white**2)) * white)
    for others, said in ((1, True), (2, False)):
        quiet = tuple(innovations(white) for _ in range(others))
        of_run = SimpleNamespace(innovations=(loud, *quiet), divergence=Divergence(17.126, "gnss 4", "it broke down"))
        *found, last = consistency(of_run).sentences
        assert last == "The filter diverged at t = 17.13 s: it broke down."
        tests = ", ".join(
            f"{one.name} {one.value:.3g} (95 % band {one.lower:.3g} … {one.upper:.3g})"
            for one in sensor_consistency(loud).tests
        )
        assert len(sensor_consistency(loud).tests) == 3
        assert found == (
            [
                f"gnss: optimistic, the noise is larger than assumed: {tests}; 0 of 500 measurements "
                "rejected where 0 are expected."
            ]
            if said
            else []
        )


@pytest.mark.parametrize(("probability", "size"), [(0.02, 3), (0.1, 1), (0.3, 3)])
def test_what_a_strict_gate_leaves_is_not_called_too_little(probability: float, size: int) -> None:
    """Refusing right readings, as it is told to, it takes the largest innovations away: a filter is no worse for it."""
    bound = float(chi2.isf(probability, size))
    rng = np.random.default_rng(5)
    found = [sensor_consistency(innovations(rng.standard_normal((6000, size)), bound)) for _ in range(20)]
    assert [f.verdict for f in found].count("consistent") >= 19
    value = np.mean([f.tests[0].value for f in found])
    assert value == pytest.approx(1.0, abs=4.5 * np.sqrt(2.0 / (20 * 6000 * size)))
    assert sensor_consistency(innovations(0.9 * rng.standard_normal((6000, size)), bound)).verdict == "pessimistic"


def test_a_gate_that_rejects_much_speaks_against_the_filter() -> None:
    bound = float(chi2.isf(1e-3, 3))
    white = np.random.default_rng(2).standard_normal((2000, 3))
    sound = sensor_consistency(innovations(white, bound))
    assert sound.expected == pytest.approx(2.0)
    assert sound.verdict == "consistent"
    spoilt = white.copy()
    spoilt[100:130] += 20.0
    found = sensor_consistency(innovations(spoilt, bound))
    assert found.rejected >= 30
    assert found.verdict == "optimistic"


def test_false_alarms_are_as_rare_as_said() -> None:
    rng = np.random.default_rng(3)
    wrong = sum(
        sensor_consistency(innovations(rng.standard_normal((1000, 1)))).verdict != "consistent" for _ in range(300)
    )
    assert wrong <= 10  # 1 % of 300 are 3, at most 10 with a probability of 0.9997


def test_nees_is_the_definition() -> None:
    rng = np.random.default_rng(4)
    root = rng.standard_normal((6, 4, 4)) * np.array([1e-8, 1.0, 100.0, 1e-4])[:, None]
    p, x = root @ root.transpose(0, 2, 1), rng.standard_normal((6, 4)) * np.array([1e-8, 1.0, 100.0, 1e-4])
    expected = [float(v @ np.linalg.inv(c) @ v) for v, c in zip(x, p, strict=True)]
    np.testing.assert_allclose(nees(x, p), expected, rtol=1e-6)
    part = slice(1, 3)
    expected = [float(v[part] @ np.linalg.inv(c[part, part]) @ v[part]) for v, c in zip(x, p, strict=True)]
    np.testing.assert_allclose(nees(x, p, part), expected, rtol=1e-9)
    exact = np.diag([4.0, 0.0])
    assert nees(np.array([4.0, 0.0]), exact) == pytest.approx(4.0)


@dataclass(frozen=True)
class Anees:
    """NEES of an ensemble: mean over the runs at each epoch per degree of freedom, and the band of one epoch."""

    value: Array
    lower: float
    upper: float

    @property
    def inside(self) -> float:
        """Fraction of the epochs inside the band."""
        return float(np.mean((self.value >= self.lower) & (self.value <= self.upper)))


def anees(values: Sequence[Array], freedom: int) -> Anees:
    """Return the average NEES of runs at the same epochs, M times (K,), with its 95 % band."""
    runs = len(values)
    lower, upper = (float(bound) / (runs * freedom) for bound in chi2.ppf((0.025, 0.975), runs * freedom))
    return Anees(np.mean(values, axis=0) / freedom, lower, upper)


def test_anees_of_right_and_wrong_covariances() -> None:
    rng = np.random.default_rng(5)
    values = [np.sum(rng.standard_normal((1000, 6)) ** 2, axis=1) for _ in range(50)]
    right = anees(values, 6)
    assert (right.lower, right.upper) == pytest.approx(tuple(chi2.ppf((0.025, 0.975), 300) / 300))
    assert right.inside == pytest.approx(0.95, abs=0.025)
    assert anees([1.5 * v for v in values], 6).inside < 0.05


def ensemble(runs: int, duration: float) -> tuple[dict[str, list[Array]], list[float], list[Consistency]]:
    """Return NEES by block every 20 s, NIS of all readings, and the reports, of runs with true noise parameters.

    What is drawn once lasts the whole flight: the NEES of the gyros' biases has a correlation of 0.64 over two
    thirds of it. Of ten ensembles of 200 free draws each, three have a block outside its band for more than a tenth of
    the flight, though the mean NEES of all 2000 is 1 within 0.005 in every block, less than its own 1σ. So the
    constants of an ensemble are balanced, and noise alone decides.
    """
    flight, ideal = weaving(duration, 20.0)
    time = np.arange(1.0, duration + 0.5)
    values: dict[str, list[Array]] = {}
    nis, reports = [], []
    for seed, constants in enumerate(balanced(runs, MODEL.size, 0)):
        run, rng = one_run(flight, ideal, MODEL, SIGMA, seed, constants), np.random.default_rng([5, seed])
        given = [positions(flight, time, rng), velocities(flight, time, rng)]
        result = estimate(run.imu, run.initial, given, MODEL, rate_hz=2.0, gate=None)
        errors = errors_of(MODEL, result, flight, run)[result.rows]
        for name, where in {"all": slice(0, 15), **MODEL.slices}.items():
            values.setdefault(name, []).append(nees(errors[1::20], result.covariance[1::20], where))
        nis.append(float(sum(np.sum(i.nis) for i in result.innovations)))
        reports.append(consistency(result))
    return values, nis, reports


@pytest.mark.parametrize(("runs", "seconds"), [(16, 60), *slow((24, 200))])
def test_a_small_ensemble_with_true_noise_is_consistent(runs: int, seconds: int) -> None:
    values, nis, reports = ensemble(runs, float(seconds))
    for name, of_runs in values.items():
        found = anees(of_runs, 15 if name == "all" else 3)
        # a few epochs that hang together: the blocks are judged by their mean
        assert found.inside >= 0.9 if name == "all" else 0.75 < np.mean(found.value) < 1.3, (name, found.value)
    freedom = runs * seconds * 6
    assert chi2.ppf(0.025, freedom) < sum(nis) < chi2.ppf(0.975, freedom)
    assert sum(report.consistent for report in reports) >= runs - 1


@pytest.mark.slow
def test_an_ensemble_of_two_hundred_runs_is_consistent() -> None:
    """ANEES of all states and of each block inside its 95 % band in 90 % of the epochs at least, NIS likewise."""
    values, nis, reports = ensemble(200, 1200.0)
    for name, of_runs in values.items():
        found = anees(of_runs, 15 if name == "all" else 3)
        assert found.inside >= 0.9, (name, found.value)
        assert np.mean(found.value) == pytest.approx(1.0, abs=0.08)
    freedom = 200 * 1200 * 6
    assert chi2.ppf(0.025, freedom) < sum(nis) < chi2.ppf(0.975, freedom)
    of_each = [sum(n) for n in np.array_split(nis, 20)]
    band = chi2.ppf((0.025, 0.975), freedom / 20)
    assert np.mean([band[0] < n < band[1] for n in of_each]) >= 0.9
    assert np.mean([report.consistent for report in reports]) >= 0.97


def mistuned(model: ErrorModel, given: list[Measurements], factor: float, what: str) -> tuple:
    """Return model and measurements whose noise is told wrong by a factor."""
    told = [replace(m, sigma=factor * m.sigma) for m in given] if what != "inertial" else given
    if what == "aiding":
        return model, told
    blocks = tuple(
        Block(b.name, factor * np.asarray(b.sigma), correlation_time=b.correlation_time)
        if what == "all" or "bias" in b.name or "instability" in b.name
        else b
        for b in model.blocks
    )
    return ErrorModel(blocks, factor * model.gyro_noise, factor * model.accel_noise), told


@pytest.mark.parametrize(
    ("grade", "what", "seconds"),
    [
        ("mems-industrial", "inertial", 300.0),
        *slow(("mems-industrial", "inertial", 600.0), ("laser-standard", "all", 600.0)),
        *slow(("laser-standard", "aiding", 600.0)),
    ],
)
def test_wrong_noise_is_found_out_without_the_truth(grade: str, what: str, seconds: float) -> None:
    flight, ideal = weaving(seconds, 20.0)
    sigma = biases_only(grade)
    model = error_model(sigma, position=5.0, velocity=0.1, attitude=(1e-3, 1e-3, 5e-3))
    time, rng = np.arange(1.0, seconds + 0.5), np.random.default_rng(0)
    run = one_run(flight, ideal, model, sigma, 0)
    given = [positions(flight, time, rng), velocities(flight, time, rng, 0.03)]
    assert consistency(estimate(run.imu, run.initial, given, model, rate_hz=5.0)).sentences == ()
    for factor, verdict in ((0.3, "optimistic"), (3.0, "pessimistic")):
        wrong, told = mistuned(model, given, factor, what)
        report = consistency(estimate(run.imu, run.initial, told, wrong, rate_hz=5.0))
        assert not report.consistent
        assert verdict in {s.verdict for s in report.sensors}
        assert any(verdict in text and "95 % band" in text for text in report.sentences)


def test_a_drift_too_slow_for_the_gate_shows_in_the_slow_part() -> None:
    flight, ideal = weaving(1200.0, 20.0)
    run, rng = one_run(flight, ideal, MODEL, SIGMA, 1), np.random.default_rng(0)
    time = np.arange(1.0, 1200.5)
    place = positions(flight, time, rng)
    north, _ = metres(flight.state(time))
    value = place.value.copy()
    value[:, 0] += 0.1 * np.maximum(time - 300.0, 0.0) / north  # 90 m in the end
    result = estimate(run.imu, run.initial, [replace(place, value=value)], MODEL, rate_hz=2.0)
    assert result.innovations[0].accepted.mean() > 0.99
    report = consistency(result)
    assert not report.consistent
    assert report.sensors[0].verdict == "optimistic"


def test_a_diverged_filter_is_not_consistent() -> None:
    flight, ideal = weaving(300.0, 20.0)
    run, rng = one_run(flight, ideal, MODEL, SIGMA, 1), np.random.default_rng(0)
    place = positions(flight, np.arange(1.0, 300.5), rng)
    value = place.value.copy()
    value[100:, 2] += 500.0
    report = consistency(estimate(run.imu, run.initial, [replace(place, value=value)], MODEL, rate_hz=2.0))
    assert not report.consistent
    assert any(text.startswith("The filter diverged at t = 101.00 s") for text in report.sentences)


def test_without_a_sensor_nothing_speaks_against_the_filter() -> None:
    assert consistency(SimpleNamespace(innovations=(), divergence=None)) == Consistency((), True, ())  # type: ignore[arg-type]
