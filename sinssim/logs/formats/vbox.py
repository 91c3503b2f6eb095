"""Racelogic VBOX (.vbo): sections in brackets, column names, and rows of numbers with blanks between them.

Latitude and longitude are minutes, west positive; times are hhmmss.ss in UTC, with the date in the first line; speeds
are km/h unless the heading says otherwise. Layout: "VBO file format", Racelogic support centre.
"""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

import numpy as np

from sinssim.errors import InputError
from sinssim.logs.gps_time import DAY, EPOCH_UNIX, gps_from_unix, unrolled
from sinssim.logs.recorded_streams import Clock, FixStream, Streams
from sinssim.logs.text.rows import WHITESPACE, cut_rows, numbers_of
from sinssim.system.user_file import read_text
from sinssim.units import DEG, KNOT

_GPS_EPOCH = datetime(1980, 1, 6)
_MINUTE = DEG / 60.0


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first lines have the sections of a VBOX file."""
    text = head.lower()
    return b"[column names]" in text or (path.suffix.lower() == ".vbo" and b"[header]" in text)


def read(path: Path) -> Streams:
    """Read the fixes."""
    lines = read_text(path, encoding="latin-1").splitlines()
    sections: dict[str, list[tuple[int, str]]] = {}
    name = ""
    for number, line in enumerate(lines, start=1):
        if line.strip().startswith("["):
            name = line.strip().lower()
        elif line.strip():
            sections.setdefault(name, []).append((number, line.strip()))
    columns = " ".join(line for _, line in sections.get("[column names]", ())).lower().split()
    if not {"time", "lat", "long"} <= set(columns) or not sections.get("[data]"):
        raise InputError(f"{path} has no [column names] with time, lat and long, or no [data].")
    cut = cut_rows(path, WHITESPACE, sections["[data]"][0][0] - 1, len(columns))
    rows = ((k, line.split()) for k, line in sections["[data]"] if k not in (cut.first, cut.last))
    table = numbers_of(path, rows, len(columns))
    table = table[(table[:, columns.index("lat")] != 0.0) | (table[:, columns.index("long")] != 0.0)]
    if not len(table):
        raise InputError(f"{path} has no position.")
    of = {key: table[:, k] for k, key in enumerate(columns)}
    heading = " ".join(line for _, line in sections.get("[header]", ())).lower()
    speed_unit = KNOT if "velocity knots" in heading else 1.0 / 3.6
    clock, time = _clock(of["time"], lines[0])
    velocity = None
    if {"velocity", "heading"} <= set(columns):
        speed, course = of["velocity"] * speed_unit, of["heading"] * DEG
        vertical = next((of[key] for key in ("vert-vel", "vertical_velocity", "vert_vel") if key in of), None)
        scale = 1.0 if "vertical velocity m/s" in heading else 1.0 / 3.6
        down = np.full(len(table), np.nan) if vertical is None else -vertical * scale
        velocity = np.column_stack([speed * np.cos(course), speed * np.sin(course), down])
    height = of.get("height", np.full(len(table), np.nan))
    fixes = FixStream(time, of["lat"] * _MINUTE, -of["long"] * _MINUTE, height, velocity_ned=velocity)
    return Streams(path, "vbox", clock, fixes={"gnss": fixes}, notes=cut.notes)


def _clock(stamps: np.ndarray[tuple[int], np.dtype[np.float64]], first: str) -> tuple[Clock, np.ndarray]:
    """Return the clock and the times of stamps such as 160001.25."""
    whole = np.floor(stamps + 1e-6)
    seconds = unrolled(whole // 10000 * 3600 + whole // 100 % 100 * 60 + whole % 100 + (stamps - whole), DAY)
    date = re.search(r"(\d{1,2})[/.-](\d{1,2})[/.-](\d{4})", first)
    if date is None:
        return Clock("utc", None, "time of day in UTC, without a date"), seconds
    try:
        day = (datetime(int(date[3]), int(date[2]), int(date[1])) - _GPS_EPOCH).days * DAY
    except ValueError:
        return Clock("utc", None, "time of day in UTC, without a date"), seconds
    return Clock("utc", int(gps_from_unix(day + EPOCH_UNIX)), "time of day in UTC, date of the file"), seconds
