"""Exports of the run by hand, and tables of numbers in files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.earth.gravity_disturbance import DisturbingField
from sinssim.earth.harmonic_coefficients import shipped
from sinssim.logs.formats.export_streams import export
from tests.logs import hand_run

OF_ALL = "The run's time 0 is 2017-01-01T23:59:59Z (--start)."
DATES = ["2017-01-01T23:59:59.250Z", "2017-01-01T23:59:59.750Z", "2017-01-02T00:00:00.250Z", "2017-01-02T00:00:00.750Z"]
NED_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


GEOID = (
    "Mean sea level is the geoid of EGM2008 to degree 120, which is right to half a metre (1σ), in high mountains to "
    "some metres."
)


def above_the_geoid(height: ArrayLike, latitude: ArrayLike, longitude: ArrayLike) -> list[tuple[str, str]]:
    """Heights above the geoid and the geoid's, m, of heights above the ellipsoid, from degrees."""
    geoid = np.round(DisturbingField(shipped()).undulation(np.radians(latitude), np.radians(longitude)), 4)
    return [(f"{h:.4f}", f"{n:.4f}") for h, n in zip(np.asarray(height) - geoid, geoid, strict=True)]


def made(run: Path, to: str, place: Path, *solution: str) -> list[str]:
    """Export with the date of the run by hand, and return what is said of this format."""
    done = export(run, to, place, solution=solution, start=hand_run.START)
    assert done.sentences[-1] == OF_ALL
    return list(done.sentences[:-1])


def table(file: Path, delimiter: str | None = ",", skip: int = 1) -> Array:
    return np.array([[float(x) for x in line.split(delimiter)] for line in file.read_text().splitlines()[skip:]])


def close(found: Array, *columns: Array) -> None:
    np.testing.assert_allclose(found, np.column_stack(columns), rtol=1e-13, atol=1e-13)
