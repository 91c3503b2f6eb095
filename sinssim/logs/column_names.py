"""The dictionary of column names: which quantity, which axis and which unit a name means, and units in SI.

The formats of tables with names, the descriptions of columns and the inspection of unknown files read it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sinssim.data import Array
from sinssim.units import ANGLES, ARCSEC, DEG, DEG_H, FOOT, G0, LENGTHS, SPEEDS

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "100us": 1e-4, "us": 1e-6, "ns": 1e-9}
"""Units of time, in s."""
UNITS: dict[tuple[str, str], dict[str, float]] = {
    ("gyro", "increments"): {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": DEG, "arcsec": ARCSEC},
    ("gyro", "rates"): {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": DEG, "deg/h": DEG_H},
    ("accel", "increments"): {"m/s": 1.0, "mm/s": 1e-3, "ft/s": FOOT, "g*s": G0},
    ("accel", "rates"): {"m/s^2": 1.0, "ft/s^2": FOOT, "g": G0, "mg": 1e-3 * G0},
}
"""Units by triad and kind of log, in SI."""
UNITS_OF: dict[str, Mapping[str, float]] = {
    "angle": {**ANGLES, "1e-7 deg": 1e-7 * DEG},
    "length": {**LENGTHS, "mm": 1e-3, "cm": 1e-2},
    "speed": {**SPEEDS, "mm/s": 1e-3, "cm/s": 1e-2},
}
"""Units by dimension, in SI."""
UNIT_WORDS = {
    "rad/s": r"rad[\W_]*(?:/|p|per)?[\W_]*s(?:ec|\b|\^|⁻|_|$)|rps|radpersec",
    "deg/s": r"deg[\W_]*(?:/|p|per)?[\W_]*s(?:ec|\b|\^|⁻|_|$)|dps|°/s",
    "deg/h": r"deg[\W_]*/?[\W_]*h|°/h|dph",
    "mrad/s": r"mrad[\W_]*/?[\W_]*s",
    "m/s^2": r"m[\W_]*(?:/|p)?[\W_]*s[\W_]*(?:\^?-?2|²|⁻²)|m/s/s|mps2|mss",
    "g": r"(?:^|[\W_])gs?(?:$|[\W_])",
    "mg": r"(?:^|[\W_])mg(?:$|[\W_])",
    "ft/s^2": r"ft[\W_]*/?[\W_]*s[\W_]*(?:\^?-?2|²)",
    "rad": r"(?:[\W_])rad(?:$|[\W_])",
    "mrad": r"(?:[\W_])mrad(?:$|[\W_])",
    "urad": r"(?:[\W_])[uµ]rad(?:$|[\W_])",
    "deg": r"(?:[\W_])deg(?:$|[\W_])|°",
    "arcsec": r"arcsec",
    "m/s": r"m/s|mps|m_s\b|m s\^?-1",
    "km/h": r"km/?h|kph",
    "kt": r"knots?|(?:[\W_])kt?s?(?:$|[\W_])|kn\b",
    "ft": r"(?:[\W_])(?:ft|feet)(?:$|[\W_])",
    "mm": r"(?:[\W_])mm(?:$|[\W_])",
    "cm": r"(?:[\W_])cm(?:$|[\W_])",
    "m": r"(?:[\W_])m(?:$|[\W_])",
}
"""What the units look like in a name."""
SPELLED: dict[str, float] = {
    **{unit: size for units in (*UNITS.values(), *UNITS_OF.values(), TIME_UNITS) for unit, size in units.items()},
    "sec": 1.0, "deg/hr": DEG_H, "m/s2": 1.0, "degree": DEG, "degrees": DEG, "radian": 1.0, "radians": 1.0,
    "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "feet": FOOT, "foot": FOOT, "mps": 1.0, "mps2": 1.0,
    "radps": 1.0, "degps": DEG,
}  # fmt: skip
"""All units as files and names of columns spell them, in SI."""

# an axis at the end of a name, before units in brackets, or as an index: accX, gyro_x [deg/s], gyro_rad[0], w_RS_S_x
_AXIS = re.compile(r"(?:\[([0-2])\]|([xyz])(?![a-z])|([XYZ])(?![a-z]))(?=(?:[\W_]|$))")
_ABOUT = re.compile(r"roll|pitch|yaw", re.IGNORECASE)
"""Rates about the axes x, y and z: rollrate, gyro_pitch."""
_UNIT_TAIL = re.compile(r"[\s_]*[\[(<{].*?[\])>}]\s*$")
# A unit at the end of a column's name, after a separator or as capitals after a lower-case letter: t_ms, time [s],
# TimeUS.
_PER = re.compile(r"/\s*$|(?:^|[\W_])(?:[mck]?m|ft|[mk]?g|m?rad|deg|°|per|p)$")
"""The end of a name before a unit of time that makes it one of a rate or a speed."""
_UNIT_IN_NAME = re.compile(r"(?:[\W_]|(?<=[a-z])(?=[A-Z]))((?i:m|u|µ|μ|n)?(?i:s|sec))\W*$")

_EPOCH = (1.0e9, 2.2e9)
"""Seconds since 1970 of the years 2001 to 2039."""
_EPOCH_STEPS = (1e-5, 1e3)
"""Intervals of any logger, s: counters since the start of a computer that look like dates have others."""

_END = r"(?:$|[\W_])"
_START = r"(?:^|[\W_])"


class Meaning(NamedTuple):
    """How the name of a column says that it holds a quantity."""

    within: str  # pattern of the words of loggers, within any name
    names: tuple[str, ...] = ()  # whole names before a unit: lat, lat_deg, "Lat [deg]"
    units: tuple[str, ...] = ()  # those that may follow such a name


_ANGLE = ("deg", "degree", "degrees", "°", "rad", "radian", "radians")
_LENGTH = ("m", "meter", "meters", "metre", "metres", "km", "ft", "feet", "foot")
_MPS = ("mps",)
QUANTITIES: dict[str, Meaning] = {
    "time": Meaning(
        rf"time|stamp|^t$|^t[_\W]|{_START}sec(?:$|[\W_]|ond)|tow|sow|epoch|utc|clock|millis|micros|nanos",
        ("time", "t", "time_utc", "timestamp"), tuple(TIME_UNITS),
    ),
    "count": Meaning(rf"sample|packet|count|index|{_START}(?:seq|row|frame|number|no|nr|n|id){_END}"),
    "no time": Meaning(
        r"sound|speed|veloc|temp|press|humid|alt|height|depth|dist|odo|volt|current|batt|heading|course|energy"
    ),
    "latitude": Meaning(
        rf"{_START}lat(?:itude)?{_END}|latitude|(?<=[a-z])Lat{_END}", ("latitude", "lat"), _ANGLE
    ),
    "longitude": Meaning(
        rf"{_START}(?:lon|lng|long)(?:itude)?{_END}|longitude|(?<=[a-z])(?:Lon|Lng){_END}",
        ("longitude", "lon", "lng", "long"), _ANGLE,
    ),
    "height": Meaning(
        rf"{_START}(?:alt|altitude|height|hgt|elev\w*|ele|h|hmsl|hae){_END}|altitude|height",
        ("height", "altitude", "alt", "elevation", "ele", "hgt"), _LENGTH,
    ),
    "north": Meaning(
        rf"{_START}v(?:el(?:ocity)?)?[\W_]*n(?:orth)?{_END}|north[\W_]*vel|vel\w*[\W_]*north|v[Nn]orth"
        rf"|vel\w*\W+n{_END}",
        ("velocity_n", "vn"), _MPS,
    ),
    "east": Meaning(
        rf"{_START}v(?:el(?:ocity)?)?[\W_]*e(?:ast)?{_END}|east[\W_]*vel|vel\w*[\W_]*east|v[Ee]ast"
        rf"|vel\w*\W+e{_END}",
        ("velocity_e", "ve"), _MPS,
    ),
    "down": Meaning(
        rf"{_START}v(?:el(?:ocity)?)?[\W_]*d(?:own)?{_END}|down[\W_]*vel|vel\w*[\W_]*down|v[Dd]own"
        rf"|vel\w*\W+d{_END}",
        ("velocity_d", "vd"), _MPS,
    ),
    "up": Meaning(
        rf"{_START}v(?:el(?:ocity)?)?[\W_]*u(?:p)?{_END}|up[\W_]*vel|vel\w*[\W_]*up{_END}|v[Uu]p|climb"
    ),
    "speed": Meaning(
        rf"speed|{_START}spd{_END}|{_START}vel_m_s{_END}|{_START}sog{_END}|^velocity(?:\s*[\[(].*)?$"
    ),
    "course": Meaning(
        rf"course|bearing|{_START}g?crs{_END}|{_START}cog|{_START}heading{_END}|track|head(?:ing)?_?mot|"
        rf"^direction{_END}"
    ),
    "roll": Meaning(rf"{_START}roll{_END}", ("roll",), _ANGLE),
    "pitch": Meaning(rf"{_START}pitch{_END}", ("pitch",), _ANGLE),
    "heading": Meaning(rf"{_START}(?:heading|yaw|hdg){_END}", ("heading", "yaw", "hdg"), _ANGLE),
    "sigma_h": Meaning(rf"horizontal[\W_]*acc|{_START}h_?acc|{_START}eph{_END}|^acc(?:uracy)?(?:$|[ \[(])|pos\w*_acc"),
    "sigma_v": Meaning(rf"vertical[\W_]*acc|{_START}v_?acc|{_START}epv{_END}|(?:altitude|height)[\W_]*acc"),
    "sigma_s": Meaning(rf"(?:speed|velocity)[\W_]*acc|{_START}s_?acc|s_variance_m_s|velu{_END}"),
    "sigma_n": Meaning(
        rf"{_START}(?:sd|std|sigma|s|var)_?(?:dev)?_?n(?:orth)?{_END}|posu\W+n{_END}", ("sigma_n",), ("m",)
    ),
    "sigma_e": Meaning(
        rf"{_START}(?:sd|std|sigma|s)_?(?:dev)?_?e(?:ast)?{_END}|posu\W+e{_END}", ("sigma_e",), ("m",)
    ),
    "sigma_d": Meaning(
        rf"{_START}(?:sd|std|sigma|s)_?(?:dev)?_?(?:d(?:own)?|u(?:p)?|h){_END}|posu\W+d{_END}", ("sigma_d",), ("m",)
    ),
    "quality": Meaning(r"^(?:fix|q|quality|fix_?type|fix_?q\w*|gps_?q\w*|solution_?status|rtk_?\w*status)$"),
    "other": Meaning(
        r"mag|(?:^|[\W_])m[\W_]?[xyz]|grav|bias|std|sigma|sd[nexyz]|quat|"
        r"(?:^|[\W_])q[\W_]?[wxyz]|temp|clip|integral|orient|pos|euler"
    ),
    "gyro": Meaning(
        r"gyr|omega|(?:^|[\W_])w(?:$|[\W_xyz])|(?:^|[\W_])g[\W_]?[xyz]|ang(?:ular)?[\W_]*(?:rate|vel)|dtheta|"
        r"delta[\W_]*ang|(?:^|[\W_])rate[\W_]?[xyz]|(?:rotation|turn|roll|pitch|yaw)[\W_]*rate|"
        r"(?:^|[\W_])[pqr](?:$|[\W_])"
    ),
    "accel": Meaning(
        r"acc|force|(?:^|[\W_])f[\W_]?(?:ib[\W_]*b?[\W_]*)?[xyz]|(?:^|[\W_])a(?:$|[\W_xyz])|dv|delta[\W_]*vel"
    ),
    "gravity": Meaning(r"grav"),
    "without gravity": Meaning(r"(?:lin(?:ear)?|user|free)[\W_]*acc"),
    **{f"sigma_v{axis}": Meaning(r"(?!)", (f"sigma_v{axis}",), _MPS) for axis in "ned"},
    **{
        f"{name}_{axis}": Meaning(r"(?!)", (f"{name}_{axis}",), units)
        for name, units in {
            "dtheta": ("rad", "deg"), "dvel": _MPS, "gyro": ("radps", "degps"), "accel": ("mps2",),
        }.items()
        for axis in "xyz"
    },
    **{f"q_{axis}": Meaning(r"(?!)", (f"q_nb_{axis}", f"q{axis}")) for axis in "wxyz"},
}  # fmt: skip
"""What the names of columns mean."""
_BY_NAME = {name: quantity for quantity, meaning in QUANTITIES.items() for name in meaning.names}
_BRACKETS = re.compile(r"([a-z_]+)\s*[\[(]\s*([a-z°]+)\s*[\])]")


def meaning_of(name: str) -> tuple[str, str] | None:
    """Return which quantity a whole name means, a key of `QUANTITIES` and of `SPELLED`, and its unit, "" if it gives
    none: altitude_ft, "Altitude [ft]". None for another name."""
    low = name.strip().lower()
    bracketed = _BRACKETS.fullmatch(low)
    stem, unit = bracketed.groups() if bracketed else (low, "")
    if stem not in _BY_NAME and not bracketed:
        stem, _, unit = low.rpartition("_")
    quantity = _BY_NAME.get(stem)
    return None if quantity is None or (unit and unit not in QUANTITIES[quantity].units) else (quantity, unit)


def usual_name(quantity: str) -> str:
    """Return the usual name of the column of a quantity that has names: latitude_deg."""
    meaning = QUANTITIES[quantity]
    return "_".join((meaning.names[0], *meaning.units[:1]))


def quantity(name: str) -> str | None:
    """Return what a column of an inertial unit holds by its name: "gyro", "accel", "other"; None if it does not say."""
    low = name.lower()
    named = next((what for what in ("other", "gyro", "accel") if means(low, what)), None)
    return named or ("gyro" if unit_of(name, ("rad/s", "deg/s")) else "accel" if unit_of(name, ("m/s^2",)) else None)


def axis(name: str) -> tuple[str, int] | None:
    """Return the stem of a name and the number of its axis; None if it names none."""
    plain = _UNIT_TAIL.sub("", name) if not re.search(r"\[[0-2]\]\s*$", name) else name
    about = _ABOUT.search(plain)
    if about is not None and quantity(plain) == "gyro":
        number = ("roll", "pitch", "yaw").index(about[0].lower())
        return plain[: about.start()].lower() + "*" + plain[about.end() :].lower(), number
    matches = [*_AXIS.finditer(plain)]
    camel = re.search(r"(?<=[a-z0-9])([XYZ])$", plain) or re.search(r"(?:^|[\W_]|^[a-zA-Z]{1,4})([xyzXYZ])$", plain)
    match = matches[-1] if matches else camel
    if match is None:
        return None
    letter = next(g for g in match.groups() if g is not None).lower()
    number = int(letter) if letter.isdigit() else "xyz".index(letter)
    at = match.start(next(k for k, g in enumerate(match.groups(), start=1) if g is not None))
    return plain[:at].lower() + "*" + plain[at + 1 :].lower(), number


def triads(names: Sequence[str] | None) -> list[tuple[int, int, int]]:
    """Return the columns x, y, z of every three columns that differ by their axis only: numbers of columns from 0."""
    groups: dict[str, dict[int, int]] = {}
    for k, name in enumerate(names or ()):
        parts = axis(name)
        if parts is not None:
            groups.setdefault(parts[0], {}).setdefault(parts[1], k)
    return [(g[0], g[1], g[2]) for g in groups.values() if len(g) == 3]


def says(name: str | None, pattern: str) -> bool:
    """Return whether a name has a word."""
    return name is not None and re.search(pattern, name, re.IGNORECASE) is not None


def unit_of(name: str | None, units: Sequence[str]) -> str | None:
    """Return the unit that a name gives, of some; None if it gives none."""
    return next((unit for unit in units if says(name, UNIT_WORDS.get(unit, r"(?!)"))), None)


def unit_in_name(column: str | int | None) -> str | None:
    """Return the unit of time at the end of a column's name, None if there is none, as in those of speeds (m_s)."""
    tail = _UNIT_IN_NAME.search(column) if isinstance(column, str) else None
    if tail is None or _PER.search(str(column)[: tail.start(1)].rstrip(" _")):
        return None
    return tail[1].lower().replace("µ", "u").replace("μ", "u").removesuffix("ec")


def epoch_unit(column: Array, interval: float) -> str | None:
    """Return the unit in which stamps are dates since 1970: the unit; None if they are no such dates. `column`: stamps,
    (N,); `interval`: usual interval, in the same unit."""
    for unit, scale in TIME_UNITS.items():
        first, last = (float(column[k]) * scale for k in (0, -1))
        if _EPOCH[0] < first < _EPOCH[1] and _EPOCH[0] < last < _EPOCH[1] and unit != "100us":
            low, high = _EPOCH_STEPS
            return unit if low <= interval * scale <= high else None
    return None


def means(name: str | None, quantity: str) -> bool:
    """Return whether a name has a word of a quantity, a key of `QUANTITIES`."""
    return says(name, QUANTITIES[quantity].within)


def says_time(word: str) -> bool:
    """Return whether the name of a column says that it is a time."""
    return means(word, "time") and not says_other(word)


def says_other(word: str) -> bool:
    """Return whether the name of a column says that it is no time: a count, another quantity, or the unit of one."""
    if says(word, r"time|stamp|utc|tow|sow|epoch|millis|micros|nanos"):
        return False
    return means(word, "no time") or means(word, "count") or unit_of(word, tuple(UNIT_WORDS)) is not None
