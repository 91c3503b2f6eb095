"""Navigation stretch by stretch is navigation in one go."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from sinssim.data import ImuData, NavState
from sinssim.errors import InputError, RunError
from sinssim.strapdown import navigate
from sinssim.strapdown.nav_error import navigation_error
from sinssim.strapdown.segments import Segments
from tests.oracles.s_turn import STurn

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


@pytest.mark.parametrize(
    ("algorithm", "unequal"), [("quaternion", False), ("quaternion", True), ("rotation-vector-1p", False)]
)
def test_a_run_cut_anywhere_is_the_run_in_one_go(algorithm: str, unequal: bool) -> None:
    imu, state = flown(unequal)
    whole = navigate(imu, state, algorithm=algorithm, gravity="somigliana")
    engine = Segments(imu, algorithm=algorithm, gravity="somigliana")
    # lengths of one sample and of two, at both ends and in the middle, are where a fit could run out of neighbours
    end = len(imu)
    for first, last in itertools.pairwise([0, 1, 2, 5, 6, 100, 101, 103, 700, 701, end - 10, end - 3, end - 1, end]):
        before, samples = engine.samples(first, last)
        assert samples.time[before] == imu.time[first]
        solution = engine.navigate(first, last, state, samples)
        state = solution.state()
        reference = NavState(*(getattr(whole, n)[first : last + 1] for n in NavState.__dataclass_fields__))
        error = navigation_error(reference, solution)
        assert np.abs(error.position_ned).max() < 1e-7
        assert np.abs(error.velocity_ned).max() < 1e-8
        assert error.angle.max() < 1e-13


def test_refused() -> None:
    imu, state = flown()
    with pytest.raises(InputError, match="several samples at once"):
        Segments(imu, algorithm="rotation-vector-3")
    with pytest.raises(InputError, match="equal sampling intervals"):
        Segments(flown(unequal=True)[0], algorithm="rotation-vector-1p")
    with pytest.raises(InputError, match="unknown algorithm"):
        Segments(imu, algorithm="quaternio")
    engine = Segments(imu)
    _, samples = engine.samples(0, 10)
    polar = NavState(np.asarray(np.radians(89.95)), state.longitude, state.height, state.velocity_ned, state.q_nb)
    with pytest.raises(RunError, match="pole"):
        engine.navigate(0, 10, polar, samples)
