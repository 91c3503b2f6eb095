"""Names of a study's rows, lines and sensors in its tables and figures."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

from sinssim.experiments.studies.results import Pick, Row
from sinssim.experiments.studies.schema import Part, Study
from sinssim.sensors.imu.imu import Imu

Label = Callable[[Row], str]

_DIMENSIONS = ("algorithm", "frame", "curvature", "gravity", "ellipsoid", "sensors", "variant")
_SHOWN_HZ = 50.0
_FIXED = r"(gyro|accel)_(bias_(deg_h|ug)|scale_ppm|misalignment_arcsec)"  # errors that are given, not drawn
_RATES_FOR_LINES = 3  # number of rates from which errors are drawn over the rate


def varying(rows: Sequence[Row]) -> tuple[str, ...]:
    """Return the dimensions in which rows differ, apart from motion and rate.

    Returns:
        Names of the attributes of `Row`.
    """
    return tuple(d for d in _DIMENSIONS if len({getattr(row, d) for row in rows}) > 1)


def labeller(rows: Sequence[Row], pace: bool = False) -> Label:
    """Return a function that labels rows of one motion by their differences, with the `pace` if it is wanted."""
    dimensions = varying(rows)
    several = pace and len({row.pace for row in rows}) > 1

    def label(row: Row) -> str:
        parts = [str(getattr(row, d)) for d in dimensions] + ([f"{row.pace} Hz"] if several else [])
        return " · ".join(parts) or row.algorithm

    return label


def over_rates(part: Part) -> bool:
    """Return whether a part is best drawn as lines over the rate."""
    return len(part.rates_hz) >= _RATES_FOR_LINES and not part.schedules_hz


def line_labeller(part: Part, rows: Sequence[Row]) -> Label:
    """Return a function that names lines: a schedule has its own name, the plain rates of an engine share one."""
    return labeller(rows, pace=bool(part.schedules_hz))


def at_one_rate(rows: Sequence[Row]) -> list[Row]:
    """Return the rows whose errors are drawn over time: schedules, and plain rates at the one nearest to 50 Hz."""
    scheduled = [row for row in rows if row.schedule_hz]
    if scheduled or not rows:
        return scheduled
    rate = min((row.rate_hz for row in rows), key=lambda hz: abs(math.log(hz / _SHOWN_HZ)))
    return [row for row in rows if row.rate_hz == rate]


def one_draw(part: Part, study: Study) -> str:
    """State that a part compares sensors by one draw of their errors.

    Returns:
        A few sentences; "" for a part with one sensor set or without random errors.
    """
    if len(part.sensors) * len(part.variants) < 2 or all(_is_certain(study.block(name)) for name in part.sensors):
        return ""
    return (
        f"The sensors are compared on one draw of their errors (seed {study.seed}). A single run may be several times "
        "better or worse than its 1σ, and another seed may reverse the order of two sets of sensors. Engines "
        "that share a draw can be compared; for the sensors run other seeds, or `sinssim sensors GRADE` for the 1σ."
    )


def _is_certain(block: Imu) -> bool:
    """Return whether a block has no random errors: no grade, and nothing given but errors of fixed size."""
    given = block.model_fields_set - {"grade", "rate_hz", "sensor_set"}
    return block.grade == "ideal" and all(re.fullmatch(_FIXED, name) for name in given)


def sensors_of(pick: Pick) -> str:
    """Describe the sensors of a pick.

    Returns:
        The grade, and the variant if it is not the default.
    """
    return pick.sensors if pick.variant == "rate-gyros" else f"{pick.sensors}, {pick.variant}"
