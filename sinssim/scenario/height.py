"""Describes the height reference of a scenario, because pure inertial height is unstable."""

from __future__ import annotations

import math

from sinssim.scenario.tables import Tables
from sinssim.sensors.aiding.baro import Barometer

_E_FOLD_S = math.sqrt(6.371e6 / (2.0 * 9.81))
"""√(R/2g): time in which an error of unaided height grows e-fold, s. Gravity falls by 2g/R per metre."""


def height_words(scenario: Tables) -> str:
    """Describe the height reference and its effect on the horizontal solution."""
    navigation, aiding = scenario.navigation, scenario.aiding
    if navigation.vertical == "free":
        return (
            f"free; its errors grow e-fold in {_E_FOLD_S / 60.0:.1f} min and eventually degrade the horizontal "
            'solution, too (navigation.vertical = "baro-loop" stabilises it)'
        )
    if navigation.vertical == "truth":
        return "the true height: the height has no error and does not affect the horizontal solution"
    held = (
        f"stabilised by a baro loop with a time constant of {navigation.baro_time_constant_s:g} s, which prevents a "
        f"growing height error from degrading the horizontal solution"
    )
    if aiding is not None and aiding.sensor(Barometer) is not None:
        return f"{held}; its error is that of [aiding.baro]"
    return f"{held}; without [aiding.baro], its reference is a perfect altimeter (the true height)"
