"""One grade of inertial measurement units, and its TOML file: 1σ values by the keys of [imu], with their source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, create_model, model_validator

from sinssim.section import Sentence
from sinssim.sensors.imu.datasheet import ErrorTable, to_si
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.terms import TERMS
from sinssim.toml_file import read_toml, validate

SUFFIX = ".toml"
"""End of the name of a grade's file; the names of other grades do not end so."""

_OF_THE_BLOCK = (
    *(f"{term.name}_{unit}" for term in TERMS if term.default is not None for unit in term.units),
    *("rate_hz", "sensor_set", "lever_arm_m", "mounting_deg", "temperature_start_c", "temperature_steady_c"),
    *("warm_up_time_s", "accel_arms_mm", "accel_delay_ms", "laser_gyro", "faults", "rotation"),
)

_Source = Annotated[str, Field(min_length=10, max_length=2000)]


@dataclass(frozen=True)
class TriadGrade:
    """The errors of the three gyros or of the three accelerometers of one grade, SI.

    Attributes:
        bias: 1σ of the turn-on bias, rad/s or m/s².
        scale: 1σ of the relative scale-factor error.
        misalignment: 1σ of each of the six angles of the sensitive axes, rad.
        random_walk: angle or velocity random walk N, rad/√s or m/s/√s.
        instability: 1σ of the bias instability (first-order Gauss-Markov), rad/s or m/s².
        others: 1σ or value of the other terms by their field of `TriadErrors`, SI.
    """

    bias: float = 0.0
    scale: float = 0.0
    misalignment: float = 0.0
    random_walk: float = 0.0
    instability: float = 0.0
    others: Mapping[str, float] = field(default_factory=dict)

    def of(self, term: ErrorTerm) -> float:
        """Return the grade's value of one error term.

        Returns:
            The 1σ of an error that differs from run to run, the value of any other, SI; the term's own value without
            any if the grade does not have it.
        """
        return float(getattr(self, term.field)) if term.field in _FIELDS else self.others.get(term.field, term.without)


_MAIN = ("bias", "scale", "misalignment", "random_walk")
"""Errors that every sensor has; a source that does not say them is told."""

_FIELDS = {one.name for one in fields(TriadGrade)} - {"others"}


@dataclass(frozen=True)
class Grade:
    """One row of the table, or one file.

    Attributes:
        description: one sentence.
        source: the public documents with the figures, and the figures from elsewhere.
        gyro: the three gyros.
        accel: the three accelerometers.
    """

    description: str
    source: str
    gyro: TriadGrade
    accel: TriadGrade


def of_grades(term: ErrorTerm) -> bool:
    """Return whether a grade's file can have an error term.

    Returns:
        False for a term whose key in [imu] has a default of its own, which would hide the grade's value.
    """
    return term.default is None


def grade_key(term: ErrorTerm) -> str:
    """Return the key of an error term in a grade's file.

    Returns:
        The key of the 1σ of an error that differs from run to run, the only key of any other.
    """
    return term.sigma_key if term.drawn else term.key


def _number(term: ErrorTerm) -> Any:
    limits = dict[str, Any](term.sigma_limits if term.drawn else term.limits or {"ge": 0.0})
    return Annotated[float, Field(**limits)] | None


_KEYS = {grade_key(term): (_number(term), Field(default=None)) for term in TERMS if of_grades(term)}
_Terms: Any = create_model("_Terms", __base__=ErrorTable, **dict[str, Any](_KEYS))


class _GradeFile(_Terms):  # type: ignore[misc]
    """A grade's file: a sentence, the source of its numbers, and the numbers by the keys of [imu]."""

    description: Sentence = Field(description="a sentence about the IMU, shown in lists and reports")
    source: _Source = Field(description="source of the values, for example a data sheet and its page")
    assumed: tuple[Sentence, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _no_block(cls, data: Any) -> Any:
        for key in data if isinstance(data, dict) else ():
            if key in _OF_THE_BLOCK:
                raise ValueError(f"{key} is not part of a grade: give it in the scenario's [imu]")
        return data


def read_grade(file: Path) -> Grade:
    """Read a grade's file.

    Args:
        file: a TOML file with `description`, `source`, optionally `assumed`, which lists what the source does not
            say, and error terms by the keys of [imu]: of an error that differs from run to run the 1σ.

    Returns:
        The grade. A term that the file does not have is zero.

    Raises:
        InputError: the file cannot be read or has mistakes; the message lists them by line and key.
    """
    try:
        stat = file.stat()
    except OSError:
        read_toml(file)  # its message says why
        raise
    return _read(file, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=64)
def _read(file: Path, _changed: int, _size: int) -> Grade:
    """Read a file once for each state of it, because every error term of every run asks for the grade."""
    text, data = read_toml(file)
    given = validate(_GradeFile, data, text, str(file))
    triads: dict[str, dict[str, float]] = {"gyro": {}, "accel": {}}
    for term in TERMS:
        value = getattr(given, grade_key(term), None)
        if value is not None:
            triads[term.triad][term.field] = to_si(grade_key(term), value)
    parts = [given.source.strip(), *(f"assumed: {sentence}" for sentence in given.assumed)]
    silent = [term.name for term in TERMS if term.field in _MAIN and term.field not in triads[term.triad]]
    if silent:
        parts.append(f"not given and therefore zero: {', '.join(silent)}")
    source = "; ".join(parts)
    return Grade(given.description, source, _triad(triads["gyro"]), _triad(triads["accel"]))


def _triad(values: Mapping[str, float]) -> TriadGrade:
    own = {name: value for name, value in values.items() if name in _FIELDS}
    return TriadGrade(**own, others={name: value for name, value in values.items() if name not in _FIELDS})
