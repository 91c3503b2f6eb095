"""Solutions of RTKLIB (.pos).

Fixes with dates or GPS weeks are read and written. The layout is that of `outsolhead` and `outpos` in RTKLIB's
solution.c: a comment of column heads, then date and time of day, or week and seconds, latitude, longitude, height (or
x, y, z in ECEF), quality, satellites, standard deviations, age and ratio, and velocities if they were computed. Angles
are degrees, or degrees, minutes and seconds. Written are GPST as date, latitude, longitude, height above the ellipsoid,
quality, σ and velocity.
"""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats import Format
from sinssim.logs.formats.export_streams import Content, Export
from sinssim.logs.gps_time import WEEK, leap_seconds_of_day
from sinssim.logs.numeric_columns import (
    WHITESPACE,
    CutRows,
    cut_rows,
)
from sinssim.logs.recorded_streams import Clock, FixStream, HeightDatum, Streams
from sinssim.system.files import read_text
from sinssim.units import DEG

QUALITY = {1: "fixed", 2: "float", 3: "SBAS", 4: "DGPS", 5: "single", 6: "PPP"}
_UNDEFINED, _ORIGIN = 0.0, datetime(1980, 1, 6)
_LEAST, _WITH_VELOCITY = 15, 24  # fields of a row
_KINDS = {"deg": "latitude(deg)", "dms": "latitude(d'\")", "ecef": "x-ecef(m)"}


def recognises_rtklib(path: Path, head: bytes) -> bool:
    """Return whether a file may be of this format."""
    first = head.decode("latin-1").splitlines()
    return any(_rtklib_kind(line) is not None for line in first)


def _rtklib_kind(line: str) -> str | None:
    """Return how a line of heads says that positions are written: "deg", "dms", "ecef"; None for another line."""
    if not line.startswith("%"):
        return None
    return next((kind for kind, word in _KINDS.items() if word in line), None)


def read_rtklib(path: Path) -> Streams:
    """Read a solution file: one stream of fixes, "gnss"."""
    try:
        lines = read_text(path, encoding="latin-1").splitlines()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    heads = [line for line in lines if _rtklib_kind(line) is not None]
    if not heads:
        raise InputError(
            f"{path} has no header line with latitude(deg), latitude(d'\") or x-ecef(m): it is not a file of positions "
            "by RTKLIB. Baselines (e-baseline) contain no positions: choose the solution format llh in RTKLIB."
        )
    kind = _rtklib_kind(heads[-1])
    utc = "UTC" in heads[-1].split("latitude")[0].split("x-ecef")[0]
    cut = cut_rows(path, WHITESPACE, 0)
    numbers, times = _rtklib_rows(path, lines, utc, kind, cut)
    if kind == "ecef":
        numbers = _geodetic(numbers)
    origin = int(min(seconds for seconds, _ in times))
    time = np.array([seconds - origin + fraction for seconds, fraction in times])
    sd = numbers[:, 5:11]
    quality = numbers[:, 3].astype(np.int64)
    moving = numbers.shape[1] >= _WITH_VELOCITY - 2
    fixes = FixStream(
        time,
        numbers[:, 0] * DEG,
        numbers[:, 1] * DEG,
        numbers[:, 2],
        _rtklib_datum(lines),
        np.where(sd[:, :3] > _UNDEFINED, sd[:, :3], np.nan),
        numbers[:, 13:16] * (1.0, 1.0, -1.0) if moving else None,
        np.where(numbers[:, 16:19] > _UNDEFINED, numbers[:, 16:19], np.nan) if moving else None,
        quality,
        {code: word for code, word in QUALITY.items() if code in quality},
        covariance=_covariance(sd),
    )
    clock = Clock("utc" if utc else "gps", origin, "dates in UTC" if utc else "dates or weeks in GPS time")
    return Streams(path, "rtklib-pos", clock, fixes={"gnss": fixes}, notes=cut.notes)


def _rtklib_rows(
    path: Path, lines: list[str], utc: bool, kind: str | None, cut: CutRows
) -> tuple[Array, list[tuple[int, float]]]:
    """Return the numbers of every row after its time, and the times as whole seconds and fractions."""
    rows, times = [], []
    others = 6 if kind == "dms" else 2  # fields of the time, and minutes and seconds of both angles
    for number, line in enumerate(lines, start=1):
        fields = line.replace(",", " ").split()
        if not fields or line.startswith("%") or number in (cut.first, cut.last):
            continue
        try:
            times.append(_rtklib_time(fields[0], fields[1], utc))
            values = [float(field) for field in fields[2:]]
            rows.append([_degrees(fields[2:5]), _degrees(fields[5:8]), *values[6:]] if kind == "dms" else values)
        except (ValueError, IndexError) as error:
            raise InputError(f"{path}, line {number}: this is not a row of a solution: {line[:80]!r}.") from error
        if len(rows[-1]) < _LEAST - 2 or len(rows[-1]) != len(rows[0]):
            before, least = f"the rows before have {len(rows[0]) + others}.", _LEAST - 2 + others
            raise InputError(
                f"{path}, line {number}: it has {len(fields)} fields; "
                + (before if len(rows) > 1 else f"at least {least} are needed.")
            )
    if not rows:
        raise InputError(f"{path} holds no solution: it has no row of numbers.")
    return np.array(rows), times


def _degrees(fields: list[str]) -> float:
    """Return degrees, minutes and seconds as degrees; the sign may be that of -0."""
    degrees, minutes, seconds = map(float, fields)
    return (-1.0 if fields[0].startswith("-") else 1.0) * (abs(degrees) + minutes / 60.0 + seconds / 3600.0)


def _geodetic(rows: Array) -> Array:
    """Return rows of Earth-fixed positions as rows of geodetic ones, with σ and velocities along north, east, up."""
    latitude, longitude, height = earth.ecef_to_geodetic(rows[:, :3])
    geodetic = rows.copy()
    geodetic[:, :3] = np.column_stack([latitude / DEG, longitude / DEG, height])
    c_en = rotation.dcm_from_quaternion(earth.q_en(latitude, longitude)) * np.array([1.0, 1.0, -1.0])
    for at in (5, 16):
        if rows.shape[1] < at + 6:
            continue
        sd = rows[:, at : at + 6]  # x, y, z, xy, yz, zx
        squares = np.sign(sd) * sd**2
        whole = squares[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
        local = np.einsum("nji,njk,nkl->nil", c_en, whole, c_en)[:, [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
        geodetic[:, at : at + 6] = np.sign(local) * np.sqrt(np.abs(local))
    if rows.shape[1] >= _WITH_VELOCITY - 2:
        geodetic[:, 13:16] = np.einsum("nji,nj->ni", c_en, rows[:, 13:16])
    return geodetic


def _rtklib_time(first: str, second: str, utc: bool) -> tuple[int, float]:
    """Return GPS time of a row, whole seconds and the fraction."""
    whole, _, digits = second.partition(".")
    fraction = float(f"0.{digits}") if digits else 0.0
    if "/" not in first:
        return int(first) * WEEK + int(whole), fraction
    at = datetime.strptime(f"{first} {whole}", "%Y/%m/%d %H:%M:%S")
    return round((at - _ORIGIN).total_seconds()) + (leap_seconds_of_day(f"{at:%Y-%m-%d}") if utc else 0), fraction


def _rtklib_datum(lines: list[str]) -> HeightDatum:
    """Return what the heights refer to, if the comments tell."""
    text = " ".join(line for line in lines if line.startswith("%"))
    return (
        "ellipsoid"
        if "ellipsoidal" in text or _KINDS["ecef"] in text
        else "mean sea level"
        if "geodetic" in text
        else "unknown"
    )


def _covariance(sd: Array) -> Array | None:
    """Return the covariance of north, east, down, (M, 3, 3); None if the file has no correlations.

    The file has √|c| with the sign of c for north-east, east-up and up-north.
    """
    cross = np.sign(sd[:, 3:]) * sd[:, 3:] ** 2
    if not cross.any():
        return None
    covariance = np.zeros((len(sd), 3, 3))
    covariance[:, range(3), range(3)] = sd[:, :3] ** 2
    for (i, j), values in zip(((0, 1), (1, 2), (2, 0)), (cross[:, 0], -cross[:, 1], -cross[:, 2]), strict=True):
        covariance[:, i, j] = covariance[:, j, i] = values
    return covariance


_HEAD = (
    "%  GPST                      latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)"
    "  sdeu(m)  sdun(m) age(s)  ratio    vn(m/s)    ve(m/s)    vu(m/s)\n"
)


def write_rtklib(content: Content, place: Path) -> list[str]:
    """Write the file."""
    s = content.solution
    fixes = content.solution_name in content.run.fixes
    sigma = s.position_sigma if s.position_sigma is not None else np.zeros((len(s), 3))
    velocity = s.velocity_ned * np.array([1.0, 1.0, -1.0]) if s.velocity_ned is not None else np.zeros((len(s), 3))
    quality = 5 if fixes else 1
    seconds, ns = content.stamps(s.time)
    whole_ms = not (ns % 1_000_000).any()
    epoch = datetime(1980, 1, 6)  # GPST, which has no leap seconds
    with place.open("w", encoding="utf-8") as file:
        file.write(f"% program   : sinssim\n% inp file  : {content.run.name}, {content.solution_name}\n")
        file.write(
            "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)\n"
        )
        file.write(_HEAD)
        for second, part, latitude, longitude, height, sd, v in zip(
            seconds.tolist(), ns.tolist(), (s.latitude / DEG).tolist(), (s.longitude / DEG).tolist(),
            s.height.tolist(), sigma.tolist(), velocity.tolist(), strict=True,
        ):  # fmt: skip
            date = epoch + timedelta(seconds=second)
            decimals = f"{part // 1_000_000:03d}" if whole_ms else f"{part:09d}"
            file.write(
                f"{date:%Y/%m/%d %H:%M:%S}.{decimals} {latitude:14.9f} {longitude:14.9f} {height:10.4f} "
                f"{quality:3d}   0 "
                f"{sd[0]:8.4f} {sd[1]:8.4f} {sd[2]:8.4f}   0.0000   0.0000   0.0000   0.00    0.0 "
                f"{v[0]:10.5f} {v[1]:10.5f} {v[2]:10.5f}\n"
            )
    return [
        f"{content.solution_name}: latitude, longitude [°], height above the ellipsoid, σ north, east, up, velocity "
        f"north, east, up; quality {quality} ({'single' if fixes else 'fix'}).",
        "Times are GPST as dates.",
    ]


RTKLIB = Format(recognises_rtklib, read_rtklib)
RTKLIB_POS = Export(".pos", "solution", write_rtklib)
