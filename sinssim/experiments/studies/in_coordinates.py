"""Errors of a study's navigations in further coordinates: component by component, with the names of a run's streams."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.models import Ellipsoid, ellipsoid_by_name
from sinssim.earth.transverse import route_pole
from sinssim.experiments.run.store.coordinate_streams import CoordinateStreams
from sinssim.experiments.studies.results import Case, CoordinateError
from sinssim.frames import OF_TRUTH


def coordinate_errors(
    case: Case, kinds: Sequence[str], truth: NavState, solution: NavSolution, ellipsoid: Ellipsoid
) -> list[CoordinateError]:
    """Return the errors of a solution in further coordinates.

    Conditional coordinates are those of the great circle along the true initial velocity. Along a frame's axes both
    motions are resolved with the solution's azimuth.

    Args:
        kinds: kinds of coordinates, see `sinssim.scenario.sections.output.COORDINATES`.
        truth: true states, N rows.
        solution: N rows.
    """
    if not kinds:
        return []
    begin = (float(truth.latitude[0]), float(truth.longitude[0]))
    pole = route_pole(None, *begin, truth.velocity_ned[0])
    own = ellipsoid if case.ellipsoid == OF_TRUTH else ellipsoid_by_name(case.ellipsoid)
    names = ("latitude", "longitude", "height", "velocity_ned", "q_nb")
    true = replace(solution, **{name: getattr(truth, name) for name in names})  # with the solution's azimuth
    found = []
    for kind in kinds:
        values = [
            CoordinateStreams((kind,), None, of, pole, begin, float(solution.time[0])).of("", solution.time, motion)
            for of, motion in ((ellipsoid, true), (own, solution))
        ]
        for right, computed in zip(*values, strict=True):
            for vector, other in zip(right.vectors, computed.vectors, strict=True):
                every = slice(0, len(solution.time))
                errors = _errors(vector.columns, vector.values[every], other.values[every])
                found += [
                    CoordinateError(case, kind, column, float(np.abs(error).max()), float(error[-1]))
                    for column, error in errors
                ]
    return found


def _errors(columns: tuple[str, ...], true: Array, computed: Array) -> Iterator[tuple[str, Array]]:
    """Yield the error of each column: a difference, of an angle within ±π, of a quaternion the angle of rotation."""
    if len(columns) == 4:
        turn = rotation.multiply(computed, rotation.conjugate(true))
        yield "attitude_rad", np.linalg.norm(rotation.rotation_vector_from_quaternion(turn), axis=1)
        return
    for number, column in enumerate(columns):
        error = computed[:, number] - true[:, number]
        yield column, (np.mod(error + np.pi, 2.0 * np.pi) - np.pi if column.endswith("_rad") else error)
