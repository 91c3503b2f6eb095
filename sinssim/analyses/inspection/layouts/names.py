"""Names of columns as loggers write them: which quantity, which axis, which unit."""

from __future__ import annotations

import re
from collections.abc import Sequence

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

# an axis at the end of a name, before units in brackets, or as an index: accX, gyro_x [deg/s], gyro_rad[0], w_RS_S_x
_AXIS = re.compile(r"(?:\[([0-2])\]|([xyz])(?![a-z])|([XYZ])(?![a-z]))(?=(?:[\W_]|$))")
_ABOUT = re.compile(r"roll|pitch|yaw", re.IGNORECASE)
"""Rates about the axes x, y and z: rollrate, gyro_pitch."""
_UNIT_TAIL = re.compile(r"[\s_]*[\[(<{].*?[\])>}]\s*$")
_QUANTITIES: dict[str, str] = {
    "gyro": r"gyr|omega|(?:^|[\W_])w(?:$|[\W_xyz])|(?:^|[\W_])g[\W_]?[xyz]|ang(?:ular)?[\W_]*(?:rate|vel)|dtheta|"
    r"delta[\W_]*ang|(?:^|[\W_])rate[\W_]?[xyz]|(?:rotation|turn|roll|pitch|yaw)[\W_]*rate|"
    r"(?:^|[\W_])[pqr](?:$|[\W_])",
    "accel": r"acc|force|(?:^|[\W_])f[\W_]?(?:ib[\W_]*b?[\W_]*)?[xyz]|(?:^|[\W_])a(?:$|[\W_xyz])|dv|delta[\W_]*vel",
    "other": r"mag|(?:^|[\W_])m[\W_]?[xyz]|grav|bias|std|sigma|sd[nexyz]|quat|"
    r"(?:^|[\W_])q[\W_]?[wxyz]|temp|clip|integral|orient|pos|euler",
}


def quantity(name: str) -> str | None:
    """Return what a column of an inertial unit holds by its name: "gyro", "accel", "other"; None if it does not say."""
    low = name.lower()
    said = next((what for what in ("other", "gyro", "accel") if re.search(_QUANTITIES[what], low)), None)
    return said or ("gyro" if unit_of(name, ("rad/s", "deg/s")) else "accel" if unit_of(name, ("m/s^2",)) else None)


def axis(name: str) -> tuple[str, int] | None:
    """Return the stem of a name and the number of its axis; None if it names none."""
    plain = _UNIT_TAIL.sub("", name) if not re.search(r"\[[0-2]\]\s*$", name) else name
    about = _ABOUT.search(plain)
    if about is not None and quantity(plain) == "gyro":
        number = ("roll", "pitch", "yaw").index(about[0].lower())
        return plain[: about.start()].lower() + "*" + plain[about.end() :].lower(), number
    found = [*_AXIS.finditer(plain)]
    camel = re.search(r"(?<=[a-z0-9])([XYZ])$", plain) or re.search(r"(?:^|[\W_]|^[a-zA-Z]{1,4})([xyzXYZ])$", plain)
    match = found[-1] if found else camel
    if match is None:
        return None
    letter = next(g for g in match.groups() if g is not None).lower()
    number = int(letter) if letter.isdigit() else "xyz".index(letter)
    at = match.start(next(k for k, g in enumerate(match.groups(), start=1) if g is not None))
    return plain[:at].lower() + "*" + plain[at + 1 :].lower(), number


def triads(names: Sequence[str] | None) -> list[tuple[int, int, int]]:
    """Return the columns x, y, z of every three columns that differ by their axis only.

    Args:
        names: names of the columns.

    Returns:
        Numbers of columns from 0.
    """
    groups: dict[str, dict[int, int]] = {}
    for k, name in enumerate(names or ()):
        found = axis(name)
        if found is not None:
            groups.setdefault(found[0], {}).setdefault(found[1], k)
    return [(g[0], g[1], g[2]) for g in groups.values() if len(g) == 3]


def says(name: str | None, pattern: str) -> bool:
    """Return whether a name has a word."""
    return name is not None and re.search(pattern, name, re.IGNORECASE) is not None


def unit_of(name: str | None, units: Sequence[str]) -> str | None:
    """Return the unit that a name gives, of some; None if it gives none."""
    return next((unit for unit in units if says(name, UNIT_WORDS.get(unit, r"(?!)"))), None)
