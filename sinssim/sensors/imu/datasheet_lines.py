"""Converts lines of data sheets to SI: splits keys into error term and unit, and knows the words of data sheets."""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from functools import cache
from typing import Any, NamedTuple

from pydantic import ValidationInfo, field_validator

from sinssim.errors import InputError, respelled
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.toml_section import Section

_BY_NAME = {term.name: term for term in TERMS}


class DatasheetLine(NamedTuple):
    """One line of a datasheet."""

    term: ErrorTerm  # the error term
    sigma: bool  # whether the line gives the 1σ of a random error instead of the error itself
    factor: float  # size of its unit in SI

    @property
    def key(self) -> str:
        """Key in the unit of scenarios."""
        return self.term.sigma_key if self.sigma else self.term.key


@cache
def line(key: str) -> DatasheetLine | None:
    """Split a key, for example "gyro_arw_deg_sqrt_h" or "accel_bias_sigma_mg", into error term and unit; None if it is
    not the key of an error term."""
    for name in sorted(_BY_NAME, key=len, reverse=True):  # gyro_bias_temperature before gyro_bias
        if key.startswith(f"{name}_"):
            term, unit = _BY_NAME[name], key.removeprefix(f"{name}_")
            sigma = term.drawn and unit.startswith("sigma_")
            unit = unit.removeprefix("sigma_") if sigma else unit
            if unit not in term.units:
                raise InputError(f"{name} cannot be given in {unit!r}; known units: {', '.join(term.units)}.")
            return DatasheetLine(term, sigma, term.units[unit])
    return None


def to_si(key: str, value: float) -> float:
    """Convert a number of a data sheet to SI.

    Args:
        key: quantity and unit as in a scenario, for example "accel_vrw_mps_sqrt_h".

    Returns:
        The number in SI, as in `TriadErrors`.
    """
    stated = line(key)
    if stated is None:
        raise InputError(f"unknown quantity in {key!r}; known: {', '.join(_BY_NAME)}, each followed by a unit.")
    if not math.isfinite(value):
        raise InputError(f"{key} = {value} is not a finite number.")
    return value * stated.factor


def not_absurd(key: str, value: Any) -> Any:
    """Refuse an absurdly large error. `value`: a number, several, or None."""
    stated = line(key)
    if stated is not None and value is not None:
        most = stated.term.most
        for number in value if isinstance(value, tuple) else (value,):
            if not abs(number) <= most:
                raise ValueError(
                    f"{number:g} is larger than that of any sensor; its magnitude must be at most {most:g}"
                )
    return value


def _times(value: Any, factor: float) -> Any:
    """Multiply numbers at any depth; other values stay unchanged, and the schema refuses them."""
    if isinstance(value, list | tuple):
        return tuple(_times(item, factor) for item in value)
    if not isinstance(value, int | float) or isinstance(value, bool):
        return value
    try:
        return float(value) * factor
    except OverflowError:  # an integer of hundreds of digits
        return -math.inf if value < 0 else math.inf


_SENSORS = {
    "gyroscope": "gyro",
    "gyr": "gyro",
    "gyro": "gyro",
    "accelerometer": "accel",
    "acc": "accel",
    "accel": "accel",
}
_NOT_PART = re.compile(r"_(sigma|1sigma|one_sigma|1s|rms|max|maximum|typ|typical|error|errors|value)$")

# Words of data sheets without underscores, and the field of `TriadErrors` that they mean.
_WORDS = {
    "bias": "bias biasrepeatability biasoffset turnonbias turnontoturnonbias turnonbiasrepeatability runtorunbias "
    "initialbias constantbias staticbias biasontooff zerorateoffset zerorateoutput zerogoffset zerogbias offset "
    "daytodaybias residualbias",
    "scale": "scale scalefactor sf scalefactorrepeatability scalefactoraccuracy scalefactorstability "
    "scalefactortolerance sensitivity sensitivitytolerance sensitivityaccuracy initialsensitivity",
    "misalignment": "misalignment axismisalignment axistoaxismisalignment axisalignment alignment nonorthogonality "
    "orthogonality axisorthogonality crossaxissensitivity crosscoupling crossaxiscoupling sensormisalignment",
    "random_walk": "arw vrw anglerandomwalk angularrandomwalk velocityrandomwalk randomwalk noise noisedensity "
    "whitenoise ratenoisedensity ratenoise noisespectraldensity accelerationnoisedensity",
    "flicker": "biasinstability inrunbias inrunbiasstability inrunbiasinstability biasstability inrunstability "
    "flickernoise flicker inrunbiasvariation zerooffsetinstability biasinrunstability biasinruninstability biasinrun",
    "instability": "instability",
    "rrw": "rrw raterandomwalk accelerationrandomwalk biasrandomwalk",
    "g_sensitivity": "gsensitivity gsens gdependentbias gbias linearaccelerationeffect linearaccelerationsensitivity "
    "accelerationsensitivity gdependentdrift biasduetoacceleration",
    "quadratic": "nonlinearity linearity scalefactornonlinearity scalefactorlinearity sflinearity quadratic k2 g2term "
    "g2 gsquared gsquaredterm gsquaredsensitivity g2sensitivity secondordernonlinearity vibrationrectification vre vrc",
    "asymmetry": "asymmetry scalefactorasymmetry",
    "bias_temperature": "tco biasovertemperature biastemperaturecoefficient biastemperaturesensitivity biastemperature "
    "offsettemperaturecoefficient temperaturecoefficientofoffset",
    "scale_temperature": "tcs scalefactorovertemperature sensitivitytemperaturecoefficient scaletemperature "
    "scalefactortemperaturecoefficient scalefactortemperature",
    "range": "range fullscale fullscalerange dynamicrange measurementrange inputrange",
    "quantum": "quantum resolution quantisation quantization pulseweight lsb",
}
_MEANING = {word: name for name, words in _WORDS.items() for word in words.split()}


def in_words(key: str, known: Collection[str]) -> str | None:
    """Return the key that means a word of data sheets, for example "gyro_bias_repeatability_deg_h" or "noise_density":
    a sentence's end that names the key for it and says what to mind; None if the key is no such word."""
    key = respelled(key)
    first, _, rest = key.partition("_")
    triads = (_SENSORS[first],) if first in _SENSORS else ("gyro", "accel")
    words, unit = _without_unit(rest if first in _SENSORS else key)
    name = _MEANING.get(words.replace("_", ""))
    if name is None:
        return None
    if len(triads) == 2 and words.replace("_", "") in ("vrw", "velocityrandomwalk"):
        triads = ("accel",)
    if len(triads) == 2 and (name == "g_sensitivity" or words.replace("_", "") in ("arw", "angularrandomwalk")):
        triads = ("gyro",)
    if triads == ("gyro",) and name == "quadratic" and re.match(r"g_?(2|squared)|v", words):
        return "sinssim has no error of gyros in the square of the acceleration; gyro_g_sensitivity is the linear one"
    meant = [_key_of(triad, name, unit, known) for triad in triads]
    keys = " or ".join(key for key in meant if key)
    return _hint(name, triads, unit).format(keys=keys) if keys else None


def _without_unit(words: str) -> tuple[str, str]:
    """Split words of a data sheet from a unit at their end; the unit is "" if there is none."""
    units = {respelled(unit): unit for term in TERMS for unit in term.units}
    short = max((short for short in units if words.endswith(f"_{short}")), key=len, default="")
    words, unit = (words.removesuffix(f"_{short}"), units[short]) if short else (words, "")
    while (shorter := _NOT_PART.sub("", words)) != words:
        words = shorter
    return words, unit


def _key_of(triad: str, name: str, unit: str, known: Collection[str]) -> str | None:
    """Return the key of a term in the given unit, or in the scenario's if it cannot have that unit."""
    for term in TERMS:
        if term.triad == triad and (term.field == name or term.name == f"{triad}_{name}"):
            key = term.sigma_key if term.drawn else term.key
            if key not in known:
                return None
            return key.removesuffix(next(iter(term.units))) + unit if unit in term.units else key
    return None


def _hint(name: str, triads: tuple[str, ...], unit: str) -> str:
    """Return the end of the sentence; "{keys}" stands for the keys."""
    if name == "flicker":
        others = " or ".join(f"{triad}_instability_{'deg_h' if triad == 'gyro' else 'ug'}" for triad in triads)
        return (
            "it is {keys}, the lowest point of the Allan deviation divided by 0.664 (IEEE Std 952); or, as the 1σ of a "
            f"Gauss-Markov process, {others}"
        )
    if name == "quadratic":
        return "it is {keys}: the departure from a straight line at an input, over the square of that input"
    if name == "random_walk" and not unit:
        dense = {"gyro": "gyro_arw_deg_s_sqrt_hz", "accel": "accel_vrw_mps_sqrt_h"}
        return "it is {keys}; or, in another unit, " + " or ".join(dense[triad] for triad in triads)
    if name in ("scale", "misalignment", "bias", "asymmetry", "g_sensitivity"):
        return "it is {keys}, the 1σ of an error that differs from run to run"
    return "it is {keys}"


class ErrorTable(Section):
    """A table with error terms: their units may be any of data sheets, and absurdly large errors are refused."""

    @classmethod
    def normalized(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Convert errors in other units to the table's; a key with an unknown unit stays, and the schema refuses it."""
        converted: dict[str, Any] = {}
        for key, value in data.items():
            try:
                stated = None if key in cls.model_fields else line(key)
            except InputError:
                stated = None
            if stated is not None:
                key, value = stated.key, _times(value, stated.factor / stated.term.unit)
            if key in converted:
                raise ValueError(f"{key} is given twice, in two units: keep one of them")
            converted[key] = value
        return converted

    @field_validator("*")
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd(str(info.field_name), value)

    @classmethod
    def key_for(cls, given: str) -> str | None:
        """Return the field for an error term in another unit."""
        stated = line(given)
        return None if stated is None else stated.key

    @classmethod
    def in_words(cls, unknown: str) -> str | None:
        """Return the error term that a word of data sheets means."""
        return in_words(unknown, cls.model_fields)
