"""Times of UTC as ISO 8601 writes them, in GPS time."""

from __future__ import annotations

import re
from datetime import UTC, datetime

from sinssim.errors import InputError, shortened
from sinssim.logs.gps_time import gps_from_unix

_ISO = re.compile(
    r"(\d{4})-(\d\d)-(\d\d)[T ](\d\d):(\d\d)(?::(\d\d)([.,]\d+)?)?\s*(Z|z|[+-]\d\d(?::?\d\d)?)?", re.ASCII
)


def gps_seconds(text: str) -> tuple[float, bool]:
    """Return the GPS time of a time as ISO 8601 writes it: "2024-05-01T12:00:00.5Z", "2024-05-01 14:00:00+02:00".

    Args:
        text: the time; without a zone it is UTC.

    Returns:
        Seconds since 1980-01-06 00:00:00 GPST, and whether the text has a zone.

    Raises:
        InputError: the text is no such time.
    """
    found = _ISO.fullmatch(text.strip())
    if found is None:
        raise InputError(f"{shortened(text)!r} is not a time; 2024-05-01T12:00:00Z would be one.")
    year, month, day, hour, minute, second = (int(part or 0) for part in found.groups()[:6])
    fraction, zone = float((found[7] or "0").replace(",", ".")), found[8]
    extra, second = (1, 59) if second == 60 else (0, second)  # a leap second
    try:
        moment = datetime(year, month, day, hour, minute, second, tzinfo=UTC)
    except ValueError as error:
        raise InputError(f"{shortened(text)!r} is not a time: {error}.") from error
    unix = moment.timestamp()
    if zone and zone not in "Zz":
        digits = zone[1:].replace(":", "").ljust(4, "0")
        unix -= (-1.0 if zone[0] == "-" else 1.0) * (3600 * int(digits[:2]) + 60 * int(digits[2:]))
    return float(gps_from_unix(unix)) + extra + fraction, zone is not None
