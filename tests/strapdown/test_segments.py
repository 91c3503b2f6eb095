"""Navigation stretch by stretch is navigation in one go."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sinssim.data import ImuData, NavState
from sinssim.errors import InputError, RunError
from sinssim.strapdown.frames import FRAME_REGISTRY, FRAMES
from sinssim.strapdown.navigate import Segments, navigate
from sinssim.strapdown.navigation_error import navigation_error
from tests.oracles.s_turn import STurn
from tests.slow import slow

FLIGHT = STurn(duration=60.0, period=7.0)


def flown(unequal: bool = False) -> tuple[ImuData, NavState]:
    """Return increments of tight S-turns at 20 Hz, or over one or two intervals of 40 Hz, and the initial state."""
    flight = FLIGHT.fly(40.0)
    kept = np.random.default_rng(5).random(len(flight.time)) > 0.5 if unequal else np.arange(len(flight.time)) % 2 == 0
    kept[1:] |= ~kept[:-1]  # no two in a row are left out
    kept[[0, -1]] = True
    first = np.flatnonzero(kept)[:-1]
    imu = ImuData(
        flight.time[kept], np.add.reduceat(flight.dtheta, first, axis=0), np.add.reduceat(flight.dvel, first, axis=0)
    )
    start = (getattr(flight, name)[0] for name in NavState.__dataclass_fields__)
    return imu, NavState(*start)


def cut(imu: ImuData, state: NavState, **options: Any) -> tuple[float, float, float]:
    """Return the largest differences of position, velocity and attitude of segments from the run in one go."""
    whole = navigate(imu, state, **options)
    engine = Segments(imu, **options)
    np.testing.assert_array_equal(engine.time, whole.time)
    # lengths of one row and of two, at both ends and in the middle, are where a fit could run out of neighbours
    end = len(whole.time) - 1
    cuts = {0, 1, 2, 5, 6, 100, 101, 103, 700, 701, end - 10, end - 3, end - 1, end}
    worst = np.zeros(3)
    for first, last in itertools.pairwise(sorted(c for c in cuts if c <= end)):
        before, samples = engine.samples(first, last)
        assert samples.time[before] == whole.time[first]
        solution = engine.navigate(first, last, state, samples)
        state = solution.state()
        reference = NavState(*(getattr(whole, n)[first : last + 1] for n in NavState.__dataclass_fields__))
        error = navigation_error(reference, solution)
        found = np.abs(error.position_ned).max(), np.abs(error.velocity_ned).max(), error.angle.max()
        worst = np.maximum(worst, found)
    return float(worst[0]), float(worst[1]), float(worst[2])


ROUTE = (0.7, 0.1, 0.72, 0.14)


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize(
    ("algorithm", "unequal"), [("quaternion", False), ("quaternion", True), ("rotation-vector-1p", False)]
)
def test_a_run_cut_anywhere_is_the_run_in_one_go(algorithm: str, unequal: bool, frame: str) -> None:
    imu, state = flown(unequal)
    route = {"route": ROUTE} if frame == "transverse" else {}
    position, velocity, angle = cut(imu, state, algorithm=algorithm, frame=frame, gravity="somigliana", **route)
    assert position < (1e-7 if frame == "level" else 2e-7)  # rounding of the geodetic coordinates at the ends
    assert velocity < 1e-8
    assert angle < 3e-13


@pytest.mark.parametrize("frame", FRAMES)
def test_the_schedule_of_rates_is_kept(frame: str) -> None:
    """Held slow quantities are those of the last row, so that a cut changes nothing."""
    imu, state = flown()
    route = {"route": ROUTE} if frame == "transverse" else {}
    found = cut(imu, state, frame=frame, rates_hz=(20.0, 10.0, 2.0), **route)
    assert max(found) < 2e-7
    assert Segments(imu, frame=frame, rates_hz=(20.0, 10.0, 2.0)).time[1] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("frame", "curvature"),
    [
        *((frame, curvature) for frame in ("level", "wander") for curvature in ("simplified", "spherical-no-height")),
        # each of these has a kernel that no other test of the normal run compiles
        *slow(*((frame, curvature) for frame in ("level", "wander") for curvature in ("spherical", "no-height"))),
    ],
)
def test_the_radii_are_those_asked_for(frame: str, curvature: str) -> None:
    imu, state = flown()
    assert max(cut(imu, state, frame=frame, curvature=curvature, ellipsoid="krasovsky-1940")) < 2e-7
    own, exact = (navigate(imu, state, frame=frame, curvature=c) for c in (curvature, "exact"))
    assert not np.array_equal(own.latitude, exact.latitude)


@pytest.mark.parametrize("algorithm", ["rotation-vector-2", "rotation-vector-4"])
def test_algorithms_of_several_samples_are_cut_at_their_rows(algorithm: str) -> None:
    imu, state = flown()
    assert max(cut(imu, state, algorithm=algorithm, frame="inertial")) < 2e-7
    # the kernels are compiled for such arrays: they would be compiled once more for others
    assert Segments(imu, algorithm=algorithm, frame="inertial").time.flags.c_contiguous


def test_a_frame_that_does_not_fit_across_its_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its segments are fitted by their own samples: right, and less accurate at their ends."""
    monkeypatch.setitem(FRAME_REGISTRY.shipped, "inertial", replace(FRAME_REGISTRY["inertial"], starts_anywhere=False))
    for unequal in (False, True):
        position, velocity, angle = cut(*flown(unequal), frame="inertial")
        assert position < 0.05
        assert velocity < 0.01
        assert 1e-9 < angle < 1e-4


def test_refused() -> None:
    imu, state = flown()
    with pytest.raises(InputError, match="processes windows of samples"):
        Segments(imu, algorithm="functional-iteration")
    with pytest.raises(InputError, match="would have no effect"):
        Segments(imu, frame="inertial", curvature="simplified")
    with pytest.raises(InputError, match="needs equal sampling intervals"):
        Segments(flown(unequal=True)[0], rates_hz=(20.0, 10.0, 2.0))
    with pytest.raises(InputError, match="unknown frame"):
        Segments(imu, frame="levle")
    with pytest.raises(InputError, match="equal sampling intervals"):
        Segments(flown(unequal=True)[0], algorithm="rotation-vector-1p")
    with pytest.raises(InputError, match="unknown algorithm"):
        Segments(imu, algorithm="quaternio")
    engine = Segments(imu)
    _, samples = engine.samples(0, 10)
    polar = NavState(np.asarray(np.radians(89.95)), state.longitude, state.height, state.velocity_ned, state.q_nb)
    with pytest.raises(RunError, match="pole"):
        engine.navigate(0, 10, polar, samples)
