"""Ensembles on a dask cluster: the same files as by threads; a scheduler that is not there; workers that die."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

import sinssim
from sinssim.experiments.ensembles import ensemble_execution, ensemble_run
from sinssim.experiments.ensembles.ensemble_execution import Group
from sinssim.experiments.ensembles.ensemble_plan import make_plan
from tests.experiments.ensembles.examples import files, scenario


def _ensemble(tmp_path: Path, name: str, *options: str) -> Path:
    """Run an ensemble in a process of its own, because dask's warnings are none of ours."""
    file = tmp_path / "standing.toml"
    file.write_text(scenario().to_toml(), encoding="utf-8")
    place = tmp_path / name
    command = [sys.executable, "-m", "sinssim", "ensemble", str(file), "--runs", "150", "-q", "-o", str(place)]
    subprocess.run([*command, *options], check=True, stderr=subprocess.PIPE, timeout=300)
    return place


_WITHOUT_REPORT = """
import sys
import sinssim
from sinssim.experiments.ensembles import ensemble_run

if __name__ == "__main__":  # the workers load this file, too
    ensemble_run.write_ensemble = lambda *_: None
    sinssim.ensemble(sinssim.load_scenario(sys.argv[1]), 20, sys.argv[2], workers=1)
"""


def test_a_task_writes_the_file_of_a_thread(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(ensemble_run, "write_ensemble", lambda *_: None)
    sinssim.ensemble(scenario(), 100, tmp_path / "threads", threads=1)
    folder = tmp_path / "runs"
    folder.mkdir()
    ensemble_execution.compute_task(Group(make_plan(scenario()), range(64, 100), folder))
    name = "0000064-0000099.parquet"
    assert (folder / name).read_bytes() == (tmp_path / "threads" / "runs" / name).read_bytes()


def test_a_worker_that_does_not_see_the_folder(tmp_path) -> None:
    with pytest.raises(sinssim.InputError, match="does not see the folder"):
        ensemble_execution.compute_task(Group(make_plan(scenario()), range(4), tmp_path / "none"))


def test_a_scheduler_that_cannot_be_reached() -> None:
    def connect(address: str, timeout: float, set_as_default: bool) -> None:
        raise OSError(f"Timed out trying to connect to {address}")

    with pytest.raises(sinssim.InputError, match=r"tcp://10\.0\.0\.9:8786 cannot be reached within 10 s"):
        ensemble_execution._client(connect, "tcp://10.0.0.9:8786")


@pytest.mark.slow
def test_a_real_scheduler_that_is_not_there(tmp_path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(subprocess.CalledProcessError) as error:
        _ensemble(tmp_path, "e", "--scheduler", f"tcp://127.0.0.1:{port}")
    assert error.value.returncode == 2
    assert b"cannot be reached" in error.value.stderr


@pytest.mark.filterwarnings("ignore")  # dask's warnings are none of ours
def test_a_scheduler_writes_the_files_of_a_thread(tmp_path, monkeypatch) -> None:
    """A cluster in this process, which stays when the ensemble is done."""
    from distributed import LocalCluster

    monkeypatch.setattr(ensemble_run, "write_ensemble", lambda *_: None)
    sinssim.ensemble(scenario(), 20, tmp_path / "thread", threads=1)
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster:
        sinssim.ensemble(scenario(), 20, tmp_path / "cluster", scheduler=cluster.scheduler_address)
        assert cluster.scheduler.workers
    assert files(tmp_path / "cluster") == files(tmp_path / "thread")


@pytest.mark.slow
def test_a_cluster_writes_the_files_of_a_thread(tmp_path, monkeypatch) -> None:
    """A process with a cluster of one worker, which it stops; the report is tested elsewhere."""
    monkeypatch.setattr(ensemble_run, "write_ensemble", lambda *_: None)
    sinssim.ensemble(scenario(), 20, tmp_path / "thread", threads=1)
    file, program = tmp_path / "standing.toml", tmp_path / "program.py"
    file.write_text(scenario().to_toml(), encoding="utf-8")
    program.write_text(_WITHOUT_REPORT, encoding="utf-8")
    command = [sys.executable, str(program), str(file), str(tmp_path / "cluster")]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, start_new_session=True)
    told = process.communicate(timeout=120)[1].decode()
    assert process.returncode == 0, told
    assert files(tmp_path / "cluster") == files(tmp_path / "thread")
    assert _ends(process.pid), "a process of the cluster is left"


@pytest.mark.slow
def test_files_do_not_depend_on_workers(tmp_path) -> None:
    sinssim.ensemble(scenario(), 150, tmp_path / "threads", threads=1)
    for workers in ("1", "2"):
        place = _ensemble(tmp_path, f"workers {workers}", "--workers", workers)
        assert files(place) == files(tmp_path / "threads")


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="processes are found below /proc")
def test_a_worker_that_dies_costs_its_group_only(tmp_path) -> None:
    """A worker of a cluster is killed while it computes; its nanny starts another one."""
    sinssim.ensemble(scenario(), 1500, tmp_path / "threads", threads=1)
    file, place = tmp_path / "standing.toml", tmp_path / "cluster"
    file.write_text(scenario().to_toml(), encoding="utf-8")
    command = [sys.executable, "-m", "sinssim", "ensemble", str(file), "--runs", "1500", "-q", "-o", str(place)]
    process = subprocess.Popen([*command, "--workers", "2"], stderr=subprocess.DEVNULL)
    end = time.monotonic() + 120.0
    while process.poll() is None and time.monotonic() < end and not list((place / "runs").glob("*.parquet")):
        time.sleep(0.005)
    workers = [pid for pid in _descendants(process.pid) if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
    os.kill(workers[-1], signal.SIGKILL)
    assert process.wait(timeout=300) == 0
    assert files(place) == files(tmp_path / "threads")


def _ends(session: int) -> bool:
    """Return whether no process of a session is left, or at most a few seconds."""
    for _ in range(100):
        try:
            os.killpg(session, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


def _descendants(pid: int) -> list[int]:
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text().split():
            found += [int(child), *_descendants(int(child))]
    return found
