"""Sample edges and checks of instants, with intervals and limits that are worked out by hand."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest

from sinssim.data import NavState
from sinssim.errors import InputError
from sinssim.truth import sampling
from sinssim.truth.sampling import (
    check_instants,
    checked_place,
    in_blocks,
    integrate_samples,
    part_by_part,
    sample_edges,
)  # fmt: skip


def test_edges_begin_at_the_start_and_fit() -> None:
    quarters = [2.5, 2.75, 3.0, 3.25, 3.5, 3.75, 4.0]
    assert sample_edges(2.5, 4.0, 4.0).tolist() == quarters
    assert sample_edges(2.5, 4.2, 4.0).tolist() == quarters
    assert sample_edges(2.5, 4.0 - 5e-10, 4.0).tolist() == quarters  # half a nanosecond is rounding
    assert sample_edges(2.5, 4.0 - 2e-9, 4.0).tolist() == quarters[:-1]


def test_a_rate_that_gives_no_sample_or_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError) as error:
        sample_edges(10.0, 10.5, 1.6)
    assert str(error.value) == (
        "the trajectory lasts 0.5 s, less than one sample interval of 0.625 s at 1.6 Hz; use a longer trajectory or a "
        "higher rate."
    )
    monkeypatch.setattr(sampling, "machine_memory", lambda: 5600.0)  # an edge and six integrals are 56 bytes
    with pytest.raises(InputError) as error:
        sample_edges(10.0, 30.0, 7.0)
    assert str(error.value) == (
        "rate_hz = 7 gives 140 samples of a trajectory of 20 s, but this machine's memory holds only 100; use a rate "
        "of at most 5 Hz."
    )
    assert len(sample_edges(10.0, 30.0, 4.9)) == 99


def test_instants_within_the_trajectory() -> None:
    inside = [2.5, 3.0, 7.0, 2.5 - 5e-10, 7.0 + 5e-10]
    assert check_instants(inside, 2.5, 7.0).tolist() == inside
    for outside, first in (([3.0, 2.4, 8.0], "2.4"), ([3.0, 7.1, 1.0], "7.1"), ([2.5 - 2e-9], "2.499999998")):
        with pytest.raises(InputError, match=rf"the time .*{first}.* s lies outside .* runs from 2\.5 s to 7\.0 s\."):
            check_instants(outside, 2.5, 7.0)
    with pytest.raises(InputError, match=r"not an array of shape \(1, 2\)\."):
        check_instants([[3.0, 4.0]], 2.5, 7.0)


def test_places() -> None:
    assert checked_place(-0.5 * math.pi, 4.0, -4.9e6) == (-0.5 * math.pi, 4.0, -4.9e6)
    with pytest.raises(InputError, match=r"latitude = 120\.321° must lie within ±90°; give radians\."):
        checked_place(2.1, 0.3, 50.0)
    for height in (-5.1e6, 1.1e9):
        with pytest.raises(InputError, match="height"):
            checked_place(0.2, 0.3, height)


def test_states_part_by_part_are_those_of_all_instants(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sampling, "_PART", 3)
    asked = []

    def state(t: np.ndarray) -> NavState:
        asked.append(t.tolist())
        return NavState(t, 2.0 * t, 3.0 * t, t[:, None] * [4.0, 5.0, 6.0], t[:, None] * [7.0, 8.0, 9.0, 10.0])

    times = np.arange(1.0, 9.0)
    found = part_by_part(state, times)
    assert asked == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0]]
    for name, factors in (("latitude", 1.0), ("longitude", 2.0), ("height", 3.0)):
        np.testing.assert_array_equal(getattr(found, name), factors * times)
    np.testing.assert_array_equal(found.velocity_ned, times[:, None] * [4.0, 5.0, 6.0])
    np.testing.assert_array_equal(found.q_nb, times[:, None] * [7.0, 8.0, 9.0, 10.0])


@pytest.mark.parametrize(("count", "processors", "blocks"), [
    (9001, 8, [(0, 4500), (4500, 9001)]), (9001, 1, [(0, 9001)]), (4095, 8, [(0, 4095)]), (0, 8, [(0, 0)]),
])  # fmt: skip
def test_blocks_cover_all_items_once(
    count: int, processors: int, blocks: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sampling.os, "cpu_count", lambda: processors)
    done, lock = [], threading.Lock()

    def work(first: int, last: int) -> None:
        with lock:
            done.append((first, last))

    in_blocks(count, work)
    assert sorted(done) == blocks


def test_a_break_within_rounding_of_the_last_edge_belongs_to_the_last_sample() -> None:
    """The integral of 1 over each interval is its length."""
    edges = np.arange(2101) / 10.0
    whole = integrate_samples(lambda t: np.ones((len(t), 1)), edges, 1.0, [np.nextafter(210.0, 0.0)], 1)
    np.testing.assert_allclose(whole[:, 0], np.diff(edges), rtol=1e-12)


@pytest.mark.parametrize("phase", [0.1, 1.9, 2.1, 6.3, 6.5, 11.9, 12.1, 150.0])
def test_an_oscillation_is_integrated_to_rounding_however_many_points_a_panel_has(phase: float) -> None:
    """∫cos(ωt) dt = [sin(ωt)]/ω; an interval of long phase needs less than half as many instants as panels of 2 rad."""
    edges, asked = np.arange(41) / 10.0, 0

    def oscillation(t: np.ndarray) -> np.ndarray:
        nonlocal asked
        asked += len(t)
        return np.column_stack([np.cos(10.0 * phase * t), np.sin(10.0 * phase * t)])

    whole = integrate_samples(oscillation, edges, 10.0 * phase, columns=2)
    angle = 10.0 * phase * edges
    exact = np.column_stack([np.diff(np.sin(angle)), -np.diff(np.cos(angle))]) / (10.0 * phase)
    np.testing.assert_allclose(whole, exact, rtol=0.0, atol=1e-16 * (2.0 + phase * 40.0))
    if phase > 4.0:
        assert asked <= 0.5 * 40 * 8 * np.ceil(phase / 2.0)
