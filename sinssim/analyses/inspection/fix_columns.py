"""Guesses which columns of a text file are the fixes of a satellite receiver, and their units: names, then numbers.

Names decide where there are some. Without names, two neighbouring columns that change little and smoothly are latitude
and longitude, the next one is the height, and velocities, or speed and course, are the columns that agree with the
differences of these positions, which also gives their unit, order and signs.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from sinssim.analyses.inspection.inertial_columns import is_unix
from sinssim.analyses.inspection.text_columns import TextTable
from sinssim.data import Array
from sinssim.logs.column_names import (
    TIME_UNITS,
    UNITS_OF,
    epoch_unit,
    means,
    quantity,
    says_other,
    says_time,
    triads,
    unit_in_name,
    unit_of,
)

_NO_HEIGHT = re.compile(r"wave|geoid|undul|separ|baro|press|relat", re.IGNORECASE)
_UNCERTAIN = re.compile(r"acc|std|sigma|accuracy|err|(?:^|[\W_])sd|var|cov|dop", re.IGNORECASE)
_R = 6.371e6  # m; roles are judged by ratios of 10 %
_ALIKE = 0.9
"""Least correlation of a velocity with the differences of the positions."""
_STEPS = (0.009, 60.0)
"""Intervals of fixes, s: receivers give 1 to 100 a second, loggers of phones one in some seconds."""


@dataclass(frozen=True)
class FixLayout:
    """A guess of the layout of fixes."""

    time: int  # column of the time, from 0
    time_unit: str  # one of s, ms, us, ns
    clock: str  # "unix" if the times count from 1970; "gps" otherwise
    # description by key: latitude, longitude, height, velocity, speed, course, position_sigma, … with numbers of
    # columns from 0
    quantities: dict[str, Any]
    held: bool  # whether fixes are repeated until there is a new one

    def description(self, table: TextTable) -> dict[str, Any]:
        """Return the keys of the description of the file."""
        keys: dict[str, Any] = {"time": table.label(self.time)}
        if self.time not in table.dates and unit_in_name(keys["time"]) != self.time_unit:
            keys["time_unit"] = self.time_unit
        keys |= table.layout()
        if self.clock != "gps":
            keys["clock"] = self.clock
        if self.held:
            keys["held"] = True
        for name, of in self.quantities.items():
            if isinstance(of, int):
                keys[name] = table.label(of)
            elif "columns" in of:
                keys[name] = {**of, "columns": [table.label(k) for k in of["columns"]]}
            else:
                keys[name] = {**of, "column": table.label(of["column"])}
        return keys


def guess_fixes(table: TextTable, near: tuple[str | int, str, float, float] | None = None) -> FixLayout | None:
    """Guess the layout of fixes near the inertial unit's column of times: its name or number, unit, and first and last
    time, s, None if it is not known. Return None if nothing looks like latitude and longitude."""
    place = _named_place(table)
    named = place is not None
    place = place or _smooth_place(table)
    if place is None:
        return None
    latitude, longitude, _ = place
    known = np.isfinite(table.values[:, [latitude, longitude]]).all(axis=1)
    known &= (table.values[:, latitude] != 0.0) | (table.values[:, longitude] != 0.0)
    if int(known.sum()) < 3:
        return None
    time = _time(table, known, near, set(place))
    if time is None:
        return None
    k, unit = time
    at = table.values[known, k] * (1.0 if k in table.dates else TIME_UNITS[unit])
    unix = is_unix(table, k, at)
    rows = table.values[known]
    steps = np.diff(rows[:, list(place)], axis=0)
    same = (steps == 0.0).all(axis=1)
    of_unit = {quantity((table.words or ())[three[0]]) for three in triads(table.words)} & {"gyro", "accel"}
    rows_of_unit = table.words is None or bool(of_unit)
    repeated = bool(same.mean() > 0.6 and (rows_of_unit or float(np.median(np.diff(at))) < 0.08))
    fresh = np.append(True, ~same) if repeated else np.ones(len(rows), dtype=bool)
    roles = _Roles(table, place, at[fresh], rows[fresh], named)
    return FixLayout(k, unit, "unix" if unix else "gps", roles.quantities(), repeated)


def _find(table: TextTable, role: str, *, uncertain: bool = False) -> int | None:
    """Return the first column whose name has a word of a role."""
    for k, name in enumerate(table.words or ()):
        fits = means(name, role) and (uncertain or not _UNCERTAIN.search(name))
        if fits and np.isfinite(table.values[:, k]).any():
            return k
    return None


def _named_place(table: TextTable) -> tuple[int, int, int] | None:
    latitude, longitude = _find(table, "latitude"), _find(table, "longitude")
    if latitude is None or longitude is None:
        return None
    heights = [
        k
        for k, name in enumerate(table.words or ())
        if means(name, "height") and not (_UNCERTAIN.search(name) or _NO_HEIGHT.search(name))
    ]
    # of several, that of the receiver is beside its latitude and longitude; another one is that of a barometer
    heights.sort(key=lambda k: (not re.search(r"ellip|hae", (table.words or ())[k], re.I), abs(k - longitude)))
    return (latitude, longitude, heights[0]) if heights else None


def _smooth_place(table: TextTable) -> tuple[int, int, int] | None:
    """Return three neighbours of which the first two change by little of their size, and smoothly."""
    if triads(table.words):  # names of sensors
        return None
    best: tuple[float, int] = (0.02, -1)
    values = table.values
    for k in range(values.shape[1] - 2):
        pair = values[:, k : k + 2]
        if not len(pair) or not np.isfinite(pair).all() or not (np.abs(pair) <= 180.0).all():
            continue
        size, range_, step = np.abs(np.median(pair, axis=0)), np.ptp(pair, axis=0), np.abs(np.diff(pair, axis=0))
        if not (size > 1e-3).all() or not (range_ > 0.0).all() or not (step.max(axis=0) < 0.2 * range_).all():
            continue
        share = float((range_ / size).max())
        if share < best[0] and np.abs(pair).max(axis=0).min() <= 90.0:
            best = share, k
    k = best[1]
    if k < 0:
        return None
    reversed_ = bool(np.abs(values[:, k]).max() > 90.0)  # a longitude
    return (k + 1, k, k + 2) if reversed_ else (k, k + 1, k + 2)


def _time(
    table: TextTable, known: Array, near: tuple[str | int, str, float, float] | None, place: set[int]
) -> tuple[int, str] | None:
    """Return column and unit of the time."""
    best: tuple[float, int, str] = (np.inf, -1, "")
    for k in range(table.values.shape[1]):
        column = table.values[known, k]
        word = (table.words or [""] * (k + 1))[k]
        if k in place or not np.isfinite(column).all() or says_other(word):
            continue
        steps = np.diff(column)
        forward = steps[steps > 0.0]
        if len(forward) < 0.02 * len(steps) or (steps < 0.0).mean() > 0.02:
            continue
        middle = float(np.median(forward))
        spread = float(np.percentile(np.abs(forward - middle), 75.0)) / middle
        spread = round(spread, 1) + 1e-3 * k
        # a second of the minute or of the day is no time of a log: it begins again, or repeats
        spread += 100.0 * bool(-steps.min() > 0.3 * np.ptp(column)) + 50.0 * (len(forward) < 0.5 * len(steps))
        spread -= 3.0 * says_time(word)
        named = (unit_in_name(word) if word else None) or epoch_unit(column, middle)
        for unit, scale in {"s": 1.0}.items() if k in table.dates else TIME_UNITS.items():
            if not _STEPS[0] <= middle * scale <= _STEPS[1] and unit != named:
                continue
            score = spread + 0.01 * abs(np.log10(middle * scale / 0.5)) - 5.0 * (unit == named)
            if near is not None:
                begin, end = float(column[0]) * scale, float(column[-1]) * scale
                common = min(end, near[3]) - max(begin, near[2])
                score -= 20.0 * (common > 0.3 * min(end - begin, near[3] - near[2]))
                score -= 2.0 * (table.label(k) == near[0] and unit == near[1])
            best = min(best, (score, k, unit))
    return None if best[1] < 0 else (best[1], best[2])


class _Roles:
    """The columns of fixes by their roles, as the numbers confirm them."""

    def __init__(self, table: TextTable, place: tuple[int, int, int], time: Array, rows: Array, named: bool) -> None:
        self.table, self.place, self.rows, self.named = table, place, rows, named
        self.angle = self._angle_unit()
        length = unit_of(self._word(place[2]), ("mm", "cm", "ft", "m")) or "m"
        if np.abs(rows[:, place[2]]).max() > 2e5 and length == "m":
            length = "mm"  # above 200 km there is no receiver of the users
        self.height = length
        size = UNITS_OF["angle"][self.angle]
        latitude, longitude = rows[:, place[0]] * size, np.unwrap(rows[:, place[1]] * size)
        self.time = time
        north = np.gradient(latitude, time) * _R if len(time) > 2 and (np.diff(time) > 0).all() else None
        if north is None:
            self.moved = None
        else:
            east = np.gradient(longitude, time) * _R * np.cos(latitude)
            up = np.gradient(rows[:, place[2]] * UNITS_OF["length"][length], time)
            self.moved = np.stack([north, east, -up], axis=1)

    def _word(self, column: int) -> str:
        return (self.table.words or [""] * (column + 1))[column]

    def _angle_unit(self) -> str:
        """Return the unit of latitude and longitude."""
        word, pair = self._word(self.place[0]), np.abs(self.rows[:, list(self.place[:2])])
        if pair.max() > 1000.0 and (pair < 1.8e9 + 1).all():
            return "1e-7 deg"
        named = unit_of(word, ("rad", "deg"))
        if named is not None:
            return named
        if pair[:, 0].max() > 0.5 * np.pi or pair[:, 1].max() > np.pi:
            return "deg"
        far = float(np.hypot(*(np.ptp(pair, axis=0) * (1.0, np.cos(pair[0, 0])))))
        # within a radian of latitude 0, longitude 0: a track of degrees is 57 times shorter
        return "rad" if far * _R < 3e5 else "deg"

    def quantities(self) -> dict[str, Any]:
        """Return the description of all quantities."""
        latitude, longitude, height = self.place
        description: dict[str, Any] = {}
        velocity = self._velocity()
        sigma = self._sigma(velocity)
        quality = _find(self.table, "quality")
        if quality is not None:
            codes = self.rows[:, quality]
            codes = codes[np.isfinite(codes)]
            if len(codes) and (codes == np.rint(codes)).all() and np.abs(codes).max() < 1000:
                description["quality"] = quality
        return {
            **description,
            "latitude": {"column": latitude, "unit": self.angle},
            "longitude": {"column": longitude, "unit": self.angle},
            "height": {"column": height, "unit": self.height},
            **velocity,
            **sigma,
        }

    def _velocity(self) -> dict[str, Any]:
        """Return velocity, or speed and course."""
        north, east = _find(self.table, "north"), _find(self.table, "east")
        down, up = _find(self.table, "down"), _find(self.table, "up")
        if north is not None and east is not None and (down is not None or up is not None):
            unit = self._speed_unit(north, 0)
            if down is not None:
                return {"velocity": {"columns": [north, east, down], "unit": unit, "axes": "north-east-down"}}
            return {"velocity": {"columns": [north, east, up], "unit": unit, "axes": "north-east-up"}}
        speed, course = _find(self.table, "speed"), _find(self.table, "course")
        if speed is not None and course is not None:
            angle = unit_of(self._word(course), ("rad", "deg")) or self._course_unit(course)
            unit = self._speed_unit(speed, None)
            return {"speed": {"column": speed, "unit": unit}, "course": {"column": course, "unit": angle}}
        return {} if self.named else self._fitting_velocity() or self._fitting_speed()

    def _course_unit(self, course: int) -> str:
        values = self.rows[:, course]
        return "deg" if float(np.nanmax(np.abs(values))) > 2.0 * np.pi + 0.01 else "rad"

    def _speed_unit(self, column: int, component: int | None) -> str:
        """Return the unit of a velocity: that of its name, or the one in which it agrees best with the positions."""
        units = {u: UNITS_OF["speed"][u] for u in ("m/s", "km/h", "kt", "cm/s", "mm/s", "ft/s")}
        named = unit_of(self._word(column), ("km/h", "kt", "ft/s", "m/s"))
        if named is not None:
            return named
        if self.moved is None:
            return "m/s"
        by_position = np.hypot(self.moved[:, 0], self.moved[:, 1]) if component is None else self.moved[:, component]
        values = self.rows[:, column]
        good = np.isfinite(values) & np.isfinite(by_position)
        size = float(np.sum(by_position[good] * values[good])) / max(float(np.sum(values[good] ** 2)), 1e-30)
        if not size > 0.0 or float(np.std(by_position[good])) < 0.3:
            return "m/s"
        return min(units, key=lambda u: abs(np.log(units[u] / size)))

    def _fitting_velocity(self) -> dict[str, Any]:
        """Return the three neighbours that agree with the differences of the positions."""
        if self.moved is None or float(np.abs(self.moved[:, :2]).max()) < 1.0:
            return {}
        orders = {"north-east-down": (0, 1), "east-north-up": (1, 0)}
        for k in range(self.rows.shape[1] - 2):
            if {k, k + 1, k + 2} & set(self.place):
                continue
            for axes, (first, second) in orders.items():
                if self._alike(self.rows[:, k], first) > _ALIKE and self._alike(self.rows[:, k + 1], second) > _ALIKE:
                    vertical = self._alike(self.rows[:, k + 2], 2)
                    if axes == "north-east-down" and vertical < -0.3:
                        axes = "north-east-up"
                    if axes == "east-north-up" and vertical > 0.3:
                        continue
                    unit = self._speed_unit(k, first)
                    return {"velocity": {"columns": [k, k + 1, k + 2], "unit": unit, "axes": axes}}
        return {}

    def _fitting_speed(self) -> dict[str, Any]:
        """Return two neighbours, a speed and a course, that agree with the differences of the positions."""
        if self.moved is None or float(np.abs(self.moved[:, :2]).max()) < 1.0:
            return {}
        for k in sorted(set(range(self.rows.shape[1] - 1)) - {near for j in self.place for near in (j - 1, j)}):
            for unit in ("deg", "rad"):
                speed, course = self.rows[:, k], self.rows[:, k + 1] * UNITS_OF["angle"][unit]
                if min(self._alike(speed * f(course), j) for j, f in enumerate((np.cos, np.sin))) > _ALIKE:
                    of_speed = {"column": k, "unit": self._speed_unit(k, None)}
                    return {"speed": of_speed, "course": {"column": k + 1, "unit": unit}}
        return {}

    def _alike(self, values: Array, component: int) -> float:
        assert self.moved is not None
        by_position = self.moved[:, component]
        good = np.isfinite(values) & np.isfinite(by_position)
        if int(good.sum()) < 5 or not values[good].std() or not by_position[good].std():
            return 0.0
        return float(np.corrcoef(values[good], by_position[good])[0, 1])

    def _sigma(self, velocity: dict[str, Any]) -> dict[str, Any]:
        """Return 1σ of position and velocity."""
        description: dict[str, Any] = {}

        def positive(role: str) -> int | None:
            k = _find(self.table, role, uncertain=True)
            values = self.rows[:, k] if k is not None else np.empty(0)
            values = values[np.isfinite(values)]
            return k if len(values) and float(np.median(values)) > 0.0 else None

        each = [positive(role) for role in ("sigma_n", "sigma_e", "sigma_d")]
        across, vertical, speed = positive("sigma_h"), positive("sigma_v"), positive("sigma_s")
        if None not in each:
            description["position_sigma"] = {"columns": each, "unit": "m"}
        elif across is not None:
            each = [across, across, across if vertical is None else vertical]
            unit = unit_of(self._word(across), ("mm", "cm", "m")) or ("mm" if self.height == "mm" else "m")
            description["position_sigma"] = {"columns": each, "unit": unit}
        if speed is not None:
            small = velocity.get("velocity", velocity.get("speed", {})).get("unit") == "mm/s"
            unit = unit_of(self._word(speed), ("m/s",)) or ("mm/s" if small else "m/s")
            description["velocity_sigma"] = {"columns": [speed, speed, speed], "unit": unit}
        return description
