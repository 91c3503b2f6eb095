"""An ensemble of five runs at three epochs whose every number is chosen; only what is shown of it."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan
from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.experiments.ensembles.ensemble_summary import (
    Circles,
    Component,
    Consistency,
    EnsembleNumbers,
    NamedRun,
    Regulation,
    SquareNumbers,
    WorstTest,
)
from sinssim.statistics.percentiles import Percentile
from sinssim.statistics.requirements import Verdict, parse_requirement

TIME = np.array([100.0, 160.0, 400.0])
ARCMIN = np.pi / 10_800.0
NORTH = np.array([[0.0, 3.0, 30.0], [0.0, -4.0, 20.0], [nan, nan, nan], [0.0, 5.0, -50.0], [0.0, nan, -10.0]])
EAST = np.array([[0.0, 4.0, -10.0], [0.0, 6.0, 25.0], [nan, nan, nan], [0.0, -12.0, 15.0], [0.0, 1.0, 40.0]])
SIGMA = {
    "position_ned": np.array([[0.0, 0.0, 0.0], [3.0, 7.0, 11.0], [30.0, 70.0, 110.0]]),
    "velocity_ned": np.array([[nan] * 3, [0.001, 0.002, 0.003], [0.01, 0.02, 0.04]]),
    "attitude": np.array([[0.5, 1.0, 9.0], [1.0, 2.0, 12.0], [2.0, 3.0, 15.0]]) * ARCMIN,
}


def percentile(value: list[float], low: list[float], high: list[float]) -> Any:
    return SimpleNamespace(value=np.array(value), low=np.array(low), high=np.array(high))


class Result:
    """Stands in for `EnsembleResult`."""

    def __init__(self, *verdicts: tuple[str, Any], filtered: bool = True) -> None:
        scenario: Any = SimpleNamespace(
            name="<trial>", seed=17, description="From A.", to_toml=lambda: "name = 1",
            imu=SimpleNamespace(grade="tactical"),
        )  # fmt: skip
        self.plan = SimpleNamespace(
            scenario=scenario, solution="aided", epochs=TIME, start=100.0, keys=("imu.a", "imu.b"), filtered=filtered
        )
        self.time, self.elapsed = TIME, TIME - 100.0
        self.failed = np.array([False, False, True, False, False])
        self.cep = percentile([0.0, 4.5, 42.0], [0.0, 3.0, 35.0], [0.0, 8.5, 60.0])
        self.r95 = percentile([0.0, 13.0, 90.0], [0.0, 10.0, 75.0], [0.0, 17.0, inf])
        self.verdicts = tuple(
            Verdict(parse_requirement(text), verdict, 40.0, 60.0, 5, 0, None) for text, verdict in verdicts
        )
        self.nees = {"attitude": self._square("attitude", [nan, 1.25, 0.75])} if filtered else {}
        self.nis = {name: self._square(name, [nan] * 3 if name == "baro" else [2.0, 0.5, 1.5])
                    for name in ("baro", "gnss")} if filtered else {}  # fmt: skip
        self.failures = {2: "it <fell> over."}
        final = np.zeros((5, 9))
        final[:, 0], final[:, 1] = NORTH[:, 2], EAST[:, 2]
        self.errors = SimpleNamespace(spans=lambda: [slice(0, 2), slice(2, 3)], column=self._column, final=final,
                                      number=np.arange(5), seed=1000 + np.arange(5))  # fmt: skip
        self.final_horizontal = np.where(self.failed, inf, np.hypot(final[:, 0], final[:, 1]))
        self.mean_rates = self.end_rates = self.final_horizontal / 300.0
        self.computed, self.seconds = 3, 12.34
        self.looks, self.notes = (), ["A <note>."]

    def __len__(self) -> int:
        return 5

    @staticmethod
    def _square(name: str, value: list[float]) -> Any:
        return SimpleNamespace(name=name, value=np.array(value), band=SimpleNamespace(low=0.5, high=1.75))

    @staticmethod
    def _column(name: str, epochs: slice, runs: slice) -> np.ndarray:
        return {"position_n_m": NORTH, "position_e_m": EAST}[name][runs, epochs]

    @staticmethod
    def spread(quantity: str) -> Any:
        sigma = SIGMA[quantity]
        return SimpleNamespace(sigma=sigma, mean=0.0 * sigma, standard_error=0.1 * sigma)

    @staticmethod
    def stated(quantity: str) -> None:
        return None

    @staticmethod
    def command(run: int, program: str = "sinssim", scenario: str | None = None) -> str:
        return f"{program} run <{run}>"

    @staticmethod
    def member(run: int) -> Any:
        return SimpleNamespace(seed=1000 + run)


def band(value: float, low: float, high: float) -> Percentile:
    return Percentile(0.5, *map(np.array, (value, low, high)), 0.95, np.array(5.0))


SQUARE = SquareNumbers(mean=1.25, share_in_band=0.875, end=0.75, low=0.5, high=1.75)
SIZES = [1.0] * 3 + [1e-3] * 3 + [ARCMIN] * 3
"""m, mm/s, arcmin: the units of this ensemble."""


def component(k: int) -> Component:
    """Return the numbers of the k-th component, from 1."""
    values = (-k if k < 4 else k, 2.0 * k, 0.5 * k if k < 4 else 0.25, 3.0 * k if k < 4 else 4.0 * k)
    keys = ("final_mean", "final_sigma", "final_sigma_standard_error", "rms")
    return Component(**{key: value * SIZES[k - 1] for key, value in zip(keys, values, strict=True)})


_COMPONENTS = [f"{what}_{axis}_{unit}" for what, unit in (("position", "m"), ("velocity", "mps"), ("attitude", "rad"))
               for axis in "ned"]  # fmt: skip
NUMBERS = EnsembleNumbers(
    status="interrupted",
    final=Circles(band(42.0, 35.0, 60.0), band(90.0, 75.0, inf)),
    at=((60.0, Circles(band(4.5, 3.0, 8.5), band(13.0, 10.0, 17.0))),),
    line=Circles(band(0.27, 0.22, 0.33), band(0.58, 0.48, 0.73)),
    end=Circles(band(0.37, 0.32, 0.43), band(0.68, 0.61, 0.83)),
    normal=(44.0, 95.5),
    part_121=Regulation("14 CFR Part 121", {"rate of all": (band(0.27, 0.22, 0.33), 2.5),
                                            "CEP": (band(1.5, 1.25, 1.75), 4.0)}, "met"),
    components={name: component(k) for k, name in enumerate(_COMPONENTS, 1)},
    nees={"attitude": SQUARE}, nis={"gnss": replace(SQUARE, end=3.5, share_in_band=nan)},
    consistency=Consistency("consistent", 4, 0, WorstTest("NIS", "gnss", None, 1.25, 1.75, 0.5, 3, 0.01), []),
    own_content=[{"kind": "algorithms", "name": "cayley", "file": "/home/me/cayley.py",
                  "sha256": "0b5cb1e800cf" + 52 * "0"}],
    named_runs=(NamedRun("the <worst>", 3, 1003, 0.75, 52.2, [], ""),
                NamedRun("median", 2, 1002, nan, nan, [], "it fell")),
)  # fmt: skip
