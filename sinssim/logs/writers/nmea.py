"""NMEA 0183: GGA and RMC for each instant, and HDT where there is an attitude.

The height of GGA is meant above mean sea level. sinssim has no model of the geoid: the file has the height above the
ellipsoid and a geoid separation of 0, so that their sum, the ellipsoidal height, is right.
"""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta
from functools import reduce
from pathlib import Path

from sinssim import rotation
from sinssim.logs.gps_time import unix_from_gps
from sinssim.logs.writers.run_export import Content
from sinssim.units import DEG, KNOT

SUFFIX = ".nmea"
HOLDS = "solution"
_MOST_HZ = 10.0


def write(content: Content, place: Path) -> list[str]:
    """Write the file, at most 10 instants a second if no rate is given."""
    content = content.with_rate(_MOST_HZ)
    s = content.solution
    unix = unix_from_gps(content.start_gps_s + s.time)
    heading = None if s.q_nb is None else rotation.euler_from_quaternion(s.q_nb)[2] / DEG
    quality = 1 if content.solution_name in content.run.fixes else 8
    with place.open("w", encoding="ascii", newline="") as file:
        for k in range(len(s)):
            ms = round(float(unix[k]) * 1e3)
            date = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(milliseconds=ms)
            clock = f"{date:%H%M%S}.{ms % 1000:03d}"
            where = f"{_angle(s.latitude[k] / DEG, 2, 'NS')},{_angle(s.longitude[k] / DEG, 3, 'EW')}"
            height = f"{s.height[k]:.4f},M,0.0,M,,"
            file.write(_sentence(f"GNGGA,{clock},{where},{quality},00,,{height}"))
            course = ","
            if s.velocity_ned is not None:
                north, east = float(s.velocity_ned[k, 0]), float(s.velocity_ned[k, 1])
                course = f"{math.hypot(north, east) / KNOT:.4f},{math.degrees(math.atan2(east, north)) % 360.0:.4f}"
            file.write(_sentence(f"GNRMC,{clock},A,{where},{course},{date:%d%m%y},,,{'A' if quality == 1 else 'S'},V"))
            if heading is not None:
                file.write(_sentence(f"GNHDT,{heading[k]:.4f},T"))
    return [
        f"{content.solution_name}: GGA and RMC{' and HDT' if heading is not None else ''}, {len(s)} instants.",
        "The height is that above the ellipsoid, with a geoid separation of 0: sinssim has no geoid model.",
        "Times are UTC.",
    ]


def _angle(degrees: float, digits: int, signs: str) -> str:
    """Return a latitude or longitude as degrees and minutes, "5000.1234567,N"."""
    degrees = (degrees + 180.0) % 360.0 - 180.0 if signs == "EW" else degrees
    whole, units = divmod(round(abs(degrees) * 60.0 * 1e7), 60 * 10**7)
    return f"{whole:0{digits}d}{units // 10**7:02d}.{units % 10**7:07d},{signs[bool(degrees < 0.0)]}"


def _sentence(body: str) -> str:
    return f"${body}*{reduce(lambda a, b: a ^ b, body.encode()):02X}\r\n"
