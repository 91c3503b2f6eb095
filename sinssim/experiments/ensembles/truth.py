"""The true motion and ideal increments of the runs of an ensemble, computed once for all runs that share them."""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from typing import TYPE_CHECKING

from sinssim.data import ImuData
from sinssim.simulation.truth import Truth, truth_along

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

_TABLES = (
    "flight", "parked", "great_circle", "motion", "track", "drive", "voyage", "turntable", "vibration", "isolator",
    "truth", "gravity",
)  # fmt: skip
_OF_BLOCK = ("lever_arm_m", "mounting_deg", "rate_hz", "rotation")
_KEPT = 2
"""True motions kept at a time: that of all runs, or that of a run in progress in each of two threads."""


def truth_key(scenario: Scenario) -> str:
    """Return a text that is equal for scenarios with the same true motion and increments.

    Returns:
        The tables and keys that determine them, with the seed if turbulence, vibration, road, sea, gravity's remainder
        or the errors of a turntable are drawn from it.
    """
    flight, table = scenario.flight, scenario.turntable
    drawn = (
        bool(scenario.vibration or scenario.drive or scenario.voyage)
        or (flight is not None and bool(flight.turbulence))
        or (table is not None and bool(table.position_sigma_arcsec or table.tilt_sigma_arcsec))
        or has_remainder(scenario)
    )
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
        self._unrounded: tuple[Truth, ImuData] | None = None

    def forget(self) -> None:
        """Free all true motions; they are computed again when they are wanted."""
        with self._lock:
            self._kept.clear()
            self._each.clear()
            self._unrounded = None

    def keep(self, scenario: Scenario, truth: Truth) -> None:
        """Keep a true motion that another process has computed."""
        with self._lock:
            self._kept[truth_key(scenario)] = truth
            self._drop_old()

    def of(self, scenario: Scenario) -> Truth:
        """Return the true motion of a scenario, the same bits as those of `sinssim run`.

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
            again = has_remainder(scenario) and scenario.imu.rotation is None
            found = self._in_drawn_gravity(scenario) if again else _truth(scenario)
            with self._lock:
                self._kept[key] = found
                self._drop_old()
        return found

    def _drop_old(self) -> None:
        while len(self._kept) > _KEPT:
            old, _ = self._kept.popitem(last=False)
            self._each.pop(old, None)

    def _in_drawn_gravity(self, scenario: Scenario) -> Truth:
        """Return the true motion in a gravity that is drawn in each run; the motion itself is that of all runs."""
        from sinssim.sensors.imu.emulate import digital

        assert scenario.gravity is not None  # asked by the caller
        base = self.of(scenario.model_copy(update={"gravity": None}))
        trajectory = scenario.gravity.felt(base.trajectory, scenario.seed)
        known = self._unrounded
        if known is None or known[0] is not base:
            known = self._unrounded = base, base.block.increments(scenario.imu.rate_hz)
        own = known[1]
        dvel = own.dvel - trajectory.felt(own.time, own.dtheta)
        ideal = digital(ImuData(own.time, own.dtheta, dvel))
        return Truth.along(trajectory, trajectory, base.rate_hz, ideal, base.state)


def has_remainder(scenario: Scenario) -> bool:
    """Return whether a scenario's gravity has a part that is drawn in each run."""
    return scenario.gravity is not None and scenario.gravity.remainder is not None


def _truth(scenario: Scenario) -> Truth:
    from sinssim.scenario.true_motion import true_motion

    return truth_along(true_motion(scenario), scenario)
