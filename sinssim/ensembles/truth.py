"""The true motion and ideal increments of the runs of an ensemble, computed once for all runs that share them."""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sinssim.data import Array, ImuData, NavState

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory

_TABLES = ("flight", "parked", "great_circle", "motion", "track", "vibration", "isolator", "truth")
_OF_BLOCK = ("lever_arm_m", "mounting_deg", "rate_hz")
_KEPT = 2
"""True motions kept at a time: that of all runs, or that of a run in progress in each of two threads."""


@dataclass(frozen=True)
class Truth:
    """The true motion of a run.

    Attributes:
        trajectory: the motion.
        ideal: ideal increments along it.
        state: true states at the edges of the increments.
    """

    trajectory: Trajectory
    ideal: ImuData
    state: NavState

    @property
    def time(self) -> Array:
        """Edges of the increments, (N+1,) s."""
        return self.ideal.time


def truth_key(scenario: Scenario) -> str:
    """Return a text that is equal for scenarios with the same true motion and increments.

    Args:
        scenario: the scenario of a run.

    Returns:
        The tables and keys that determine them, with the seed if turbulence or vibration are drawn from it.
    """
    flight = scenario.flight
    drawn = bool(scenario.vibration) or (flight is not None and bool(flight.turbulence))
    contents = scenario.contents()
    return json.dumps(
        [
            {name: contents.get(name) for name in _TABLES},
            {name: contents["imu"].get(name) for name in _OF_BLOCK},
            scenario.seed if drawn else None,
        ],
        sort_keys=True,
    )


class TruthCache:
    """Computes true motions and keeps the last ones; usable from several threads."""

    def __init__(self) -> None:
        """Begin without any."""
        self._kept: OrderedDict[str, Truth] = OrderedDict()
        self._lock = threading.Lock()
        self._each: dict[str, threading.Lock] = {}

    def forget(self) -> None:
        """Free all true motions; they are computed again when they are wanted."""
        with self._lock:
            self._kept.clear()
            self._each.clear()

    def of(self, scenario: Scenario) -> Truth:
        """Return the true motion of a scenario, the same bits as those of `sinssim run`.

        Args:
            scenario: the scenario of a run.

        Returns:
            The motion.

        Raises:
            InputError: the scenario's motion cannot be used.
            RunError: JSBSim failed.
        """
        key = truth_key(scenario)
        with self._lock:
            own = self._each.setdefault(key, threading.Lock())
        with own:  # threads that want the same motion wait for the first of them
            with self._lock:
                if key in self._kept:
                    self._kept.move_to_end(key)
                    return self._kept[key]
            found = _truth(scenario)
            with self._lock:
                self._kept[key] = found
                while len(self._kept) > _KEPT:
                    old, _ = self._kept.popitem(last=False)
                    self._each.pop(old, None)
        return found


def _truth(scenario: Scenario) -> Truth:
    from sinssim.truth.source import fly

    trajectory = fly(scenario)
    ideal = trajectory.increments(scenario.imu.rate_hz)
    return Truth(trajectory, ideal, trajectory.state(ideal.time))
