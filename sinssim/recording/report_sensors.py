"""The part of a run's report on the sensors: the errors of each axis, and what they were drawn from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sinssim import units
from sinssim.data import Array
from sinssim.recording import page
from sinssim.recording.page import signed, table, words
from sinssim.scenario.grades import find_grade
from sinssim.sensors.imu_errors import TriadErrors, draw

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.scenario.grades import TriadGrade

_DIGITS = 4
_AXES = ("x (forward)", "y (right)", "z (down)")


def sensor_errors(scenario: Scenario) -> Iterator[str]:
    """Return the section on the sensors: what this run's seed drew, and from what.

    Args:
        scenario: what is run.

    Yields:
        HTML.
    """
    section, grade = scenario.imu, find_grade(scenario.imu.grade)
    errors = draw(section, scenario.seed)
    yield (
        f"<p>Grade <strong>{words(section.grade)}</strong>: {words(grade.description)}. Each axis' error is what this "
        f"run's seed {scenario.seed} drew from a normal distribution of the given 1σ, or what the scenario gives.</p>"
    )
    heads = ("", "unit", *_AXES, "1σ")
    yield '<div class="pair"><div><h3>Gyros</h3>'
    yield table(heads, _triad(errors.gyro, grade.gyro, section.model_dump(), "gyro", units.DEG_H, "deg/h"), 2)
    yield _noises(
        ("angle random walk", errors.gyro.random_walk, units.DEG_SQRT_H, "deg/√h"),
        ("bias instability, 1σ", errors.gyro.instability, units.DEG_H, "deg/h"),
        ("pulse weight", errors.gyro.quantum, units.ARCSEC, "arcsec"),
    )
    yield "</div><div><h3>Accelerometers</h3>"
    yield table(heads, _triad(errors.accel, grade.accel, section.model_dump(), "accel", units.UG, "µg"), 2)
    yield _noises(
        ("velocity random walk", errors.accel.random_walk, units.UG, "µg/√Hz"),
        ("bias instability, 1σ", errors.accel.instability, units.UG, "µg"),
        ("pulse weight", errors.accel.quantum, 1e-3, "mm/s"),
    )
    yield "</div></div>"


def _triad(
    errors: TriadErrors, grade: TriadGrade, section: Mapping[str, Any], kind: str, bias: float, unit: str
) -> Iterator[Sequence[str]]:
    """Return the rows of one triad: turn-on errors per axis, and what they were drawn from."""

    def sigma(term: str, name: str, of_grade: float) -> str:
        if section[f"{kind}_{term}_{name}"] is not None:
            return "given"
        own = section[f"{kind}_{term}_sigma_{name}"]
        return f"{of_grade if own is None else own:.6g}"

    def row(title: str, unit: str, values: Array, spread: str) -> Sequence[str]:
        return (title, unit, *(signed(float(v), _DIGITS) for v in values), spread)

    name = {"deg/h": "deg_h", "µg": "ug"}[unit]
    yield row("bias", unit, errors.bias / bias, sigma("bias", name, grade.bias / bias))
    yield row("scale factor", "ppm", errors.scale / units.PPM, sigma("scale", "ppm", grade.scale / units.PPM))
    tilts = errors.misalignment / units.ARCSEC
    spread = sigma("misalignment", "arcsec", grade.misalignment / units.ARCSEC)
    for j, axis in enumerate("xyz"):
        cells = [signed(float(tilts[i, j]), _DIGITS) if i != j else "" for i in range(3)]
        yield (f"tilt towards {axis}", "arcsec", *cells, spread)


def _noises(*terms: tuple[str, float, float, str]) -> str:
    said = [f"{name} {value / size:.6g} {unit}" for name, value, size, unit in terms if value]
    return f'<p class="note">{page.capital(", ".join(said) or "no noise")}.</p>'
