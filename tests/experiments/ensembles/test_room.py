"""What an ensemble needs of memory and disk, and what is refused beforehand."""

from __future__ import annotations

import re
from collections import namedtuple
from dataclasses import replace

import numpy as np
import pytest

import sinssim
from sinssim.experiments.ensembles import ensemble_errors, ensemble_run
from sinssim.experiments.ensembles.ensemble_plan import make_plan
from tests.experiments.ensembles.examples import scenario

Usage = namedtuple("Usage", "total used free")


@pytest.fixture(autouse=True)
def _without_report(monkeypatch) -> None:
    """What is written about the runs is tested with the recording; here it would only take time."""
    monkeypatch.setattr(ensemble_run, "write_ensemble", lambda *_: None)


def test_more_than_the_memory_holds(monkeypatch) -> None:
    """Refused before anything runs; the interval of the epochs that is proposed is enough."""
    monkeypatch.setattr(ensemble_run, "machine_memory", lambda: 1.5e6)
    with pytest.raises(sinssim.InputError, match=r"need 20\.2 MB .* Compute fewer runs, or keep .*epoch_s") as error:
        sinssim.ensemble(scenario(), 100)
    step = float(re.findall(r"epoch_s = ([\d.]+),", str(error.value))[0])
    assert len(sinssim.ensemble(scenario(ensemble={"epoch_s": step}), 100)) == 100


def test_the_memory_hardly_depends_on_the_number_of_runs() -> None:
    plan = replace(make_plan(scenario()), epochs=np.arange(601.0))
    few, many = ensemble_run.memory_needed(plan, 1000), ensemble_run.memory_needed(plan, 100_000)
    assert few < many < 0.15e9
    assert ensemble_run.memory_needed(plan, 10**7) > 2e9  # what is kept of each run is 300 bytes
    assert ensemble_run.memory_needed(replace(plan, epochs=np.arange(100_000.0)), 1000) > 1e9  # a file of 64 runs


def test_more_than_the_disk_holds(tmp_path, monkeypatch) -> None:
    """Refused before anything runs, with a folder or without; nothing is left that would need --resume."""
    monkeypatch.setattr(ensemble_run.shutil, "disk_usage", lambda folder: Usage(1e9, 1e9, 1e6))
    for place in (None, tmp_path / "e"):
        with pytest.raises(sinssim.InputError, match=r"150 runs at 601 epochs need at least 3\.25 MB more on the"):
            sinssim.ensemble(scenario(), 150, place)
    assert list(tmp_path.iterdir()) == []
    monkeypatch.undo()
    assert len(sinssim.ensemble(scenario(), 20, tmp_path / "e")) == 20


def test_finished_runs_need_no_more_disk_but_those_of_a_file_do() -> None:
    plan = make_plan(scenario())
    whole = 8 * 9 * len(plan.epochs)
    assert ensemble_run.disk_needed(plan, 100, 40) == 0.5 * 60 * whole
    many = ensemble_errors.IN_MEMORY // whole + 1
    assert ensemble_run.disk_needed(plan, many, many) == many * whole
