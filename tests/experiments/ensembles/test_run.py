"""An ensemble's files do not depend on threads, processes, deaths or interruptions; nothing finished is lost."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.experiments.ensembles import ensemble_directory, ensemble_execution, ensemble_plan, ensemble_run
from tests.experiments.ensembles.examples import AIDED, PARKED, files, scenario
from tests.fork import Fork
from tests.slow import slow

LINUX = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="children are found below /proc")


ALIGNING = {**AIDED, "parked": {**AIDED["parked"], "duration_s": 10.0}, "ensemble": {"epoch_s": 5.0}}


@pytest.fixture(autouse=True)
def _small_groups_without_report(monkeypatch) -> None:
    """Files of 16 runs, or of two with a filter; what is written about the runs is tested with the recording."""
    monkeypatch.setattr(ensemble_plan, "_CHUNK", 16)
    for module in (ensemble_plan, ensemble_run):
        monkeypatch.setattr(module, "LONG_CHUNK", 2)
    monkeypatch.setattr(ensemble_run, "write_ensemble", lambda *_: None)


def children() -> list[int]:
    """Return the identifiers of this process's children."""
    found = []
    for task in Path("/proc/self/task").iterdir():
        found += [int(pid) for pid in (task / "children").read_text().split()]
    return found


def test_files_do_not_depend_on_the_number_of_threads(tmp_path) -> None:
    results = [sinssim.ensemble(scenario(), 40, tmp_path / str(n), threads=n) for n in (1, 2, 3)]
    assert files(tmp_path / "1") == files(tmp_path / "2") == files(tmp_path / "3")
    assert sorted(files(tmp_path / "1"))[:3] == [
        "0000000-0000015.parquet", "0000016-0000031.parquet", "0000032-0000039.parquet",
    ]  # fmt: skip
    in_memory = sinssim.ensemble(scenario(), 40)
    assert in_memory.directory is None
    np.testing.assert_array_equal(in_memory.errors.position_ned, results[0].errors.position_ned)


@LINUX
@pytest.mark.parametrize("anew", [False, *slow(True)])
def test_a_process_that_dies_costs_its_group_only(anew: bool, tmp_path, monkeypatch) -> None:
    """Processes give the files of one thread; so do they if one is killed. To start anew takes seconds."""
    if not anew:
        monkeypatch.setattr(ensemble_execution, "_start", lambda: Fork(ensemble_execution.serve))
    base = scenario(ALIGNING)
    sinssim.ensemble(base, 6, tmp_path / "thread", threads=1)
    killed = []

    def kill_one(text: str, fraction: float) -> None:
        if fraction > 0.0 and not killed:
            killed.append(children()[0])
            os.kill(killed[0], signal.SIGKILL)

    sinssim.ensemble(base, 6, tmp_path / "processes", threads=2, progress=kill_one)
    assert len(killed) == 1
    assert files(tmp_path / "thread") == files(tmp_path / "processes")


@LINUX
@pytest.mark.slow
def test_processes_that_die_again_and_again(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(ensemble_execution.Processes, "lives", 1)

    def kill(text: str, fraction: float) -> None:
        if fraction > 0.0:
            for pid in children():
                os.kill(pid, signal.SIGKILL)

    with pytest.raises(sinssim.RunError, match=r"died while computing the runs \d+ to \d+ .* SIGKILL"):
        sinssim.ensemble(scenario(AIDED), 20, tmp_path / "e", threads=2, progress=kill)
    resumed = sinssim.ensemble(scenario(AIDED), 20, tmp_path / "e", threads=1, resume=True)
    assert not resumed.failed.any()


def test_an_interrupted_ensemble_is_continued(tmp_path) -> None:
    sinssim.ensemble(scenario(), 40, tmp_path / "whole", threads=1)

    def interrupt(text: str, fraction: float) -> None:
        if fraction > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stop:
        sinssim.ensemble(scenario(), 40, tmp_path / "part", threads=1, progress=interrupt)
    assert "16 of 40 runs are finished" in stop.value.__notes__[0]
    assert "--resume" in stop.value.__notes__[0]
    result = sinssim.ensemble(scenario(), 40, tmp_path / "part", resume=True)
    assert result.computed == 40 - 16
    assert files(tmp_path / "part") == files(tmp_path / "whole")


def test_more_runs_later(tmp_path) -> None:
    """27 runs, extended to 40, are the 40 runs; the files of runs that exist stay as they are."""
    whole = sinssim.ensemble(scenario(), 40, tmp_path / "whole")
    sinssim.ensemble(scenario(), 27, tmp_path / "e")
    before = files(tmp_path / "e")
    extended = sinssim.ensemble(scenario(), 40, tmp_path / "e", resume=True)
    assert extended.computed == 13
    np.testing.assert_array_equal(extended.errors.final, whole.errors.final)
    assert before.items() <= files(tmp_path / "e").items()
    fewer = sinssim.ensemble(scenario(), 20, tmp_path / "e", resume=True)
    assert len(fewer) == 40
    assert "more than the requested 20" in fewer.notes[0]


def test_progress_is_runs_done_rate_and_time_left(monkeypatch) -> None:
    """Runs that were finished before count as done, but not in the rate; the text fits beside a bar."""
    now, told = [100.0], []
    monkeypatch.setattr(ensemble_run.time, "perf_counter", lambda: now[0])
    counter = ensemble_run._Counter(200, 800, lambda text, fraction: told.append((text, fraction)))
    now[0] += 10.0
    counter.count(range(200, 400), 50)
    counter.count(range(400, 600), 50)
    del told[:1]
    now[0] += 90.0
    counter.count(range(400, 600), 0)  # a process that died
    assert told == [("300/1000 runs, 10/s, 70 s left", 0.3), ("250/1000 runs, 0.5/s, 25 min left", 0.25)]
    million = ensemble_run._Counter(0, 1_000_000, lambda text, fraction: told.append((text, fraction)))
    now[0] += 7.7
    million.count(range(999_000), 999_000)
    assert len(told[-1][0]) <= 40


def test_groups_of_missing_runs() -> None:
    assert ensemble_directory.missing([], 10, 4) == [range(4), range(4, 8), range(8, 10)]
    assert ensemble_directory.missing([range(4), range(8, 10)], 13, 4) == [range(4, 8), range(10, 12), range(12, 13)]
    assert ensemble_directory.missing([range(20)], 10, 4) == []


@pytest.mark.parametrize("damage", ["one byte", "another ensemble", *slow("truncated", "empty")])
def test_a_damaged_file_is_named_and_computed_again(damage: str, tmp_path) -> None:
    sinssim.ensemble(scenario(), 18, tmp_path / "e")
    whole, file = files(tmp_path / "e"), tmp_path / "e" / "runs" / "0000000-0000015.parquet"
    content = bytearray(file.read_bytes())
    if damage == "one byte":
        content[len(content) // 2] ^= 0x10
    elif damage == "another ensemble":
        sinssim.ensemble(scenario(seed=99), 18, tmp_path / "other")
        content = bytearray((tmp_path / "other" / "runs" / file.name).read_bytes())
    file.write_bytes(content[: {"truncated": len(content) // 2, "empty": 0}.get(damage, len(content))])
    said: list[str] = []
    result = sinssim.ensemble(scenario(), 18, tmp_path / "e", resume=True, say=said.append)
    assert result.computed == 16
    assert str(file) in said[0]
    assert "runs 0 to 15 are computed again" in said[0]
    assert files(tmp_path / "e") == whole


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seed": 6}, "has the seed 5, not 6"),
        ({"parked": {**PARKED["parked"], "roll_deg": 2.0}}, "parked.roll_deg was 1.0, now 2.0"),
        ({"ensemble": {"solution": "quaternion"}}, 'ensemble.solution was "euler", now "quaternion"'),
        ({"ensemble": {"epoch_s": 5.0}}, "other epochs"),
    ],
)
def test_another_ensemble_is_not_continued(changes: dict[str, Any], words: str, tmp_path) -> None:
    sinssim.ensemble(scenario(), 5, tmp_path / "e")
    before = files(tmp_path / "e")
    with pytest.raises(sinssim.InputError, match=words):
        sinssim.ensemble(scenario(**changes), 5, tmp_path / "e", resume=True)
    assert files(tmp_path / "e") == before


def test_another_version_is_named(tmp_path) -> None:
    sinssim.ensemble(scenario(), 5, tmp_path / "e")
    manifest = tmp_path / "e" / "ensemble.json"
    contents = json.loads(manifest.read_text())
    contents["versions"]["numpy"] = "1.0.0"
    manifest.write_text(json.dumps(contents))
    with pytest.raises(sinssim.InputError, match=r"computed by numpy 1\.0\.0 instead of"):
        sinssim.ensemble(scenario(), 5, tmp_path / "e", resume=True)


def test_a_folder_that_holds_something_else(tmp_path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    for options in ({}, {"resume": True}, {"overwrite": True}):
        with pytest.raises(sinssim.InputError, match="holds no ensemble"):
            sinssim.ensemble(scenario(), 5, tmp_path, **options)
    with pytest.raises(sinssim.InputError, match="is a file"):
        sinssim.ensemble(scenario(), 5, tmp_path / "mine.txt")
    assert [file.name for file in tmp_path.iterdir()] == ["mine.txt"]


def test_an_ensemble_is_replaced_only_on_request(tmp_path) -> None:
    sinssim.ensemble(scenario(), 18, tmp_path / "e")
    (tmp_path / "e" / "notes.txt").write_text("mine")
    with pytest.raises(sinssim.InputError, match="already holds an ensemble"):
        sinssim.ensemble(scenario(seed=6), 5, tmp_path / "e")
    result = sinssim.ensemble(scenario(seed=6), 5, tmp_path / "e", overwrite=True)
    assert len(result) == 5
    assert (tmp_path / "e" / "notes.txt").read_text() == "mine"
    assert set(files(tmp_path / "e")) == {"ensemble.json", "0000000-0000004.parquet"}


def test_a_directory_in_use(tmp_path) -> None:
    from sinssim.system.files import try_hold

    sinssim.ensemble(scenario(), 5, tmp_path / "e")
    lock = try_hold(tmp_path / "e")
    assert lock is not None
    try:
        with pytest.raises(sinssim.InputError, match="another process"):
            sinssim.ensemble(scenario(), 5, tmp_path / "e", resume=True)
    finally:
        os.close(lock)


def test_a_full_disk_loses_nothing_that_is_finished(tmp_path, monkeypatch) -> None:
    write, written = ensemble_execution.write_chunk, []

    def full(*arguments: Any) -> Path:
        if written:
            raise OSError(28, "No space left on device")
        written.append(1)
        return write(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(ensemble_execution, "write_chunk", full)
        with pytest.raises(sinssim.InputError, match=r"could not be written .*No space left .*MB are free") as error:
            sinssim.ensemble(scenario(), 40, tmp_path / "e", threads=1)
    assert "16 of 40 runs are finished" in error.value.__notes__[0]
    result = sinssim.ensemble(scenario(), 40, tmp_path / "e", resume=True)
    assert result.computed == 24


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"runs": 0}, "runs = 0"),
        ({"runs": -3}, "runs = -3"),
        ({"runs": 2.5}, r"runs = 2\.5"),
        ({"runs": True}, "runs = True"),
        ({"runs": "many"}, "runs = 'many'"),
        ({"threads": 0}, "threads = 0"),
        ({"workers": -1}, "workers = -1"),
        ({"threads": 2, "workers": 2}, "threads and workers exclude each other"),
        ({"resume": True}, "need the directory"),
        ({"resume": True, "overwrite": True, "directory": "e"}, "resume and overwrite exclude each other"),
    ],
)
def test_wrong_options(options: dict[str, Any], words: str) -> None:
    with pytest.raises(sinssim.InputError, match=words):
        sinssim.ensemble(scenario(), **{"runs": 5, **options})


def test_every_run_fails(tmp_path) -> None:
    vary = ({"type": "uniform", "key": "parked.roll_deg", "low": 0.0, "high": 1.0},)
    base = scenario(ensemble={"vary": vary})
    # the scenario is valid, and the values that its runs draw are not
    broken = base.model_copy(update={"ensemble": base.ensemble.model_copy(update={"vary": (_beyond(base),)})})
    with pytest.raises(sinssim.RunError, match=r"all 5 runs of the ensemble failed; the first one: .*parked\.roll_deg"):
        sinssim.ensemble(broken, 5, tmp_path / "e")


def _beyond(base: sinssim.Scenario) -> Any:
    return base.ensemble.vary[0].model_copy(update={"low": 1000.0, "high": 2000.0})  # type: ignore[union-attr]


def _killed_and_resumed(
    tmp_path: Path, kills: int, runs: int, start: Callable[[Path], Fork | subprocess.Popen[bytes]]
) -> None:
    """Kill an ensemble at random moments after its start, continue it each time, and compare with a whole one."""
    rng, place = random.Random(3), tmp_path / "killed"
    for _ in range(kills):
        process = start(place)
        end = time.monotonic() + 60.0
        have = len(list((place / "runs").glob("*"))) if (place / "runs").is_dir() else 0
        while process.poll() is None and time.monotonic() < end:
            if (place / "runs").is_dir() and len(list((place / "runs").glob("*"))) > have:
                break
            time.sleep(0.005)
        time.sleep(rng.uniform(0.0, 0.2))
        process.kill()
        process.wait()
    sinssim.ensemble(scenario(), runs, place, resume=True)
    sinssim.ensemble(scenario(), runs, tmp_path / "whole")
    assert files(place) == files(tmp_path / "whole")


def test_killed_once_and_resumed(tmp_path) -> None:
    def start(place: Path) -> Fork:
        return Fork(lambda: sinssim.ensemble(scenario(), 60, place, threads=1))

    _killed_and_resumed(tmp_path, 1, 60, start)


@pytest.mark.slow
def test_killed_at_five_random_moments_and_resumed(tmp_path, monkeypatch) -> None:
    monkeypatch.undo()  # groups are as large as those of the command
    monkeypatch.setattr(ensemble_run, "write_ensemble", lambda *_: None)
    file = tmp_path / "standing.toml"
    file.write_text(scenario().to_toml(), encoding="utf-8")
    command = [sys.executable, "-m", "sinssim", "ensemble", str(file), "--runs", "400", "-q", "--threads", "2"]

    def start(place: Path) -> subprocess.Popen[bytes]:
        return subprocess.Popen([*command, "-o", str(place), "--resume"], stderr=subprocess.DEVNULL)

    _killed_and_resumed(tmp_path, 5, 400, start)
