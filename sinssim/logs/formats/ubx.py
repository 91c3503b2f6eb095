"""u-blox UBX by pyubx2: NAV-PVT with NAV-HPPOSLLH, NAV-COV and NAV-RELPOSNED of the same instant.

Times are GPS time: iTOW gives the second of the week, the date of NAV-PVT the week. Layout: u-blox interface
descriptions, UBX-18010854 and later.
"""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.errors import InputError
from sinssim.logs.formats.registry import Format, library
from sinssim.logs.gps_time import WEEK, gps_from_date, unrolled
from sinssim.logs.recorded_streams import Clock, FixStream, Streams
from sinssim.system.user_file import open_file
from sinssim.units import DEG

QUALITY = {0: "no fix", 1: "dead reckoning", 2: "2D", 3: "3D", 4: "GNSS and dead reckoning", 13: "float", 14: "fixed"}
"""Meaning of the quality: fixType, or 12 + carrSoln of a solution with carrier phase."""
_KINDS = ("NAV-PVT", "NAV-HPPOSLLH", "NAV-COV", "NAV-RELPOSNED")


def recognises(path: Path, head: bytes) -> bool:
    """Return whether a UBX frame with a right checksum is in the head."""
    at = head.find(b"\xb5\x62")
    while at >= 0:
        length = int.from_bytes(head[at + 4 : at + 6], "little")
        frame = head[at + 2 : at + 6 + length]
        if len(frame) == 4 + length and head[at + 6 + length : at + 8 + length] == _checksum(frame):
            return True
        at = head.find(b"\xb5\x62", at + 1)
    return head[:2] == b"\xb5\x62"


def _checksum(frame: bytes) -> bytes:
    a = b = 0
    for byte in frame:
        a = (a + byte) & 0xFF
        b = (b + a) & 0xFF
    return bytes((a, b))


def read(path: Path) -> Streams:
    """Read the fixes, one for each NAV-PVT."""
    module = library("pyubx2", "pyubx2", str(path))
    messages: dict[str, dict[int, Any]] = {kind: {} for kind in _KINDS}
    bad = 0

    def note(error: Exception) -> None:
        nonlocal bad
        bad += "checksum" in str(error)  # other errors are stray bytes, which are no message

    with open_file(path) as file:
        reader = module.UBXReader(file, protfilter=2, quitonerror=1, errorhandler=note)
        while True:
            try:
                raw, message = reader.read()
            except Exception:  # pyubx2 raises various errors for a damaged message, and goes on after it
                bad += 1
                if bad > 10000:
                    break
                continue
            if raw is None:
                break
            if message is not None and message.identity in messages:
                messages[message.identity][len(messages[message.identity])] = message
    fixes = [m for m in messages["NAV-PVT"].values() if m.fixType in (1, 2, 3, 4) and not getattr(m, "invalidLlh", 0)]
    if not fixes:
        count = len(messages["NAV-PVT"])
        raise InputError(
            f"{path} holds no position: it has {count} NAV-PVT messages{', none with a fix' if count else ''}, "
            f"{bad} damaged messages."
        )
    others = {k: {m.iTOW: m for m in messages[k].values()} for k in _KINDS[1:]}
    clock, time = _times(path, fixes)
    stream = _stream(fixes, time, others)
    notes = ["σ are the receiver's hAcc, vAcc and sAcc, the same for north and east."]
    if bad:
        notes.append(f"{bad} damaged messages were left out.")
    return Streams(path, "ubx", clock, fixes={"gnss": stream}, notes=tuple(notes))


def _times(path: Path, fixes: list[Any]) -> tuple[Clock, np.ndarray[Any, np.dtype[np.float64]]]:
    """Return the clock and the GPS times of the fixes."""
    seconds = unrolled(np.array([m.iTOW for m in fixes]) * 1e-3, WEEK)
    dated = [(k, m) for k, m in enumerate(fixes) if m.validDate and m.validTime]
    if not dated:
        return Clock("gps", None, "seconds of the GPS week; no message has a valid date"), seconds
    k, m = dated[0]
    try:
        date = datetime(m.year, m.month, m.day, m.hour, m.min, min(m.second, 59), tzinfo=UTC)
    except ValueError as error:
        raise InputError(f"{path}: NAV-PVT at iTOW {m.iTOW} ms gives a date that does not exist: {error}.") from error
    week = round((gps_from_date(date) + m.nano * 1e-9 - float(seconds[k])) / WEEK)
    return Clock("gps", week * WEEK, f"seconds of the GPS week {week}"), seconds


def _stream(
    fixes: list[Any], time: np.ndarray[Any, np.dtype[np.float64]], others: dict[str, dict[int, Any]]
) -> FixStream:
    """Return the fixes; high precision, covariance and heading from the messages of the same iTOW."""
    precise = [others["NAV-HPPOSLLH"].get(m.iTOW, m) for m in fixes]
    precise = [m if getattr(p, "invalidLlh", 0) else p for p, m in zip(precise, fixes, strict=True)]
    place = np.array([(p.lat, p.lon, p.height * 1e-3) for p in precise])
    sigma = np.array([(p.hAcc, p.hAcc, p.vAcc) for p in precise]) * 1e-3
    covariance = np.full((len(fixes), 3, 3), math.nan)
    for k, m in enumerate(fixes):
        c = others["NAV-COV"].get(m.iTOW)
        if c is not None and c.posCovValid:
            nn, ne, nd, ee, ed, dd = (getattr(c, f"posCov{axes}") for axes in ("NN", "NE", "ND", "EE", "ED", "DD"))
            covariance[k] = ((nn, ne, nd), (ne, ee, ed), (nd, ed, dd))
    heading = np.full((len(fixes), 2), math.nan)
    for k, m in enumerate(fixes):
        r = others["NAV-RELPOSNED"].get(m.iTOW)
        if r is not None and getattr(r, "relPosHeadingValid", False):
            heading[k] = r.relPosHeading * DEG, r.accHeading * DEG
    carrier = np.array([12 + m.carrSoln if m.carrSoln else m.fixType for m in fixes])
    turned = bool(np.isfinite(heading).any())
    return FixStream(
        time=time,
        latitude=place[:, 0] * DEG,
        longitude=place[:, 1] * DEG,
        height=place[:, 2],
        datum="ellipsoid",
        position_sigma=sigma,
        velocity_ned=np.array([(m.velN, m.velE, m.velD) for m in fixes]) * 1e-3,
        velocity_sigma=np.array([(m.sAcc,) * 3 for m in fixes]) * 1e-3,
        quality=carrier.astype(np.int64),
        quality_words=QUALITY,
        heading=heading[:, 0] if turned else None,
        heading_sigma=heading[:, 1] if turned else None,
        covariance=covariance if np.isfinite(covariance).any() else None,
    )


FORMAT = Format(recognises, read)
