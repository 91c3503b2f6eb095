"""A batch against single runs: the same numbers but for rounding, and the same bits by any number of threads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from sinssim.data import ImuData, NavState
from sinssim.errors import InputError
from sinssim.experiments.ensembles.batch_layout import LANES
from sinssim.experiments.ensembles.batch_navigation import BatchSolution, _initial, navigate_batch
from sinssim.sensors import draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_errors import Fault, ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.strapdown.navigate import navigate
from tests.oracles.s_turn import Flight, STurn
from tests.slow import slow

SECTIONS: dict[str, dict[str, Any]] = {
    "laser-standard in full": {
        "grade": "laser-standard",
        "gyro_instability_deg_h": 0.003,
        "accel_instability_ug": 5.0,
        "gyro_quantum_arcsec": 0.5,
        "accel_quantum_mm_s": 1.0,
    },
    "laser-navigation": {"grade": "laser-navigation"},
    "industrial MEMS with flicker": {
        "grade": "mems-industrial",
        "gyro_flicker_deg_h": 10.0,
        "accel_flicker_ug": 50.0,
        "gyro_rrw_deg_h_sqrt_h": 1.0,
        "gyro_range_deg_s": 300.0,
        "gyro_g_sensitivity_sigma_deg_h_per_g": 10.0,
        "accel_quadratic_sigma_ug_per_g2": 50.0,
        "temperature_start_c": -20.0,
        "gyro_bias_temperature_sigma_deg_h_per_c": 1.0,
    },
    "ideal": {"grade": "ideal"},
}


LIMITS = {"latitude": 1e-15, "longitude": 1e-15, "height": 1e-9, "velocity_ned": 1e-10}
"""Rounding errors of 2000 steps: the compiler fuses other products with sums in the kernel of a batch."""


@cache
def flight() -> Flight:
    """Return 20 s of S-turns at 100 Hz."""
    return STurn(duration=20.0).fly(100.0)


def held() -> dict[str, Any]:
    """Return the options of most of these tests: one kernel serves them."""
    return {"vertical": "baro-loop", "height": flight().height}


def ideal() -> ImuData:
    return ImuData(flight().time, flight().dtheta, flight().dvel)


def start(north: float = 0.0) -> NavState:
    first = (field[0] for field in (flight().latitude, flight().longitude, flight().height))
    latitude, longitude, height = first
    return NavState(latitude + north / 6.4e6, longitude, height, flight().velocity_ned[0], flight().q_nb[0])


def drawn(name: str, seeds: Sequence[int]) -> list[ImuErrors]:
    section = Imu.model_validate(SECTIONS[name])
    return [draw(section, seed) for seed in seeds]


def assert_equal(batch: BatchSolution, run: int, initial: NavState, errors: ImuErrors, seed: int, rows: Any,
                 signed: bool = True, **options: Any) -> None:  # fmt: skip
    """Fail unless a run of a batch has the numbers of a single run, but for rounding."""
    single = navigate(emulate(ideal(), errors, seed, rounded=True), initial, **options)
    state = batch.state(run)
    for name, limit in LIMITS.items():
        np.testing.assert_allclose(getattr(state, name), getattr(single, name)[rows], rtol=0, atol=limit, err_msg=name)
    q, expected = state.q_nb, single.q_nb[rows]
    if not signed:
        q, expected = q * np.sign(q[:, :1]), expected * np.sign(expected[:, :1])
    np.testing.assert_allclose(q, expected, rtol=0, atol=1e-13)


# each kernel takes ten seconds to compile; that of `held` and of the first section is the one of the normal run
@pytest.mark.parametrize("name", ["laser-standard in full", *slow(*list(SECTIONS)[1:])])
def test_every_run_has_the_numbers_of_a_single_run(name: str) -> None:
    seeds, rows = range(100, 120), np.array([0, 1, 7, 500, 1997, 1998, 1999, 2000])
    errors = drawn(name, seeds)
    states = [start(10.0 * run) for run in range(len(seeds))]
    batch = navigate_batch(ideal(), states, errors, seeds, rows, **held())
    assert batch.time.tolist() == flight().time[rows].tolist()
    assert batch.alone == ()
    assert batch.failures == {}
    for run, seed in enumerate(seeds):
        assert_equal(batch, run, states[run], errors[run], seed, rows, **held())


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {"vertical": "free", "gravity": "j2", "algorithm": "poisson-1"},
        {"vertical": "truth", "gravity": "somigliana", "algorithm": "quaternion-3-norm"},
        {"curvature": "spherical", "algorithm": "two-quaternions", "errors": "ideal"},
        {"vertical": "free"},
        {"vertical": "truth"},
        {"gravity": "somigliana", "algorithm": "quaternion-3-norm"},
        {"curvature": "simplified", "algorithm": "poisson"},
        {"gravity": "j2", "algorithm": "poisson-1"},
    ],
    ids=lambda options: "-".join(map(str, options.values())),
)
def test_options(options: dict[str, Any]) -> None:
    seeds, rows = range(3), np.array([900, 2000])
    if options.get("vertical") == "truth":
        options = {**options, "height": flight().height}
    errors = drawn(options.get("errors", "laser-standard in full"), seeds)
    options = {key: value for key, value in options.items() if key != "errors"}
    batch = navigate_batch(ideal(), start(), errors, seeds, rows, **options)
    assert batch.alone == ()
    for run, seed in enumerate(seeds):
        signed = "poisson" not in options.get("algorithm", "")
        assert_equal(batch, run, start(), errors[run], seed, rows, signed, **options)


def test_threads_and_remainders_do_not_matter() -> None:
    """2.5 lanes by 1, 2 and 3 threads; the first 7 runs and the last 70 alone."""
    runs = 5 * LANES // 2
    seeds, rows = range(runs), np.array([1000, 2000])
    errors = drawn("laser-standard in full", seeds)

    def go(first: int, last: int, threads: int) -> Any:
        batch = navigate_batch(ideal(), start(), errors[first:last], seeds[first:last], rows, threads=threads, **held())
        return np.concatenate([batch.latitude, batch.longitude, batch.height, batch.velocity_ned[..., 2]], axis=1)

    told: list[int] = []
    navigate_batch(ideal(), start(), errors, seeds, rows, threads=1, progress=told.append, **held())
    assert sum(told) == runs
    assert min(told) > 0
    whole = go(0, runs, 1)
    assert len(np.unique(whole[:, 1])) == runs  # the runs differ
    np.testing.assert_array_equal(go(0, runs, 2), whole)
    np.testing.assert_array_equal(go(0, runs, 3), whole)
    np.testing.assert_array_equal(go(0, 7, 1), whole[:7])
    np.testing.assert_array_equal(go(runs - 70, runs, 2), whole[-70:])


def test_runs_that_leave_the_kernels_range_are_navigated_alone_and_failures_have_their_number() -> None:
    """Run 2 has a gyro that rotates by more than 14° in a sample, run 4 starts too near to the pole."""
    seeds, rows = range(6), np.array([1000, 2000])
    errors = drawn("laser-standard in full", seeds)
    fast = replace(errors[2].gyro, bias=np.array([30.0, 0.0, 0.0]))
    errors[2] = replace(errors[2], gyro=fast)
    states = [start() for _ in seeds]
    states[4] = replace(states[4], latitude=np.radians(89.95))
    batch = navigate_batch(ideal(), states, errors, seeds, rows, **held())
    assert batch.alone == (2, 4)
    assert set(batch.failures) == {4}
    assert "level frame cannot be used" in str(batch.failures[4])
    assert np.isnan(batch.latitude[4]).all()
    for run in (0, 1, 2, 3, 5):
        assert_equal(batch, run, states[run], errors[run], run, rows, **held())


def test_one_initial_state_and_many_are_served_by_one_compiled_kernel() -> None:
    """An array that may not be written would have a kernel of its own, which takes seconds to compile."""
    one, many = _initial(start(), 3), _initial([start()] * 3, 3)
    np.testing.assert_array_equal(one, many)
    assert one.flags.c_contiguous
    assert many.flags.c_contiguous
    assert one.flags.writeable
    assert many.flags.writeable


def test_unequal_intervals() -> None:
    whole = ideal()
    time = whole.time.copy()
    time[1:-1] += 1e-3 * np.sin(np.arange(len(time) - 2))
    uneven = ImuData(time, whole.dtheta, whole.dvel)
    errors, rows = drawn("laser-standard in full", range(2)), np.array([3, 2000])
    batch = navigate_batch(uneven, start(), errors, range(2), rows, **held())
    for run in range(2):
        single = navigate(emulate(uneven, errors[run], run, rounded=True), start(), **held())
        np.testing.assert_allclose(batch.latitude[run], single.latitude[rows], rtol=0, atol=LIMITS["latitude"])
        np.testing.assert_allclose(batch.velocity_ned[run], single.velocity_ned[rows], rtol=0, atol=1e-10)


def test_what_is_not_served_is_refused() -> None:
    errors = drawn("ideal", range(2))
    rows = np.array([10])
    with pytest.raises(InputError, match="poisson-2-ortho iterates"):
        navigate_batch(ideal(), start(), errors, range(2), rows, algorithm="poisson-2-ortho")
    with pytest.raises(InputError, match="rotation-vector-2 advances by several samples"):
        navigate_batch(ideal(), start(), errors, range(2), rows, algorithm="rotation-vector-2")
    with pytest.raises(InputError, match="delay of run 1 differ"):
        navigate_batch(ideal(), start(), [errors[0], replace(errors[1], delay=1e-3)], range(2), rows)
    step = Fault("bias-step", 1.0, 2.0, np.ones(6))
    with pytest.raises(InputError, match="run 1 has faults"):
        navigate_batch(ideal(), start(), [errors[0], replace(errors[1], faults=(step,))], range(2), rows)
    with pytest.raises(InputError, match="seed for each run"):
        navigate_batch(ideal(), start(), errors, range(3), rows)
    with pytest.raises(InputError, match="epochs must increase"):
        navigate_batch(ideal(), start(), errors, range(2), [5, 5])
