"""Writes `sinssim/sensors/imu/generated_imu_keys.py`: what follows from the table of terms, so that editors show it.

python -m tests.sensors.imu.write_fields
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from sinssim.sensors.imu import error_term_table
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import FIELDS, SLOTS, TERMS

FILE = Path(error_term_table.__file__).with_name("generated_imu_keys.py")

_WIDTH = 120
_HEAD = '''"""The fields that follow from the table of terms: the errors of a triad, and the keys of error terms.

This file is written by `python -m tests.sensors.imu.write_fields`; edit
`sinssim/sensors/imu/error_term_table.py` instead.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from pydantic import Field

from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.sensors.imu.datasheet_lines import ErrorTable
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import FIELDS, SLOTS
from sinssim.toml_section import NotNegative, Positive


@dataclass(frozen=True, kw_only=True)
class TriadErrors:
    """The errors of three gyros or three accelerometers, SI; all zero unless given.

    `sinssim.sensors.imu.emulation` describes the effect of each.

    Attributes:
'''
_SIGMA = """
_SIGMA = (
    "1σ of the random error of the same name, added to the given one; default: that of the grade, or 0 if an error is "
    "given"
)
_MEASURED = "measured calibration value, which is subtracted; the next key is its uncertainty"
"""
_CONVERSION = '''
    def __post_init__(self) -> None:
        """Convert lists and integers to arrays and numbers of doubles, and refuse other objects by name."""
        for name in SLOTS:
            value = getattr(self, name)
            if type(value) is float or (type(value) is np.ndarray and value.dtype == np.float64):
                continue
            array = numbers(f"TriadErrors: {name}", value)
            object.__setattr__(self, name, float(array) if array.ndim == 0 else array)

    @property
    def acting(self) -> list[tuple[ErrorTerm, Array]]:
        """The rows of the table whose values multiply something in the readings and are not all zero, with these."""
        given = ((term, getattr(self, name)) for name, term in FIELDS.items() if term.multiplies is not None)
        return [(term, value) for term, value in given if np.count_nonzero(value)]
'''
_SENSORS = {"gyro": "gyros", "accel": "accelerometers"}
_SIZES = {3: "Three", 6: "Six", 9: "Nine"}


def text() -> str:
    """Return the text of the file."""
    parts = [_HEAD]
    parts += [_wrapped(f"{name}: {FIELDS[name].about}") for name in SLOTS]
    parts.append('    """\n\n')
    for name in SLOTS:
        term = FIELDS[name]
        shape = term.shape[0] if len(term.shape) == 1 else term.shape
        parts.append(
            f"    {name}: Array = field(default_factory=lambda: np.zeros({shape}))\n"
            if term.drawn
            else f"    {name}: float = {term.without}\n"
        )
    parts += [_CONVERSION, "\n\n", *_types(), _SIGMA]
    parts += _table("ImuKeys", "The keys of the error terms of a sensor block.", map(_of_block, TERMS))
    calibrated = (_of_calibration(term) for term in TERMS if term.calibrated)
    parts += _table("CompensationKeys", "The keys of the error terms that a calibration determines.", calibrated)
    return "".join(parts)


def _wrapped(line: str) -> str:
    return textwrap.fill(line, _WIDTH, initial_indent=" " * 8, subsequent_indent=" " * 12) + "\n"


def _types() -> Iterator[str]:
    """Yield the types of numbers with limits, named after the first error that has them, and of several of them."""
    made = set(_NAMES.values())
    for term in TERMS:
        for limits, ending in ((term.limits, ""), (term.sigma_limits, "Sigma")):
            written = _limits(limits)
            if written not in _NAMES:
                name = _NAMES[written] = "".join(part.title() for part in term.field.split("_")) + ending
                yield f"{name} = Annotated[float, Field({written})]\n"
        if term.drawn and (name := _several(term)) not in made:
            made.add(name)
            yield f"{name} = tuple[{', '.join([_NAMES[_limits(term.limits)]] * term.size)}]\n"


def _limits(limits: Mapping[str, float]) -> str:
    return ", ".join(f"{name}={float(limit)}" for name, limit in limits.items())


_NAMES = {"": "float", "ge=0.0": "NotNegative", "gt=0.0": "Positive"}
"""Type of a number by its limits."""


def _several(term: ErrorTerm) -> str:
    return _NAMES[_limits(term.limits)].removeprefix("float") + _SIZES[term.size]


def _of_block(term: ErrorTerm) -> Iterator[str]:
    """Yield the keys of a term in [imu]."""
    if term.drawn:
        yield _key(term.key, f"{_several(term)} | None", None, term.explanation)
        yield _key(term.sigma_key, f"{_NAMES[_limits(term.sigma_limits)]} | None", None, "_SIGMA")
    else:
        optional = " | None" if term.default is None else ""
        yield _key(term.key, _NAMES[_limits(term.limits or {"ge": 0.0})] + optional, term.default, term.explanation)


def _of_calibration(term: ErrorTerm) -> Iterator[str]:
    """Yield the keys of a term in [compensation]: calibrated value, and 1σ of its error."""
    yield _key(term.key, f"{_several(term)} | None", None, "_MEASURED")
    error = f"1σ of the calibration error of the {_SENSORS[term.triad]}: {term.untold or term.explanation}"
    yield _key(term.sigma_key, _NAMES[_limits(term.sigma_limits)], 0.0, error)


def _table(name: str, about: str, keys: Iterable[Iterable[str]]) -> Iterator[str]:
    yield f'\n\nclass {name}(ErrorTable):\n    """{about}"""\n\n'
    for of_term in keys:
        yield from of_term


def _key(name: str, kind: str, default: float | None, description: str) -> str:
    """Return a field, in the layout of ruff."""
    head, first = f"    {name}: {kind} = Field(", f"default={default}, "
    if description not in ("_SIGMA", "_MEASURED"):
        description = f'"{description}"'
    whole = f"{first}description={description}"
    if len(head + whole) < _WIDTH:
        return f"{head}{whole})\n"
    if len(whole) + 8 <= _WIDTH:
        return f"{head}\n        {whole}\n    )\n"
    lines = textwrap.wrap(description.strip('"'), _WIDTH - 25)
    written = ' "\n        "'.join(lines)
    return f'{head}\n        default={default},\n        description="{written}",\n    )\n'


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
