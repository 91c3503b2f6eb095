"""How the errors of an algorithm follow from the stored truth and solution; written into the solution's file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.models import WGS84
from sinssim.errors import InputError
from sinssim.strapdown.nav_error import navigation_error

STATE_COLUMNS = (
    "latitude_rad", "longitude_rad", "height_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps", "q_nb_w",
    "q_nb_x", "q_nb_y", "q_nb_z",
)  # fmt: skip
ERROR_COLUMNS = (
    "time_s", "position_n_m", "position_e_m", "position_d_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
    "phi_n_rad", "phi_e_rad", "phi_d_rad",
)  # fmt: skip

_KEY = "sinssim.error"
_VERSION = 1
"""Of the rule; raised when `navigation_error` gives other numbers."""


@dataclass(frozen=True)
class ErrorRule:
    """What the errors depend on beside truth and solution.

    Attributes:
        semi_major_axis: of the reference ellipsoid, m.
        flattening: of the reference ellipsoid.
        axes: one of `sinssim.frames.AXES`.
    """

    semi_major_axis: float
    flattening: float
    axes: str

    def metadata(self) -> dict[str, str]:
        """Return the rule as metadata of a Parquet file; doubles keep all their bits."""
        named = {"a_m": self.semi_major_axis, "f": self.flattening, "axes": self.axes}
        return {_KEY: json.dumps({"version": _VERSION, "against": "truth", **named})}

    @classmethod
    def of_metadata(cls, found: Mapping[bytes, bytes], file: Path) -> Self | None:
        """Return the rule in the metadata of a file, None if there is none.

        Raises:
            InputError: the rule is that of another version.
        """
        text = found.get(_KEY.encode())
        if text is None:
            return None
        rule = json.loads(text)
        if rule.get("version") != _VERSION:
            raise InputError(
                f"{file} is of another version of sinssim: the rule of its errors is {rule.get('version')}, and this "
                f"version computes rule {_VERSION}. Run its scenario.toml again."
            )
        return cls(float(rule["a_m"]), float(rule["f"]), str(rule["axes"]))


def errors_by(rule: ErrorRule, truth: list[Array], own: list[Array]) -> list[Array]:
    """Return the errors of a solution.

    Args:
        truth: `time_s` and `STATE_COLUMNS` of the truth, (N,) each.
        own: the same of the solution, at the same times.

    Returns:
        By `ERROR_COLUMNS`, (N,) each.
    """
    ellipsoid = replace(WGS84, name="of the run", a=rule.semi_major_axis, f=rule.flattening)
    state = NavState(truth[1], truth[2], truth[3], np.stack(truth[4:7], 1), np.stack(truth[7:11], 1))
    velocity, q_nb = np.stack(own[4:7], 1), np.stack(own[7:11], 1)
    solution = NavSolution(own[0], own[1], own[2], own[3], velocity, q_nb, np.zeros(len(own[0])))
    error = navigation_error(state, solution, ellipsoid, rule.axes)
    return [error.time, *error.position_ned.T, *error.velocity_ned.T, *error.attitude.T]
