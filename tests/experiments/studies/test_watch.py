"""Progress, time left, and the refusal of studies that take too long."""

from __future__ import annotations

import pytest

from sinssim.experiments import workload as module
from sinssim.experiments.workload import TooLongError, Watch


class Clock:
    """A clock that the test moves."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        """Return the time, s."""
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """The module's clock."""
    made = Clock()
    monkeypatch.setattr(module.time, "perf_counter", made)
    return made


def test_time_left(clock: Clock) -> None:
    """The first cell is slow, because kernels are compiled; the second tells the time of all."""
    seen: list[tuple[str, float]] = []
    said: list[str] = []
    watch = Watch("mine", "10 budgets", 10, 30.0, lambda text, part: seen.append((text, part)), said.append)
    watch.flying(4.0)
    assert seen[-1] == ("0/10 cells, flying", 0.0)
    watch.flying(0.0)
    watch.begin()
    clock.now += 9.0
    watch.finish()
    assert said == []
    watch.begin()
    clock.now += 5.0
    watch.finish()
    assert seen[-1] == ("2/10 cells, 40 s left", pytest.approx(0.2))
    assert said == ["mine: 10 budgets, about 54 s."]
    watch.begin()
    clock.now += 2.5
    watch.inside(0.5, "32/64 runs")
    assert seen[-1] == ("2/10 cells, 32/64 runs, 38 s left", pytest.approx(0.25))


def test_flights_that_are_still_to_be_flown_count(clock: Clock) -> None:
    """Two further cells of 5 s and flights of 20 s; half a cell later 7.5 s and 8 s."""
    seen: list[tuple[str, float]] = []
    watch = Watch("mine", "3 budgets", 3, 30.0, lambda text, part: seen.append((text, part)), lambda text: None)
    watch.flying(20.0)
    watch.begin()
    clock.now += 5.0
    watch.finish()
    assert seen[-1] == ("1/3 cells, 30 s left", pytest.approx(1.0 / 3.0))
    watch.flying(8.4)
    assert seen[-1] == ("1/3 cells, flying", pytest.approx(1.0 / 3.0))
    watch.begin()
    watch.inside(0.5)
    assert seen[-1] == ("1/3 cells, 16 s left", pytest.approx(0.5))


def test_a_failed_cell_tells_nothing(clock: Clock) -> None:
    """It may fail at once; the others take their time."""
    seen: list[str] = []
    watch = Watch("mine", "4 budgets", 4, 30.0, lambda text, part: seen.append(text), lambda text: None)
    for failed, lasts in ((True, 0.001), (False, 5.0)):
        watch.begin()
        clock.now += lasts
        watch.finish(failed)
    assert seen == ["1/4 cells", "2/4 cells, 10 s left"]


def test_a_part_of_a_cell_tells(clock: Clock) -> None:
    """Ensembles take long: a part of the first one is enough."""
    watch = Watch("mine", "4 ensembles of 1000 runs", 4, 30.0, lambda text, part: None, lambda text: None)
    watch.begin()
    clock.now += 50.0  # processes start, kernels are compiled
    watch.inside(0.001)
    clock.now += 6.0
    watch.inside(0.0015)
    clock.now += 6.0
    said = r"would take too long: 4 ensembles of 1000 runs, about 13\.3 h, more than the limit of 30 min.*minutes 961"
    with pytest.raises(TooLongError, match=said):
        watch.inside(0.002)
