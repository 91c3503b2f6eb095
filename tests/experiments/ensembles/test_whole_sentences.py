"""What is said of ensembles that continue, stop or cannot continue, by stand-ins for their files."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError, RunError
from sinssim.experiments import experiment_directory
from sinssim.experiments.ensembles import ensemble_directory, ensemble_run

VERSIONS = dict.fromkeys(experiment_directory.software(), "2.0")
CONTENTS = {"imu": {"rate_hz": 50.0}, "vary": [{"a": 1}, {"a": 2}]}


def plan(**more: Any) -> Any:
    return SimpleNamespace(**{"digest": "now", "contents": CONTENTS, "epochs": np.array([0.0, 1.5, 4.0]),
                              "scenario": SimpleNamespace(seed=42), "flight": "key", "chunk": 4, **more})  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"versions": {**VERSIONS, "sinssim": "1.0"}},
         f"was computed by {next(iter(experiment_directory.software()))} 1.0 instead of 2.0"),
        ({"seed": 41}, "has the seed 41, not 42"),
        ({"contents": {"imu": {"rate_hz": 100.0}, "vary": [{"a": 1}, {"a": 2}]}},
         "is of another scenario: imu.rate_hz was 100.0, now 50.0"),
        ({"contents": {**CONTENTS, "vary": [{"a": 1}, {"a": 3}]}}, "is of another scenario: vary.2.a was 3, now 2"),
        ({"contents": {**CONTENTS, "wind": {"x": 1}}}, 'is of another scenario: wind was {"x": 1}, now left out'),
        ({"contents": {**CONTENTS, "vary": [{"a": 1}]}},
         'is of another scenario: vary was [{"a": 1}], now [{"a": 1}, {"a": 2}]'),
        ({"epochs_s": [0.0, 4.0]}, "keeps errors at 2 other epochs (ensemble.epoch_s)"),
        ({"flight": "other"}, "is of another flight: the aircraft, or the code that flies it, has changed since"),
        ({}, "has another format"),
    ],
)  # fmt: skip
def test_why_an_ensemble_cannot_continue(monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any], said: str) -> None:
    monkeypatch.setattr(experiment_directory, "versions", lambda: VERSIONS)
    found = {"digest": "then", "versions": VERSIONS, "seed": 42, "contents": CONTENTS, "epochs_s": [0.0, 1.5, 4.0],
             "flight": "key"}  # fmt: skip
    difference = partial(ensemble_directory.EnsembleDirectory.difference, SimpleNamespace(plan=plan()))
    assert difference({**found, **changes}) == said
    assert difference({**found, "digest": "now"}) == ""


def test_groups_of_missing_runs() -> None:
    """Up to multiples of four; runs of files are left out."""
    assert ensemble_directory.missing([range(2, 5), range(9, 10)], 14, 4) == [
        range(2), range(5, 8), range(8, 9), range(10, 12), range(12, 14),
    ]  # fmt: skip


def counted(folder: Path, *groups: range) -> Any:
    made = SimpleNamespace(path=folder, folder=folder / "runs", plan=plan(), finished=lambda say=None: list(groups),
                           load=lambda groups: "errors", free=lambda: 234.4)  # fmt: skip
    made.writing = partial(experiment_directory.Store.writing, made)
    return made


def ensemble(folder: Any, hands: Any = None, say: Any = None, looks: Any = None) -> ensemble_run._Ensemble:
    return ensemble_run._Ensemble(folder, hands, lambda text, share: None, say, (5.0,), looks=looks)


def test_an_ensemble_that_stops_says_what_there_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Seven of the 40 runs of the second look; an interruption and a failure differ in the report."""
    written: list[Any] = []
    monkeypatch.setattr(
        ensemble_run, "write_ensemble", lambda result, folder, status: written.append((result.notes, status))
    )

    class Result(SimpleNamespace):
        def __len__(self) -> int:
            return 7

    monkeypatch.setattr(
        ensemble_run, "EnsembleResult", lambda plan, errors, path, times, media: Result(errors=errors, notes=[])
    )
    looks: Any = SimpleNamespace(numbers=(20, 40, 80), done=[20], verdicts=["old"], so_far=lambda result: ("so far",))
    stopped = ensemble(counted(tmp_path, range(4), range(6, 9)), looks=looks)
    assert stopped.finished == "7 of 40 runs"
    for status in ("interrupted", "failed"):
        stopped.conclude(status)
        stopped.write(tmp_path)
        assert written.pop() == (
            ["The requirements are tested with the 7 finished runs; --resume tests them with all runs."], status,
        )  # fmt: skip
        assert (stopped.result.errors, stopped.result.verdicts) == ("errors", ("so far",))
    looks.done, looks.verdicts = [20, 40, 80], []
    stopped = ensemble(counted(tmp_path, range(4)), looks=looks)
    assert stopped.finished == "4 of 80 runs"
    stopped.conclude("failed")
    stopped.write(tmp_path)
    assert written.pop() == ([], "failed")
    assert ensemble(counted(tmp_path), looks=looks).finished == ""


def test_runs_that_are_there_already(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Of twelve wanted runs, five are computed; the directory's further files count as well."""
    asked: list[Any] = []
    said: list[str] = []
    monkeypatch.setattr(
        ensemble_run, "check_disk", lambda plan, count, finished, path: asked.append((count, finished, path))
    )
    hands = SimpleNamespace(compute=lambda groups, count: asked.append([group.runs for group in groups]))

    class Result(SimpleNamespace):
        def __len__(self) -> int:
            return 14

    monkeypatch.setattr(
        ensemble_run, "EnsembleResult", lambda plan, errors, path, times, media, seconds, computed, notes: Result(
        errors=errors, path=path, computed=computed, notes=notes, times=times))  # fmt: skip
    looks = iter(([range(3), range(8, 12)], [range(12), range(12, 14)]))
    folder = counted(tmp_path)
    folder.finished = lambda say: next(looks)
    result: Any = ensemble(folder, hands, said.append).continued(12)
    assert asked == [(12, 7, tmp_path), [range(3, 4), range(4, 8)]]
    assert (result.computed, result.times, result.errors, result.path) == (5, (5.0,), "errors", tmp_path)
    assert said == result.notes == [
        "The directory contains 14 runs, more than the requested 12; all of them are used."
    ]  # fmt: skip
    looks = iter(([range(3)], [range(3)]))
    with pytest.raises(RunError, match=rf"^files in {re.escape(str(tmp_path / 'runs'))} changed while they were writ"):
        ensemble(folder, hands, said.append).continued(12)


def test_progress_of_the_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five of 20 were there; six of the others in 4 s: nine more take 6 s."""
    now = [100.0]
    monkeypatch.setattr(ensemble_run.time, "perf_counter", lambda: now[0])
    told: list[tuple[str, float]] = []
    counter = ensemble_run._Counter(5, 15, lambda text, share: told.append((text, share)))
    now[0] = 104.0
    counter.count(range(5, 10), 2)
    counter.count(range(10, 20), 4)
    assert told[-1] == (f"11/20 runs, 1.5/s, {ensemble_run.duration_text(6.0)} left", pytest.approx(0.55))


def test_ways_to_compute(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Workers of one kind stay for the next ensemble; those of another take their place, and after an error new ones.

    A cluster takes every ensemble.
    """
    used: list[Any] = []
    stopped: list[Any] = []

    def made(*about: Any) -> SimpleNamespace:
        return SimpleNamespace(about=about, stop=lambda: stopped.append(about))

    monkeypatch.setattr(ensemble_run, "Cluster", lambda *given: made("cluster", *given))
    monkeypatch.setattr(ensemble_run, "Processes", lambda number, *given: made("processes", number))
    monkeypatch.setattr(ensemble_run, "Threads", lambda number, *given: made("threads", number))
    monkeypatch.setattr(ensemble_run, "runs_at_a_time", lambda plan: 7)
    monkeypatch.setattr(ensemble_run, "work_through", lambda groups, executor, *_: used.append(executor))
    counter = ensemble_run._Counter(0, 9, lambda text, share: None)

    def compute(hands: ensemble_run.Workers, *cases: tuple[bool, int]) -> list[Any]:
        used.clear()
        for filtered, groups in cases:
            of = ensemble_run.Group(plan(filtered=filtered), range(3), tmp_path)
            hands.compute([of] * groups, counter)
        return [executor.about for executor in used]

    with ensemble_run.Workers(3) as hands:
        assert compute(hands, (False, 2), (True, 1), (True, 2), (True, 3)) == [
            ("threads", 3), ("threads", 3), ("processes", 3), ("processes", 3),
        ]  # fmt: skip
        assert used[0] is used[1] is not used[2] is used[3]
        assert stopped == [("threads", 3)]
    assert stopped == [("threads", 3), ("processes", 3)]
    assert compute(ensemble_run.Workers(), (False, 2)) == [("threads", 7)]
    for given in ((None, 5, None), (None, None, "tcp://x")):
        assert compute(ensemble_run.Workers(*given), (True, 2), (False, 1)) == [("cluster", *given[1:])] * 2
        assert used[0] is used[1]

    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(ensemble_run, "work_through", full)
    monkeypatch.setattr(ensemble_run, "check_disk", lambda *_: None)
    folder, hands = counted(tmp_path), ensemble_run.Workers(3)
    folder.plan = plan(filtered=False)
    said = rf"^the runs of the ensemble could not be written to {re.escape(str(tmp_path))}: No space left on device " \
           r"\(234 MB are free\)\.$"  # fmt: skip
    stopped.clear()
    with pytest.raises(InputError, match=said):
        ensemble(folder, hands).continued(5)
    assert stopped == [("threads", 3)]


def test_memory_and_disk_in_numbers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Of 80 epochs over 240 s, 20 fit exactly, which have 19 intervals: 240 s/19 = 12.6 s."""
    monkeypatch.setattr(ensemble_run, "_memory", lambda: 2e9)
    monkeypatch.setattr(ensemble_run, "_disk", lambda folder: 3.25e6)
    monkeypatch.setattr(ensemble_run, "memory_needed", lambda plan, runs, epochs=None: 1e8 * (epochs or 80))
    monkeypatch.setattr(ensemble_run, "disk_needed", lambda plan, runs, finished: 1e6 * (runs - finished))
    own = plan(epochs=np.linspace(10.0, 250.0, 80), start=10.0)
    with pytest.raises(InputError) as refused:
        ensemble_run.check_memory(own, 500)
    assert str(refused.value) == (
        "runs = 500: the statistics of 500 runs at 80 epochs need 8 GB of memory, and 2 GB can be used on this "
        "machine. Compute fewer runs, or keep fewer epochs: ensemble.epoch_s = 12.6, for example."
    )
    with pytest.raises(InputError) as refused:
        ensemble_run.check_disk(own, 9, 5, tmp_path)
    assert str(refused.value) == (
        f"runs = 9: the errors of 9 runs at 80 epochs need at least 4 MB more on the disk, and 3.25 MB are free in "
        f"{tmp_path}. Compute fewer runs, keep fewer epochs with a larger ensemble.epoch_s, or give a folder on a "
        "larger disk with -o."
    )
    ensemble_run.check_disk(own, 9, 6, tmp_path)
    assert ensemble_run.short_of(own, 9, 6, tmp_path) == "in the memory"
    monkeypatch.setattr(ensemble_run, "_memory", lambda: 8e9)
    ensemble_run.check_memory(own, 500)
    assert [ensemble_run.short_of(own, 9, there, tmp_path) for there in (5, 6)] == ["on the disk", ""]
