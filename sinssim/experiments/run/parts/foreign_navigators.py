"""The navigators of somebody else in a run: what they state beside their solutions, and whether it is true."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypedDict

import numpy as np

from sinssim.data import Array
from sinssim.exhibits import Column, Item, Sentence, Table
from sinssim.experiments.run.run_result import Part
from sinssim.formatting import number_text
from sinssim.recording.streams import Stream, Vector
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.navigator_protocol import ForeignSolution
from sinssim.units import fixed

_VECTORS = ("position_ned", "velocity_ned", "attitude")
SIGMAS = (
    *(f"sigma_position_{axis}_m" for axis in "ned"), *(f"sigma_velocity_{axis}_mps" for axis in "ned"),
    *(f"sigma_phi_{axis}_rad" for axis in "ned"),
)  # fmt: skip
"""Columns of the 1σ of position, velocity and attitude, of any solution that states them."""
_NORMAL = 0.6827
"""Share of normal errors within 1σ."""
_MOST_STATUS = 20
"""Different values of a status that are counted; beyond it is a number, not a status."""


class Stated(TypedDict):
    """What one navigator states; None for what it does not."""

    started: str
    solutions: int
    interval_s: float
    within_sigma: dict[str, float] | None
    status: dict[str, int] | None
    last_message: str


@dataclass(frozen=True)
class Navigators(Part[dict[str, Stated]]):
    """The navigators of somebody else."""

    name, title = "navigators", "Navigators of others"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the scenario names one."""
        return bool(run.scenario.navigator)

    @property
    def _solutions(self) -> dict[str, ForeignSolution]:
        return {name: of for name, of in self.run.solutions.items() if isinstance(of, ForeignSolution)}

    def numbers(self) -> dict[str, Stated]:
        """Return what each states, of those that have a solution."""
        started = {n.name: n.library or " ".join(n.command or ()) for n in self.run.scenario.navigator}
        return {
            name: Stated(
                started=started[name], solutions=len(of.time),
                interval_s=float(np.median(np.diff(of.time))) if len(of.time) > 1 else float("nan"),
                within_sigma=self._within(name, of.sigma), status=_counts(of.status),
                last_message=of.messages.strip().rpartition("\n")[2],
            )
            for name, of in self._solutions.items()
        }  # fmt: skip

    def _within(self, name: str, sigma: Array | None) -> dict[str, float] | None:
        """Return the share of errors within 1σ, by position, velocity and attitude; None without 1σ or a truth."""
        if sigma is None or self.run.axes != "north":
            return None
        errors, shares = self.run.errors[name], {}
        for number, vector in enumerate(_VECTORS):
            known = sigma[:, 3 * number : 3 * number + 3]
            error = getattr(errors, vector)
            there = np.isfinite(known) & np.isfinite(error)
            if there.any():
                shares[vector.removesuffix("_ned")] = float(np.mean(np.abs(error[there]) <= known[there]))
        return shares or None

    def exhibits(self) -> Iterator[Item]:
        """Yield a table of what they state."""
        kinds = ("position", "velocity", "attitude")
        columns = (
            Column("navigator", words=True), Column("solutions"), Column("every", fixed("s"), digits=4),
            *(Column(kind, digits=3, group="errors within its 1σ") for kind in kinds), Column("status", words=True),
            Column("started", words=True),
        )  # fmt: skip
        rows: list[list[str | float]] = []
        for name, stated in self.entry.items():
            shares, status = stated["within_sigma"] or {}, stated["status"] or {}
            words = ", ".join(f"{value} × {count}" for value, count in status.items())
            within = (shares.get(kind, float("nan")) for kind in kinds)
            rows.append([name, str(stated["solutions"]), stated["interval_s"], *within, words, stated["started"]])
        if rows:
            yield Table(columns, rows)
        if any(stated["within_sigma"] for stated in self.entry.values()):
            yield Sentence(f"Of normal errors a share of {number_text(_NORMAL)} is within 1σ.", "note")
        for name, stated in self.entry.items():
            if stated["last_message"]:
                yield Sentence(f"{name} said last: {stated['last_message']}", "note")

    def streams(self) -> Iterator[Stream]:
        """Yield the 1σ, the biases and the status that they state."""
        biases = (*(f"gyro_bias_{axis}_radps" for axis in "xyz"), *(f"accel_bias_{axis}_mps2" for axis in "xyz"))
        for name, of in self._solutions.items():
            vectors = [] if of.sigma is None else [Vector("sigma", SIGMAS, of.sigma)]
            vectors += [] if of.biases is None else [Vector("biases", biases, of.biases)]
            vectors += [] if of.status is None else [Vector("status", ("status",), of.status[:, None])]
            if vectors:
                yield Stream(f"navigator_{name}", of.time, tuple(vectors))


def _counts(status: Array | None) -> dict[str, int] | None:
    """Return how often each value of a status occurs."""
    if status is None:
        return None
    counts = Counter(status[np.isfinite(status)].tolist())
    return {f"{value:g}": counts[value] for value in sorted(counts)} if len(counts) <= _MOST_STATUS else None
