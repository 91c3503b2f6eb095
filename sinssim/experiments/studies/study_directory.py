"""The directory of a comparison of algorithms: a file for each navigation that is finished.

The name of a file is the digest of everything that determines the navigation but the versions of the software. A study
whose parts have changed therefore goes on with the navigations that it has.
"""

from __future__ import annotations

import base64
import functools
import itertools
from collections.abc import Callable, Iterator
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.experiments.ensembles.ensemble_plan import contents_of, flight_digest
from sinssim.experiments.experiment_directory import Kind, Store, contents_digest, is_part, other_software, software
from sinssim.experiments.studies.study_results import Case, CoordinateError, ErrorGrowth, Row, StudyResult
from sinssim.experiments.studies.study_schema import Part, Study, StudyMotion, scenario_of, with_set

Say = Callable[[str], None]


class Navigated(NamedTuple):
    """What a navigation has given: its numbers, the growth of its errors, None if it failed, in further coordinates."""

    row: Row
    growth: ErrorGrowth | None
    in_coordinates: list[CoordinateError]


def cases_of(part: Part, motion: StudyMotion) -> Iterator[Case]:
    """Yield every navigation of a part on a motion, those of the same sensors after one another."""
    for grade, variant, (rate, schedule, slow), engine in itertools.product(
        part.sensors, part.variants, part.pace, part.engines
    ):
        algorithm, frame, gravity, curvature, ellipsoid = engine
        yield Case(
            part.title, motion.label, variant, grade, algorithm, frame, gravity, curvature, rate, schedule or (), slow,
            ellipsoid,
        )  # fmt: skip


def digests(study: Study, part: Part, motion: StudyMotion) -> dict[Case, str]:
    """Return the SHA-256 of what determines the numbers of each navigation of a part on a motion.

    The titles of part and motion do not; the highest rate does, because sensors are read at it.
    """
    base = scenario_of(motion)
    flight = flight_digest(base)

    @functools.cache
    def contents(grade: str, variant: str, algorithm: str, frame: str) -> dict[str, Any]:
        navigation = base.navigation.model_copy(update={"algorithms": (algorithm,), "frame": frame})
        block = with_set(study.block(grade), variant, part.highest_hz)
        scenario = base.model_copy(update={"imu": block, "navigation": navigation, "seed": study.seed})
        return contents_of(scenario)

    how = [motion.duration_s, part.vertical, list(part.coordinates), flight]
    return {
        case: contents_digest(
            [
                {key: value for key, value in asdict(case).items() if key not in ("part", "motion")},
                contents(case.sensors, case.variant, case.algorithm, case.frame),
                how,
            ]
        )
        for case in cases_of(part, motion)
    }


class StudyDirectory(Store):
    """The directory of a comparison of algorithms."""

    KIND = Kind(
        "comparison.json", (), "navigations", "sinssim comparison of algorithms", "a", "study",
        "navigation", "finished navigations",
    )  # fmt: skip

    def __init__(self, path: Path, study: Study, *, resume: bool = False, overwrite: bool = False) -> None:
        """Begin the directory of a study, or continue it, as `Store` does."""
        self._study = study
        super().__init__(path, resume=resume, overwrite=overwrite)

    def manifest(self) -> dict[str, Any]:
        return {"name": self._study.name, "versions": software()}

    def difference(self, there: dict[str, Any]) -> str:
        if there.get("name") != self._study.name:
            return f"is the study {there.get('name')}, not {self._study.name}"
        return other_software(there)

    @classmethod
    def computed(cls, path: Path) -> list[str]:
        folder = path / cls.KIND.folder
        return [f"{cls.KIND.folder}/{file.name}" for file in folder.glob("*.json") if is_part(file.name)]

    def read(self, case: Case, digest: str, say: Say) -> Navigated | None:
        """Return a finished navigation; None if it is not there."""
        kept = self.read_part(digest, say)
        if kept is None:
            return None
        numbers = {**kept["row"], "part": case.part, "motion": case.motion, "schedule_hz": case.schedule_hz}
        growth = None if kept["growth"] is None else ErrorGrowth(*map(_array, kept["growth"]))
        return Navigated(Row(**numbers), growth, [CoordinateError(case, *error) for error in kept["in_coordinates"]])

    def write(self, digest: str, navigated: Navigated) -> None:
        """Keep a finished navigation."""
        row, growth, in_coordinates = navigated
        contents = {
            "row": asdict(row),
            "growth": growth and [_text(getattr(growth, f.name)) for f in fields(growth)],
            "in_coordinates": [(e.coordinates, e.column, e.max_error, e.final_error) for e in in_coordinates],
        }
        self.write_part(digest, contents)

    def write_all(self, result: StudyResult) -> None:
        """Keep every navigation of a result."""
        rows, in_coordinates = {row.case: row for row in result.rows}, dict[Case, list[CoordinateError]]()
        for error in result.coordinate_errors:
            in_coordinates.setdefault(error.case, []).append(error)
        for part in result.study.parts:
            for motion in part.motions:
                for case, digest in digests(result.study, part, motion).items():
                    if case in rows:
                        growth = result.histories.get(case)
                        self.write(digest, Navigated(rows[case], growth, in_coordinates.get(case, [])))


def _text(values: Array) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode()


def _array(text: str) -> Array:
    return np.frombuffer(base64.b64decode(text), dtype="<f8").astype(float)
