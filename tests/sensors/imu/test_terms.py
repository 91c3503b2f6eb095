"""The table of error terms: units, words and limits of every row, written down here from their definitions."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

from sinssim.sensors.imu.datasheet_lines import to_si
from sinssim.sensors.imu.error_term_table import FIELDS, SLOTS, TERMS
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from tests.sensors.imu import write_fields

_DEG = math.pi / 180.0
_G = 9.80665
_RATE = {"deg_h": _DEG / 3600.0, "deg_s": _DEG, "mdeg_s": _DEG / 1000.0, "urad_s": 1e-6, "rad_s": 1.0}
_FORCE = {"ug": 9.80665e-6, "mg": 9.80665e-3, "g": _G, "mps2": 1.0}
_RATIO = {"ppm": 1e-6, "percent": 0.01}
_ANGLE = {"arcsec": _DEG / 3600.0, "arcmin": _DEG / 60.0, "mrad": 1e-3, "urad": 1e-6, "deg": _DEG}
_TIME = {"s": 1.0, "h": 3600.0}


def _per(above: dict[str, float], **below: float) -> dict[str, float]:
    return {f"{a}_per_{b}": x / y for a, x in above.items() for b, y in below.items()}


_DEG_S, _G2, _G3, _HOURS, _KELVIN = (
    {"deg_s": _DEG, "rad_s": 1.0},
    {"g2": _G**2},
    {"g3": _G**3},
    {"h": 3600.0, "s": 1.0},
    {"c": 1.0},
)
_ROWS: dict[str, tuple[dict[str, float], str, str, str, str, str]] = {
    # name: units, unit in words, SI unit, label, source, what a filter neglects
    "gyro_bias": (_RATE, "deg/h", "rad/s", "bias", "bias", ""),
    "accel_bias": (_FORCE, "µg", "m/s²", "bias", "bias", ""),
    "gyro_scale": (_RATIO, "ppm", "1", "scale factor", "scale factor", "scale factors"),
    "accel_scale": (_RATIO, "ppm", "1", "scale factor", "scale factor", "scale factors"),
    "gyro_misalignment": (_ANGLE, "arcsec", "rad", "tilt towards", "misalignment", "misalignments"),
    "accel_misalignment": (_ANGLE, "arcsec", "rad", "tilt towards", "misalignment", "misalignments"),
    "gyro_asymmetry": (_RATIO, "ppm", "1", "asymmetry", "non-linearity", "asymmetry"),
    "accel_asymmetry": (_RATIO, "ppm", "1", "asymmetry", "non-linearity", "asymmetry"),
    "gyro_quadratic": (
        _per(_RATIO, **_DEG_S), "ppm/(deg/s)", "1/(rad/s)", "scale factor, with the rate", "non-linearity",
        "quadratic terms",
    ),
    "accel_quadratic": (_per(_FORCE, **_G2), "µg/g²", "1/(m/s²)", "K₂", "non-linearity", "quadratic terms"),
    "gyro_cubic": (
        _per(_RATIO, deg2_s2=_DEG**2, rad2_s2=1.0), "ppm/(deg/s)²", "1/(rad/s)²", "scale factor, with its square",
        "non-linearity", "cubic terms",
    ),
    "accel_cubic": (_per(_FORCE, **_G3), "µg/g³", "1/(m/s²)²", "K₃", "non-linearity", "cubic terms"),
    "accel_cross_axis": (
        _per(_FORCE, **_G2), "µg/g²", "1/(m/s²)", "coupling with", "non-linearity", "cross-axis coupling",
    ),
    "gyro_g_sensitivity": (
        _per(_RATE, g=_G, mps2=1.0), "deg/h/g", "rad/s/(m/s²)", "g-sensitivity to", "g-sensitivity", "sensitivity to g",
    ),
    "gyro_bias_temperature": (
        _per(_RATE, **_KELVIN), "deg/h/°C", "rad/s/K", "bias, with temperature", "temperature", "",
    ),
    "accel_bias_temperature": (_per(_FORCE, **_KELVIN), "µg/°C", "m/s²/K", "bias, with temperature", "temperature", ""),
    "gyro_scale_temperature": (
        _per(_RATIO, **_KELVIN), "ppm/°C", "1/K", "scale factor, with temperature", "temperature",
        "scale factors' dependence on temperature",
    ),
    "accel_scale_temperature": (
        _per(_RATIO, **_KELVIN), "ppm/°C", "1/K", "scale factor, with temperature", "temperature",
        "scale factors' dependence on temperature",
    ),
    "gyro_ramp": (_per(_RATE, **_HOURS), "deg/h/h", "rad/s/s", "growth of the bias", "ramp", ""),
    "accel_ramp": (_per(_FORCE, **_HOURS), "µg/h", "m/s²/s", "growth of the bias", "ramp", ""),
    # 1 °/√h is a degree in 3600 s, over √3600 s; 1 °/h/√Hz is 1 °/h times √s
    "gyro_arw": (
        {"deg_sqrt_h": _DEG / 60.0, "deg_h_sqrt_hz": _DEG / 3600.0, "deg_s_sqrt_hz": _DEG,
         "mdeg_s_sqrt_hz": _DEG / 1000.0, "rad_s_sqrt_hz": 1.0},
        "deg/√h", "rad/√s", "angle random walk", "random walk", "",
    ),
    "accel_vrw": (
        {"ug_sqrt_hz": 9.80665e-6, "mg_sqrt_hz": 9.80665e-3, "mps_sqrt_h": 1.0 / 60.0,
         "ftps_sqrt_h": 0.3048 / 60.0, "mps2_sqrt_hz": 1.0},
        "µg/√Hz", "m/s/√s", "velocity random walk", "random walk", "",
    ),
    "gyro_quantum": (_ANGLE, "arcsec", "rad", "pulse weight", "quantisation", ""),
    "accel_quantum": ({"mm_s": 1e-3, "mps": 1.0}, "mm/s", "m/s", "pulse weight", "quantisation", ""),
    "gyro_instability": (_RATE, "deg/h", "rad/s", "bias instability, 1σ", "bias instability", ""),
    "accel_instability": (_FORCE, "µg", "m/s²", "bias instability, 1σ", "bias instability", ""),
    "gyro_correlation_time": (_TIME, "s", "s", "", "", ""),
    "accel_correlation_time": (_TIME, "s", "s", "", "", ""),
    "gyro_flicker": (_RATE, "deg/h", "rad/s", "flicker B", "flicker", ""),
    "accel_flicker": (_FORCE, "µg", "m/s²", "flicker B", "flicker", ""),
    "gyro_rrw": (
        {"deg_h_sqrt_h": _DEG / 3600.0 / 60.0, "rad_s_sqrt_s": 1.0}, "deg/h/√h", "rad/s/√s", "rate random walk",
        "rate random walk", "",
    ),
    "accel_rrw": (
        {"ug_sqrt_h": 9.80665e-6 / 60.0, "mps2_sqrt_s": 1.0}, "µg/√h", "m/s²/√s", "rate random walk",
        "rate random walk", "",
    ),
    "gyro_range": ({"deg_s": _DEG, "rad_s": 1.0}, "deg/s", "rad/s", "range ±", "", "range"),
    "accel_range": ({"g": _G, "mps2": 1.0}, "g", "m/s²", "range ±", "", "range"),
}  # fmt: skip


def test_those_of_the_gyros_come_first() -> None:
    names = [term.name for term in TERMS]
    assert set(_ROWS) <= set(names)
    assert [name.startswith("gyro") for name in names] == sorted(
        (name.startswith("gyro") for name in names), reverse=True
    )


@pytest.mark.parametrize("term", [term for term in TERMS if term.name in _ROWS], ids=lambda term: term.name)
def test_units_and_words(term) -> None:
    units, written, si, label, source, untold = _ROWS[term.name]
    assert list(term.units) == list(units)
    for unit, size in units.items():
        assert term.units[unit] == pytest.approx(size, rel=1e-12), unit
        assert to_si(f"{term.name}_{unit}", 2.5) == pytest.approx(2.5 * size, rel=1e-12)
        if term.drawn:
            assert to_si(f"{term.name}_sigma_{unit}", 2.5) == pytest.approx(2.5 * size, rel=1e-12)
    assert (term.written_unit, term.written_si_unit) == (written, si)
    assert (term.label, term.source, term.untold) == (label, source, untold)


def test_limits_and_values_without_any() -> None:
    """1000 °/s, 100 g, the whole input, a whole turn; a scale factor above −1, tilts up to 40 000″, 1σ to a quarter."""
    most = {name.partition("_")[2]: term.most for name, term in ((t.name, t) for t in TERMS) if name.startswith("gyro")}
    assert most["bias"] == most["flicker"] == most["bias_temperature"] == 1000.0 * 3600.0
    assert most["range"] == 1000.0 * 3600.0  # in °/s, as loose as for °/h
    assert most["scale"] == most["quadratic"] == 1e6
    assert most["misalignment"] == most["quantum"] == 360.0 * 3600.0
    assert most["correlation_time"] == 1e9
    forces = {term.name: term.most for term in TERMS if term.triad == "accel"}
    assert forces["accel_bias"] == forces["accel_vrw"] == forces["accel_cubic"] == 100.0 * 1e6
    assert (forces["accel_quantum"], forces["accel_range"]) == (1e8, 1e6)
    by_name = {term.name: term for term in TERMS}
    for triad in ("gyro", "accel"):
        tilt = by_name[f"{triad}_misalignment"]
        assert (dict(tilt.limits), dict(tilt.sigma_limits)) == ({"ge": -4e4, "le": 4e4}, {"ge": 0.0, "le": 1e4})
        assert dict(by_name[f"{triad}_scale"].limits) == {"gt": -1e6}
        assert (
            dict(by_name[f"{triad}_range"].limits) == {"gt": 0.0} == dict(by_name[f"{triad}_correlation_time"].limits)
        )
        assert by_name[f"{triad}_correlation_time"].without == 3600.0
    assert {term.name for term in TERMS if term.without} == {"gyro_correlation_time", "accel_correlation_time"}
    assert [term.name for term in TERMS if term.default is not None] == ["accel_quantum"]
    calibrated = {"bias", "scale", "misalignment", "asymmetry", "quadratic", "cubic", "cross_axis", "g_sensitivity"}
    calibrated |= {"bias_temperature", "scale_temperature"}
    assert {term.field for term in TERMS if term.calibrated} >= calibrated
    sizes = {"bias": 3, "misalignment": 6, "cross_axis": 6, "g_sensitivity": 9, "random_walk": 1, "ramp": 3}
    assert {term.field: term.size for term in TERMS if term.field in sizes} == sizes


def test_what_the_fields_are() -> None:
    about = {term.name: term.about for term in TERMS}
    assert about["gyro_bias"] == "output at zero input, constant in a run, (3,) rad/s or m/s²."
    assert about["accel_misalignment"] == "tilt of a sensitive axis towards each of the others, (3, 3) rad."
    assert about["gyro_arw"] == "white noise: random walk of the angle, growing with √t, rad/√s or m/s/√s."
    assert about["gyro_g_sensitivity"] == "apparent rate due to an acceleration, (3, 3) rad/s/(m/s²)."


def test_the_fields_that_are_written_out_are_those_of_the_table() -> None:
    """`python -m tests.sensors.imu.write_fields` writes them."""
    assert write_fields.FILE.read_text(encoding="utf-8") == write_fields.text()
    written = {field.name: field for field in fields(TriadErrors)}
    assert list(written) == list(SLOTS)
    for name, term in FIELDS.items():
        np.testing.assert_array_equal(getattr(TriadErrors(), name), term.nothing())
        assert written[name].type == ("Array" if term.drawn else "float")
