"""What navigators of others state, in a table from entries by hand, and in the streams."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.exhibits import Sentence, Table
from sinssim.experiments.run.parts import further_solutions
from sinssim.experiments.run.parts.further_solutions import Navigators
from sinssim.simulation.navigator_protocol import ForeignSolution


def solution(time: list[float], **stated: Any) -> ForeignSolution:
    none = np.zeros(len(time))
    return ForeignSolution(
        np.array(time), none, none, none, np.zeros((len(time), 3)), np.zeros((len(time), 4)), none, "mine", **stated
    )


def test_the_table() -> None:
    part = Navigators(SimpleNamespace(scenario=None))  # type: ignore[arg-type]
    shares = {"position": 0.75, "velocity": 0.5, "attitude": 0.25}
    stated = {"solutions": 1201, "interval_s": 0.05, "within_sigma": shares, "status": {"1": 3, "2": 5},
              "started": "once", "last_message": "bye"}  # fmt: skip
    part.enter({"mine": stated})
    table, normal, last = part.exhibits()
    assert isinstance(table, Table)
    assert isinstance(normal, Sentence)
    assert isinstance(last, Sentence)
    columns, heads, rows = table.shown("page")
    assert [column.group for column in columns] == [*[""] * 3, *["errors within its 1σ"] * 3, *[""] * 2]
    assert [", ".join(filter(None, head)) for head in heads] == [
        "navigator", "solutions", "every, s", "position", "velocity", "attitude", "status", "started",
    ]  # fmt: skip
    assert rows == [["mine", "1201", "0.05000", "0.750", "0.500", "0.250", "1 × 3, 2 × 5", "once"]]
    assert normal.text == "Of normal errors a share of 0.683 is within 1σ."
    assert last.text == "mine said last: bye"


def test_the_share_within_sigma_and_the_status() -> None:
    """Of six errors of position three do not exceed 1σ; nothing is known of the velocity."""
    sigma = np.full((2, 9), np.nan)
    sigma[:, :3] = 2.0
    errors = SimpleNamespace(position_ned=np.array([[1.0, -2.0, 3.0], [-5.0, 4.0, 0.0]]), velocity_ned=np.zeros((2, 3)),
                             attitude=np.full((2, 3), np.nan))  # fmt: skip
    run: Any = SimpleNamespace(axes="north", errors={"mine": errors})
    assert Navigators(run)._within("mine", sigma) == {"position": 0.5}
    assert further_solutions._counts(np.array([2.0, 1.0, 2.0, np.nan])) == {"1": 1, "2": 2}


def test_the_entry_and_the_streams() -> None:
    """The median of 0.1, 0.2 and 0.6 s; the last line that was said; a library, or the words of a command."""
    sigma, biases = np.arange(36.0).reshape(4, 9), np.arange(24.0).reshape(4, 6)
    mine = solution([5.0, 5.1, 5.3, 5.9], sigma=sigma, biases=biases, status=np.array([3.0, 1.0, 3.0, 3.0]),
                    messages="one\ntwo\n\n")  # fmt: skip
    navigators = [SimpleNamespace(name="mine", library=None, command=("python", "-u")),
                  SimpleNamespace(name="other", library="x.so", command=None)]  # fmt: skip
    once = solution([7.0])
    run: Any = SimpleNamespace(scenario=SimpleNamespace(navigator=navigators), axes="body",
                               solutions={"euler": None, "mine": mine, "other": once})  # fmt: skip
    part = Navigators(run)
    numbers = part.numbers()
    assert numbers["mine"] == {"started": "python -u", "solutions": 4, "interval_s": pytest.approx(0.2),
                               "within_sigma": None, "status": {"1": 1, "3": 3}, "last_message": "two"}  # fmt: skip
    assert (numbers["other"]["started"], numbers["other"]["last_message"]) == ("x.so", "")
    assert np.isnan(numbers["other"]["interval_s"])
    (stream,) = part.streams()
    assert stream.name == "navigator_mine"
    columns = {name: v.values[:].T[k].tolist() for v in stream.vectors for k, name in enumerate(v.columns)}
    assert list(columns) == [
        *(f"sigma_{what}_{axis}_{unit}" for what, unit in (("position", "m"), ("velocity", "mps"), ("phi", "rad"))
          for axis in "ned"),
        *(f"gyro_bias_{axis}_radps" for axis in "xyz"), *(f"accel_bias_{axis}_mps2" for axis in "xyz"), "status",
    ]  # fmt: skip
    assert columns["sigma_velocity_e_mps"] == [4.0, 13.0, 22.0, 31.0]
    assert columns["accel_bias_x_mps2"] == [3.0, 9.0, 15.0, 21.0]
    assert columns["status"] == [3.0, 1.0, 3.0, 3.0]


def test_a_status_of_many_values_is_a_number() -> None:
    """Twenty different values are counted, twenty-one are not."""
    assert further_solutions._counts(np.arange(20.0)) == {str(k): 1 for k in range(20)}
    assert further_solutions._counts(np.arange(21.0)) is None
    assert further_solutions._counts(None) is None


def test_the_shares_of_all_three() -> None:
    """Each 1σ is compared with its own error: two of three, one of three, none."""
    sigma = np.array([[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]])
    errors = SimpleNamespace(position_ned=np.array([[-1.0, 2.5, -3.0]]), velocity_ned=np.array([[5.0, -5.0, 7.0]]),
                             attitude=np.array([[-7.5, 8.5, 9.5]]))  # fmt: skip
    run: Any = SimpleNamespace(axes="north", errors={"mine": errors})
    shares = Navigators(run)._within("mine", sigma)
    assert shares == pytest.approx({"position": 2.0 / 3.0, "velocity": 1.0 / 3.0, "attitude": 0.0})
    assert Navigators(run)._within("mine", np.full((1, 9), np.nan)) is None
    assert Navigators(run)._within("mine", None) is None
