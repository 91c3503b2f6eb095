"""Ensembles with requirements: verdicts, the files of an ensemble that runs until it is decided, continuing it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.experiments.ensembles import ensemble_run
from sinssim.experiments.ensembles.ensemble_plan import make_plan
from sinssim.experiments.ensembles.ensemble_run import memory_needed
from sinssim.experiments.ensembles.ensemble_summary import summary_of
from sinssim.statistics import r95
from tests.experiments.ensembles import examples
from tests.experiments.ensembles.examples import files

NEAR = "position_north(end) <= {} m"


def scenario(**changes: Any) -> sinssim.Scenario:
    """Return a scenario whose runs are computed in batches."""
    navigation = {**examples.PARKED["navigation"], "algorithms": ("quaternion",)}
    return examples.scenario(navigation=navigation, **changes)


@pytest.fixture(autouse=True)
def _without_report(monkeypatch) -> None:
    """What is written about the runs is tested with the recording; here it would only take time."""
    monkeypatch.setattr(ensemble_run, "write_ensemble", lambda *_: None)


@pytest.fixture(scope="module")
def limit() -> str:
    """A requirement that 20 runs leave undecided and more decide: the σ of 160 runs and a half."""
    many = sinssim.ensemble(scenario(), 160)
    return NEAR.format(1.5 * float(np.sqrt(np.mean(many.errors.final[:, 0] ** 2))))


def test_runs_until_decided_are_those_of_an_ensemble_of_that_many(limit: str, tmp_path) -> None:
    said: list[str] = []
    wanted = [limit, "cep(10 s) <= 1 km"]
    result = sinssim.ensemble(scenario(), 20, tmp_path / "e", require=wanted, until_decided=True, say=said.append)
    assert [one.verdict for one in result.verdicts] == ["met", "met"]
    assert len(result) == result.computed == result.looks[-1] > 20
    assert result.looks == tuple(20 * 2**k for k in range(len(result.looks)))
    assert said[0] == "Undecided after 20 runs; going on to 40."
    whole = sinssim.ensemble(scenario(), len(result), tmp_path / "whole", require="cep(10 s) <= 1 km")
    np.testing.assert_array_equal(result.errors.final, whole.errors.final)
    for name in ("scenario.toml", "ensemble.json"):
        assert (tmp_path / "e" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    again = sinssim.ensemble(scenario(), 20, tmp_path / "e", require=wanted, until_decided=True, resume=True)
    assert (again.computed, again.looks, again.verdicts) == (0, result.looks, result.verdicts)


def test_files_of_whole_groups_are_equal_bit_for_bit(tmp_path) -> None:
    far = ["r95(end) <= 1 km", "cep(end) <= 1 km"]  # 0.95^64 is more than half a per cent, 0.95^128 is less
    result = sinssim.ensemble(scenario(), 64, tmp_path / "e", require=far, until_decided=True)
    assert (len(result), result.looks) == (128, (64, 128))
    assert [one.runs for one in result.verdicts] == [128, 64]
    sinssim.ensemble(scenario(), 128, tmp_path / "whole")
    assert files(tmp_path / "e") == files(tmp_path / "whole")


def test_it_ends_undecided_after_sixteen_times_the_first_number() -> None:
    result = sinssim.ensemble(scenario(), 2, require="r95(end) <= 1 km", until_decided=True)
    assert (result.looks, result.verdicts[0].verdict) == ((2, 4, 8, 16, 32), "undecided")
    assert result.verdicts[0].more_runs == 104 - 32


def test_it_ends_where_the_memory_ends(monkeypatch) -> None:
    needed = memory_needed(make_plan(scenario()), 5)
    monkeypatch.setattr(ensemble_run, "machine_memory", lambda: needed / 0.7)
    result = sinssim.ensemble(scenario(), 2, require="r95(end) <= 1 km", until_decided=True)
    assert result.looks == (2, 4)
    assert "8 runs do not fit in the memory" in result.notes[0]


def test_an_interrupted_ensemble_looks_again_as_the_whole_one(limit: str, tmp_path) -> None:
    whole = sinssim.ensemble(scenario(), 20, require=limit, until_decided=True)

    def interrupt(text: str, fraction: float) -> None:
        if "/40 runs" in text:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stop:
        sinssim.ensemble(
            scenario(), 20, tmp_path / "e", require=limit, until_decided=True, progress=interrupt, threads=1
        )
    assert "20 of 40 runs are finished" in stop.value.__notes__[0]
    result = sinssim.ensemble(scenario(), 20, tmp_path / "e", require=limit, until_decided=True, resume=True)
    assert (result.looks, result.verdicts) == (whole.looks, whole.verdicts)


def test_an_interrupted_ensemble_judges_its_finished_runs(tmp_path, monkeypatch) -> None:
    """As one look at these runs; with several looks, at their smaller probability of error."""
    written = []
    monkeypatch.setattr(ensemble_run, "write_ensemble", lambda result, folder, status: written.append((result, status)))

    def interrupt(text: str, fraction: float) -> None:
        if fraction > 0.6:
            raise KeyboardInterrupt

    texts = ["r95(end) <= 1 km", "position_north(end) <= 0.001 m"]
    for until_decided in (False, True):
        place = tmp_path / str(until_decided)
        with pytest.raises(KeyboardInterrupt):
            sinssim.ensemble(
                scenario(), 150, place, require=texts, until_decided=until_decided, progress=interrupt, threads=1
            )
        result, status = written.pop()
        assert (status, len(result)) == ("interrupted", 64)
        # 64 runs are too few to show R95, and far more than enough to refute a millimetre
        assert [one.verdict for one in result.verdicts] == ["undecided", "not met"]
        assert result.verdicts[0].more_runs == (40 if until_decided else 8)
        assert "tested with the 64 finished runs" in result.notes[0]
        assert result.looks == ()


def test_an_ensemble_with_the_epoch_of_a_requirement_is_continued(tmp_path) -> None:
    """With the requirement, without it, and with another one at an epoch; not with one at another time."""
    base = scenario(ensemble={"epoch_s": 7.0})
    sinssim.ensemble(base, 5, tmp_path / "e", require="r95(10 s) <= 1 m")
    sinssim.ensemble(base, 7, tmp_path / "e", resume=True)
    result = sinssim.ensemble(base, 9, tmp_path / "e", resume=True, require=["cep(10 s) <= 1 km", "cep(14 s) <= 1 km"])
    assert [one.verdict for one in result.verdicts] == ["met", "met"]
    assert result.time.tolist() == [0.0, 7.0, 10.0, 14.0, 21.0, 28.0, 30.0]
    before = files(tmp_path / "e")
    with pytest.raises(sinssim.InputError, match="no errors at 11 s"):
        sinssim.ensemble(base, 9, tmp_path / "e", resume=True, require="cep(11 s) <= 1 m")
    assert files(tmp_path / "e") == before


def test_rates_do_not_depend_on_the_epochs_of_requirements() -> None:
    base = scenario(ensemble={"epoch_s": 7.0})
    plain, more = sinssim.ensemble(base, 5), sinssim.ensemble(base, 5, require="r95(10 s) <= 1 m")
    np.testing.assert_array_equal(plain.mean_rates, more.mean_rates)
    np.testing.assert_array_equal(plain.errors.position_ned, more.errors.position_ned[:, more.plan.regular])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"require": "r95(3600 s) <= 1852"}, "no unit follows"),
        ({"require": ["speed <= 3 m/s"]}, "'speed'"),
        ({"until_decided": True}, "needs a requirement"),
    ],
)
def test_wrong_requirements(options, words: str, tmp_path) -> None:
    with pytest.raises(sinssim.InputError, match=words):
        sinssim.ensemble(scenario(), 5, tmp_path / "e", **options)
    assert not (tmp_path / "e").exists()


def test_further_times_for_the_table(tmp_path) -> None:
    """They become epochs, with the percentiles of the runs at them; rates by the line leave them out."""
    base = scenario(ensemble={"epoch_s": 1.0})
    plain = sinssim.ensemble(base, 20)
    result = sinssim.ensemble(base, 20, tmp_path / "e", times=[7.25, 12.5])
    rows = summary_of(result)["at"]
    assert [row["time_s"] for row in rows] == [7.25, 12.5]
    k = int(np.flatnonzero(result.elapsed == 7.25)[0])
    north, east, _ = np.moveaxis(result.errors.position_ned[:, k], -1, 0)
    found = r95(np.hypot(north, east))
    assert rows[0]["r95_m"] == {"value": found.value, "low": found.low, "high": found.high, "runs": 20}
    np.testing.assert_array_equal(result.mean_rates, plain.mean_rates)
    with pytest.raises(sinssim.InputError, match=r"--at\): 8\.1 s: the ensemble keeps no errors at 8\.1 s"):
        sinssim.ensemble(base, 20, tmp_path / "e", times=[8.1], resume=True)
    for time in (-1.0, 31.0, float("nan")):
        with pytest.raises(sinssim.InputError, match=r"--at\): .* s lies outside the run, which lasts 30 s"):
            sinssim.ensemble(base, 20, times=[time])
