"""ArduPilot onboard logs: binary DataFlash (.bin), its text form (.log), and the text that mavlogdump prints.

Layout: every log describes its own messages by FMT messages (ArduPilot, libraries/AP_Logger/LogStructure.h). Used are
IMU (with the number of the unit in I, or as IMU, IMU2, IMU3), GPS and GPA. Times are microseconds since the start of
the autopilot; logs of 2014 and before have milliseconds (`_RENAMED`). Fixes have the time of the receiver, and the
smallest delay of their arrival puts it on that clock.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats.registry import Format
from sinssim.logs.gps_time import WEEK
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, Streams
from sinssim.logs.text.rows import cut_row
from sinssim.system.user_file import read_bytes
from sinssim.units import DEG

QUALITY = {0: "no receiver", 1: "no fix", 2: "2D", 3: "single", 4: "differential", 5: "float", 6: "fixed", 7: "static",
           8: "PPP"}  # fmt: skip
"""Meaning of GPS.Status."""
_3D = 3
_SYNC = b"\xa3\x95"
_FMT = 128
_FMT_SIZE = 89
_NUMBERS = {"b": "i1", "B": "u1", "M": "u1", "h": "<i2", "H": "<u2", "c": "<i2", "C": "<u2", "i": "<i4", "I": "<u4",
            "e": "<i4", "E": "<u4", "L": "<i4", "q": "<i8", "Q": "<u8", "f": "<f4", "d": "<f8", "g": "<f2", "n": "S4",
            "N": "S16", "Z": "S64", "a": "V64"}  # fmt: skip
"""Types of the fields by the letters of a message's format."""
_SCALES = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
_RENAMED = {
    "IMU": {"TimeMS": ("TimeUS", 1e3)},
    "GPS": {"TimeMS": ("GMS", 1.0), "Week": ("GWk", 1.0), "T": ("TimeUS", 1e3)},
}
"""Columns of logs before ArduCopter 3.3 and ArduPlane 3.3: their present name, and the factor to its unit."""
_WANTED = re.compile(r"(?:IMU[23]?|GPS2?|GPA)$")
_DUMPED = re.compile(rb"^(?:\S+ \S+: )?([A-Z][A-Z0-9]{2,3}) \{(.*)\}\s*$")

Messages = dict[str, dict[str, Array]]
"""Columns of the messages by their names."""


def recognises(path: Path, head: bytes) -> bool:
    """Return whether a file begins with a FMT message, or with a line of mavlogdump."""
    if head.startswith((_SYNC + bytes((_FMT,)), b"FMT,")):
        return True
    return any(_DUMPED.match(line) and b" : " in line for line in head.splitlines()[:3])


def read(path: Path) -> Streams:
    """Read the readings of all units and receivers."""
    data = read_bytes(path)
    notes: list[str] = []
    if data.startswith(_SYNC):
        messages = _binary(path, data, notes)
    else:
        messages = _text(path, data, notes)
    messages = {name: _present_names(name, message) for name, message in messages.items()}
    inertial = _inertial(messages)
    fixes, origin = _fixes(messages)
    if not (inertial or fixes):
        raise InputError(
            f"{path} holds neither IMU messages with a time nor GPS messages with a fix: {_listed(messages) or 'none'}."
        )
    untimed = [name for name, message in messages.items() if "TimeUS" not in message]
    if untimed:
        notes.append(
            f"Messages without a time of the autopilot are left out: {_listed({k: messages[k] for k in untimed})}."
        )
    if len(inertial) > 1:
        notes.append(f"There are {len(inertial)} IMUs: {', '.join(inertial)}.")
    note = "time since the start of the autopilot" + ("" if origin is None else ", by the receiver's GPS time")
    return Streams(path, "ardupilot", Clock("machine", origin, note), inertial, fixes, notes=tuple(notes))


def _present_names(name: str, message: dict[str, Array]) -> dict[str, Array]:
    """Return the columns of a message by their present names."""
    former = _RENAMED.get(name.rstrip("23"), {})
    if "TimeUS" in message:
        return message
    given = {key: former.get(key, (key, 1.0)) for key in message}
    return {new: message[key] * factor for key, (new, factor) in given.items()}


def _listed(messages: Messages) -> str:
    """Return what messages hold."""
    return "; ".join(f"{len(next(iter(m.values())))} {name} with {', '.join(m)}" for name, m in messages.items())


def _binary(path: Path, data: bytes, notes: list[str]) -> Messages:
    """Return the wanted messages of a binary log."""
    sizes = {_FMT: _FMT_SIZE}
    layouts: dict[int, tuple[str, str, list[str]]] = {}
    bodies: dict[int, list[bytes]] = {}
    at = skipped = 0
    first = -1
    while at + 3 <= len(data):
        size = sizes.get(data[at + 2], 0) if data[at : at + 2] == _SYNC else 0
        if not size or at + size > len(data):
            first = at if first < 0 else first
            following = data.find(_SYNC, at + 1)
            following = len(data) if following < 0 else following
            skipped, at = skipped + following - at, following
            continue
        kind = data[at + 2]
        if kind == _FMT:
            number_of_kind, length, name, letters, columns = struct.unpack("<BB4s16s64s", data[at + 3 : at + _FMT_SIZE])
            texts = [part.split(b"\0")[0].decode("latin-1") for part in (name, letters, columns)]
            layouts[number_of_kind] = texts[0], texts[1], texts[2].split(",")
            sizes[number_of_kind] = length
        elif kind in layouts and _WANTED.match(layouts[kind][0]):
            bodies.setdefault(kind, []).append(data[at + 3 : at + size])
        at += size
    if skipped:
        notes.append(f"{skipped} bytes that are no message are left out, the first at byte {first}.")
    messages: Messages = {}
    for kind, parts in bodies.items():
        name, letters, columns = layouts[kind]
        odd = len(letters) != len(set(columns)) or len(columns) != len(letters) or not all(columns)
        if odd or set(letters) - set(_NUMBERS):
            raise InputError(f"{path}: the message {name} has the unknown format {letters!r} {','.join(columns)!r}.")
        dtype = np.dtype([(column, _NUMBERS[letter]) for column, letter in zip(columns, letters, strict=True)])
        if dtype.itemsize != len(parts[0]):
            raise InputError(
                f"{path}: the message {name} has {len(parts[0])} bytes; its format needs {dtype.itemsize}."
            )
        rows = np.frombuffer(b"".join(parts), dtype=dtype)
        messages[name] = {
            column: rows[column].astype(np.float64) * _SCALES.get(letter, 1.0)
            for column, letter in zip(columns, letters, strict=True)
            if letter not in "nNZa"
        }
    return messages


def _text(path: Path, data: bytes, notes: list[str]) -> Messages:
    """Return the wanted messages of a log as text, or of what mavlogdump prints."""
    names: dict[str, list[str]] = {}
    rows: dict[str, list[list[str]]] = {}
    lines = data.splitlines()
    for number, line in enumerate(lines, start=1):
        dumped = _DUMPED.match(line)
        if dumped is not None:
            name = dumped[1].decode()
            if not _WANTED.match(name):
                continue
            pairs = [pair.partition(" : ") for pair in dumped[2].decode("latin-1").split(", ")]
            fields, columns = [value for _, _, value in pairs], [key.strip() for key, _, _ in pairs]
            names.setdefault(name, columns)
        else:
            fields = [field.strip() for field in line.decode("latin-1").split(",")]
            name = fields.pop(0)
            if name == "FMT" and len(fields) > 4:
                names[fields[2]] = fields[4:]
                continue
            if not _WANTED.match(name) or name not in names:
                continue
        if number == len(lines) and len(fields) < len(names[name]):
            notes.append(cut_row(path.name, number, "last", len(fields), len(names[name])))
            continue
        if len(fields) != len(names[name]):
            raise InputError(
                f"{path}, line {number}: {name} has {len(fields)} fields; its format names {len(names[name])}."
            )
        rows.setdefault(name, []).append(fields)
        try:
            [float(field) for field in fields]
        except ValueError as error:
            raise InputError(f"{path}, line {number}: {name}: {error}.") from error
    return {
        name: dict(zip(names[name], np.array(many, dtype=np.float64).T, strict=True)) for name, many in rows.items()
    }


def _inertial(messages: Messages) -> dict[str, InertialStream]:
    """Return the readings of each unit, forward, right, down."""
    streams: dict[str, InertialStream] = {}
    keys = [*("GyrX", "GyrY", "GyrZ"), *("AccX", "AccY", "AccZ")]
    for name in ("IMU", "IMU2", "IMU3"):
        message = messages.get(name)
        if message is None or not {"TimeUS", *keys} <= set(message):
            continue
        rows = np.column_stack([message["TimeUS"] * 1e-6, *(message[key] for key in keys)])
        units = message.get("I", np.full(len(rows), float(name[3:] or 1) - 1.0))
        for unit in np.unique(units):
            of_unit = rows[units == unit]
            axes = "forward", "right", "down"
            streams[f"imu{int(unit)}"] = InertialStream(of_unit[:, 0], of_unit[:, 1:4], of_unit[:, 4:], axes=axes)
    return streams


def _fixes(messages: Messages) -> tuple[dict[str, FixStream], int | None]:
    """Return the fixes of each receiver, and the GPS time of the start of the autopilot."""
    streams: dict[str, FixStream] = {}
    origin: int | None = None
    for name in ("GPS", "GPS2"):
        message = messages.get(name)
        if message is None or not {"TimeUS", "Status", "Lat", "Lng", "Alt", "Spd", "GCrs", "GMS", "GWk"} <= set(
            message
        ):
            continue
        units = message.get("I", np.full(len(message["TimeUS"]), float(name[3:] or 1) - 1.0))
        for unit in np.unique(units):
            chosen = (units == unit) & (message["Status"] >= _3D) & (message["GWk"] > 0.0)
            chosen &= np.append(True, np.diff(message["GMS"]) != 0.0) | ("I" in message)
            if not chosen.any():
                continue
            of_receiver = {key: values[chosen] for key, values in message.items()}
            received = of_receiver["TimeUS"] * 1e-6
            measured = of_receiver["GWk"] * WEEK + of_receiver["GMS"] * 1e-3
            start = float(np.max(measured - received))  # the fix that arrived soonest
            origin = round(start) if origin is None else origin
            streams[f"gps{int(unit)}"] = _stream(of_receiver, measured - origin, messages.get("GPA"), unit)
    return streams, origin


def _stream(gps: dict[str, Array], time: Array, accuracy: dict[str, Array] | None, unit: float) -> FixStream:
    speed, course = gps["Spd"], gps["GCrs"] * DEG
    down = gps.get("VZ", np.full(len(speed), np.nan))
    sigma = velocity_sigma = None
    if accuracy is not None and {"HAcc", "VAcc", "SAcc"} <= set(accuracy):
        of = accuracy["I"] == unit if "I" in accuracy else np.ones(len(accuracy["TimeUS"]), dtype=bool)
        row = np.searchsorted(accuracy["TimeUS"][of], gps["TimeUS"]) if of.any() else None
        if row is not None:
            row = np.minimum(row, int(of.sum()) - 1)
            across, vertical, fast = (accuracy[key][of][row] for key in ("HAcc", "VAcc", "SAcc"))
            sigma = np.column_stack([across, across, vertical])
            velocity_sigma = np.column_stack([fast, fast, fast])
    quality = gps["Status"].astype(np.int64)
    return FixStream(
        time,
        gps["Lat"] * DEG,
        gps["Lng"] * DEG,
        gps["Alt"],
        "mean sea level",
        sigma,
        np.column_stack([speed * np.cos(course), speed * np.sin(course), down]),
        velocity_sigma,
        quality,
        {code: QUALITY.get(code, f"code {code}") for code in sorted(set(quality.tolist()))},
    )


FORMAT = Format(recognises, read)
