"""Worker processes are started early, are sent the motion that runs share, and never outlive the ensemble."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy as np
import pytest

import sinssim
from sinssim.experiments.ensembles import ensemble_execution
from sinssim.experiments.ensembles.ensemble_plan import TruthCache, make_plan
from tests.experiments.ensembles.examples import AIDED, scenario
from tests.experiments.ensembles.test_run import LINUX, children
from tests.fork import Fork


def test_the_motion_that_runs_share_is_sent() -> None:
    """A process finds the same increments and states, bit for bit, for the scenario of each run."""
    truths = TruthCache()
    plan = make_plan(scenario(AIDED), truths)
    told, shared = pickle.loads(ensemble_execution._told(plan, truths))
    there, own = TruthCache(), truths.of(plan.scenario)
    there.keep(told.scenario, shared)
    assert there.of(sinssim.experiments.ensembles.ensemble_plan.member(plan.scenario, 3).scenario) is shared
    np.testing.assert_array_equal(shared.ideal.dvel, own.ideal.dvel)
    for name, value in vars(own.state).items():
        np.testing.assert_array_equal(getattr(shared.state, name), value)
    time = np.linspace(own.trajectory.start, own.trajectory.end, 7)
    np.testing.assert_array_equal(shared.trajectory.state(time).q_nb, own.trajectory.state(time).q_nb)


def test_motions_of_their_own_are_not_sent(monkeypatch) -> None:
    """Neither if each run varies its motion, nor if the motion cannot be sent."""
    vary = ({"type": "uniform", "key": "parked.heading_deg", "low": 0.0, "high": 360.0},)
    truths = TruthCache()
    plan = make_plan(scenario(AIDED, ensemble={"vary": vary}), truths)
    assert pickle.loads(ensemble_execution._told(plan, truths))[1] is None
    plan = make_plan(scenario(AIDED), truths)
    object.__setattr__(truths.of(plan.scenario), "trajectory", lambda: None)
    assert pickle.loads(ensemble_execution._told(plan, truths))[1] is None


@pytest.mark.parametrize("part", [0.0, 0.5, 1.0])
def test_a_process_whose_parent_is_killed_ends_without_a_word(part: float) -> None:
    """The pipe breaks before, within, or after what the process is told."""
    truths = TruthCache()
    task = ensemble_execution._told(make_plan(scenario(AIDED), truths), truths)
    process = Fork(ensemble_execution.serve)
    process.stdin.write(task[: int(part * len(task))])
    process.stdin.close()
    assert (process.wait(), process.stdout.read(), process.stderr()) == (0, b"", "")


@pytest.mark.slow
def test_a_process_that_starts_anew_ends_so_too() -> None:
    program = "from sinssim.experiments.ensembles.ensemble_execution import serve; serve()"
    ended = subprocess.run([sys.executable, "-c", program], input=b"", capture_output=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, b"", b"")


@LINUX
def test_no_process_is_left() -> None:
    """Processes without work end with the ensemble, also if its plan is refused."""
    before = children()
    with ensemble_execution.Processes(2, TruthCache(), early=1) as pool:
        assert len(children()) == len(before) + 1
        taken = pool.take()
        assert taken.poll() is None
    taken.kill()
    taken.wait()
    refused = scenario(AIDED, ensemble={"epoch_s": 1e6})
    with pytest.raises(sinssim.InputError, match="epoch_s"):
        sinssim.ensemble(refused, 20, threads=2)
    assert children() == before
