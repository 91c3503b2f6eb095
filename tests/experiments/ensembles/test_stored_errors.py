"""Errors in a file: the same numbers, bit for bit, as from arrays, a part at a time."""

from __future__ import annotations

import gc
import os
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sinssim
from sinssim.experiments.ensembles import ensemble_errors, ensemble_run
from sinssim.experiments.ensembles.ensemble_errors import (
    RunErrors,
    StoredErrors,
    bytes_of,
    empty,
    errors_for,
    groups_of,
    spans_of,
)
from sinssim.experiments.ensembles.ensemble_plan import make_plan
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult
from sinssim.experiments.ensembles.ensemble_run import EnsembleMedia
from sinssim.experiments.ensembles.ensemble_summary import summary_of
from sinssim.experiments.ensembles.ensemble_verdicts import judge
from sinssim.statistics.requirements import parse_requirements
from tests.experiments.ensembles.examples import AIDED, PARKED, scenario
from tests.slow import slow

RUNS, EPOCHS = 130, 41
BLOCKS, SENSORS = {"all states": 15, "position": 3}, ("gnss",)
REQUIREMENTS = ("r95(run) <= 2.5 m", "velocity_north(run) <= 1 m/s", "heading(20 s) <= 1 deg", "rate(end) <= 9 m/s")


def random_errors(runs: int = RUNS, epochs: int = EPOCHS, filtered: bool = True) -> RunErrors:
    """Return random errors: some runs failed, some ended early, a filter begins late."""
    rng = np.random.default_rng(4)
    errors = empty(runs, epochs, ("a",), tuple(BLOCKS) if filtered else (), SENSORS if filtered else ())
    errors.number[:], errors.seed[:], errors.end[:] = np.arange(runs), rng.integers(9**9, size=runs), 40.0
    for name in ("position_ned", "velocity_ned", "attitude", "final", "sigma", "a"):
        values = errors.values["a"] if name == "a" else getattr(errors, name)
        if values is not None:
            values[:] = rng.normal(size=values.shape)
    for kind in (errors.nees, errors.nees_freedom, errors.nis, errors.nis_freedom):
        for values in kind.values():
            values[:] = rng.chisquare(3, size=values.shape)
    for values in (errors.position_ned, errors.velocity_ned, errors.attitude):
        values[3, 17:] = np.nan
        values[5] = np.nan
    for kind in (errors.nees, errors.nees_freedom):
        for values in kind.values():
            values[:, :4] = np.nan
    errors.failure[5], errors.final[5] = "it went away.", np.nan
    return errors


def stored(errors: RunErrors, folder: Path, group: int = 17) -> StoredErrors:
    """Return the same errors in a file, put there in groups."""
    found = StoredErrors(
        len(errors), errors.position_ned.shape[1], tuple(errors.values), tuple(errors.nees), tuple(errors.nis), folder
    )
    for first in range(0, len(errors), group):
        part = _rows(errors, slice(first, first + group))
        found.put(part, first)
    return found


def _rows(errors: RunErrors, rows: slice) -> RunErrors:
    return RunErrors(
        errors.number[rows], errors.seed[rows], errors.end[rows], errors.failure[rows],
        {key: values[rows] for key, values in errors.values.items()}, errors.final[rows], errors.blocks, errors.sensors,
        errors.table[:, rows],
    )  # fmt: skip


def result_of(errors: RunErrors | StoredErrors) -> EnsembleResult:
    plan = make_plan(scenario(AIDED))
    epochs = np.linspace(0.0, 40.0, EPOCHS)
    return EnsembleResult(replace(plan, epochs=epochs, blocks=BLOCKS, sensors=SENSORS), errors, media=EnsembleMedia())


@pytest.mark.parametrize("at_once", [2**20, 1000, 1])
def test_the_same_numbers_as_from_arrays(at_once: int, tmp_path, monkeypatch) -> None:
    errors = random_errors()
    arrays = result_of(errors)
    whole, judged = summary_of(arrays), [judge(arrays, one, 120) for one in parse_requirements(REQUIREMENTS)]
    monkeypatch.setattr(ensemble_errors, "AT_ONCE", at_once)
    result = result_of(stored(errors, tmp_path))
    assert len(result.errors.spans()) == {2**20: 1, 1000: 6, 1: 20}[at_once]
    np.testing.assert_equal(summary_of(result), whole)
    assert [judge(result, one, 120) for one in parse_requirements(REQUIREMENTS)] == judged
    for quantity in ("position_ned", "velocity_ned", "attitude"):
        np.testing.assert_array_equal(getattr(result.errors, quantity), getattr(errors, quantity))
        np.testing.assert_array_equal(result.stated(quantity), arrays.stated(quantity))
        for name, values in vars(arrays.spread(quantity)).items():
            np.testing.assert_array_equal(getattr(result.spread(quantity), name), values)
    for name in ("cep", "r95", "percentile"):
        one, other = (getattr(r, name) if name != "percentile" else r.percentile(0.8, 0.9) for r in (result, arrays))
        np.testing.assert_equal(vars(one), vars(other))
    np.testing.assert_array_equal(result.errors.sigma, errors.sigma)
    for kind in ("nees", "nees_freedom", "nis", "nis_freedom", "values"):
        np.testing.assert_equal(dict(getattr(result.errors, kind)), getattr(errors, kind))


def test_sums_do_not_depend_on_the_parts() -> None:
    """The mean of the squares over all epochs of all runs, against one sum over the whole array."""
    errors = random_errors()
    found = summary_of(result_of(errors))["components"]["position_n_m"]["rms"]
    assert found == pytest.approx(float(np.sqrt(np.nanmean(errors.position_ned[..., 0] ** 2))), rel=1e-14)


def test_a_part_of_a_column(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(ensemble_errors, "AT_ONCE", 700)
    errors = random_errors()
    kept = stored(errors, tmp_path)
    assert set(kept.names) == set(errors.names)
    for name in kept.names:
        for epochs, runs in ((slice(3, 30), slice(11, 90)), (slice(40, 41), slice(None)), (slice(None), slice(0, 0))):
            np.testing.assert_array_equal(kept.column(name, epochs, runs), errors.column(name, epochs, runs))


@pytest.mark.parametrize(("runs", "epochs"), [(1, 2), (3, 601), (1000, 601), (20_000, 601), (10**6, 601), (10**7, 3)])
def test_parts_are_small_and_complete(runs: int, epochs: int) -> None:
    spans, groups = spans_of(runs, epochs), groups_of(runs, epochs)
    for parts, length in ((spans, epochs), (groups, runs)):
        assert [part.start for part in parts] == [0, *(part.stop for part in parts[:-1])]
        assert parts[-1].stop == length
    widths = [part.stop - part.start for part in spans]
    assert min(widths) >= 2  # numpy adds a single column in another order
    assert max(widths) <= max(ensemble_errors.AT_ONCE / runs + 1, 3)
    assert max(part.stop - part.start for part in groups) <= max(ensemble_errors.AT_ONCE / epochs + 1, 1)


def test_statistics_hold_parts_only(tmp_path, monkeypatch) -> None:
    """Peak of all arrays: some parts, and what is kept of each run beside the epochs, not the errors of all runs."""
    runs, epochs = 2000, 100
    errors = random_errors(runs, epochs, filtered=False)
    monkeypatch.setattr(ensemble_errors, "AT_ONCE", 2**13)
    kept = stored(errors, tmp_path, 500)
    plan = replace(make_plan(scenario()), epochs=np.linspace(0.0, 40.0, epochs))
    del errors
    gc.collect()

    def statistics() -> None:
        result = EnsembleResult(plan, kept, media=EnsembleMedia())
        summary_of(result)
        result.spread("velocity_ned")
        judge(result, parse_requirements(["velocity_north(run) <= 1 m/s"])[0])
        result.to_parquet(tmp_path / "tables")

    statistics()  # imports what it needs
    tracemalloc.start()
    try:
        statistics()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 30 * 8 * 2**13 + 500 * runs  # 3 MB
    assert bytes_of(runs, epochs) > 4 * peak


def test_many_are_stored_and_few_are_arrays(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(ensemble_errors, "IN_MEMORY", 8 * 9 * 10 * 100)
    assert isinstance(errors_for(100, 10, (), (), (), tmp_path), RunErrors)
    assert isinstance(errors_for(101, 10, (), (), (), tmp_path), StoredErrors)


def test_the_file_has_no_name_and_goes_with_the_result(tmp_path) -> None:
    kept = stored(random_errors(), tmp_path)
    assert os.listdir(tmp_path) == []
    file = kept._file
    kept.column("position_n_m")
    assert not file.closed
    del kept
    gc.collect()
    assert file.closed


def test_an_array_beyond_the_memory_is_refused(tmp_path, monkeypatch) -> None:
    kept = stored(random_errors(), tmp_path)
    monkeypatch.setattr(ensemble_errors, "machine_memory", lambda: 1e5)
    with pytest.raises(sinssim.InputError, match=r"130 × 41 × 3 numbers needs 0\.000128 GB .* errors\.column"):
        _ = kept.position_ned
    assert kept.column("position_n_m").shape == (RUNS, EPOCHS)


@pytest.mark.parametrize(("contents", "runs"), [(PARKED, 10), *slow((AIDED, 3))])
def test_an_ensemble_from_end_to_end(contents, runs, tmp_path, monkeypatch) -> None:
    """With a directory and without one."""
    monkeypatch.setattr(ensemble_run, "write_ensemble", lambda *_: None)
    base, want = scenario(contents), ["r95(run) <= 100 m"]
    numbers = summary_of(sinssim.ensemble(base, runs, tmp_path / "e", require=want, threads=1))
    monkeypatch.setattr(ensemble_errors, "IN_MEMORY", 0)
    monkeypatch.setattr(ensemble_errors, "AT_ONCE", 50 * runs)
    again = sinssim.ensemble(base, runs, tmp_path / "e", require=want, resume=True)
    alone = sinssim.ensemble(base, runs, require=want, threads=1)
    for result in (again, alone):
        assert isinstance(result.errors, StoredErrors)
        found = summary_of(result)
        for name in numbers.keys() - {"seconds", "computed"}:
            np.testing.assert_equal(found[name], numbers[name])
    assert np.isfinite(alone.errors.position_ned).all()  # its directory is gone
