"""Text exports of Waypoint Inertial Explorer and GrafNav (NovAtel): a line of names, a line of units, and rows.

Columns are found by their names: Week, GPSTime, Latitude, Longitude (degrees, or degrees, minutes and seconds), H-Ell
or H-MSL, VEast, VNorth, VUp or the velocity of the body VelBdyX, VelBdyY, VelBdyZ (right, forward, up), Roll, Pitch,
Heading or Azimuth, standard deviations, Q. Exports differ in the sense of Heading: the sense is the one that agrees
with the direction of motion.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats.registry import Format
from sinssim.logs.gps_time import WEEK
from sinssim.logs.recorded_streams import Clock, FixStream, HeightDatum, SolutionStream, Streams
from sinssim.logs.text.rows import WHITESPACE, cut_rows, not_a_number, uneven
from sinssim.system.user_file import read_text
from sinssim.units import DEG

_FASTER = 2.0  # m/s; above this a vehicle moves about where it points
_R = 6.371e6  # m; a course needs no ellipsoid
_UNITS = re.compile(r"\([^)]*\)")


def recognises(path: Path, head: bytes) -> bool:
    """Return whether a line names time, latitude and height as these programs do, with units below it."""
    lines = head.decode("latin-1").splitlines()
    return any(_is_heading(names, units) for names, units in pairwise(lines))


def _is_heading(names: str, units: str) -> bool:
    words = names.replace(",", " ").split()
    named = "Latitude" in words and "Longitude" in words and any(w in words for w in ("H-Ell", "H-MSL"))
    return named and units.count("(") >= 3


def read(path: Path) -> Streams:
    """Read the solution."""
    lines = read_text(path, encoding="latin-1").splitlines()
    at = next((k for k in range(len(lines) - 1) if _is_heading(lines[k], lines[k + 1])), None)
    if at is None:
        raise InputError(f"{path} has no line of names with Latitude, Longitude and H-Ell above a line of units.")
    columns = _columns(lines[at].replace(",", " "), lines[at + 1].replace(",", " "))
    width = sum(count for _, count in columns)
    rows: list[list[float]] = []
    cut = cut_rows(path, WHITESPACE, at + 2)
    for number, line in enumerate(lines[at + 2 :], start=at + 3):
        fields = line.replace(",", " ").split()
        if not fields or number in (cut.first, cut.last):
            continue
        if len(fields) not in (width, width - 1):
            if rows:
                break  # a footer
            raise uneven(path, number, len(fields), str(width), WHITESPACE, ", as the names say")
        try:
            rows.append([_number(field) for field in fields[:width]] + [np.nan] * (width - len(fields)))
        except ValueError as error:
            raise not_a_number(path, number, fields) from error
    if len(rows) < 2:
        raise InputError(f"{path} has {len(rows)} rows below its names; at least two are needed.")
    table = np.array(rows)
    of: dict[str, Array] = {}
    first = 0
    for name, count in columns:
        part = table[:, first : first + count]
        sign = np.where(np.signbit(part[:, 0]), -1.0, 1.0)
        value = part[:, 0] if count == 1 else sign * (np.abs(part[:, 0]) + part[:, 1] / 60.0 + part[:, 2] / 3600.0)
        of.setdefault(name, value)
        first += count
    return _streams(path, of, [*cut.notes])


def _columns(names: str, units: str) -> list[tuple[str, int]]:
    """Return the names, and how many numbers each has: three for degrees, minutes and seconds."""
    spans = [(m.group(), m.start(), m.end()) for m in re.finditer(r"\S+", names)]
    triple = set()
    for unit in _UNITS.finditer(units):
        if re.search(r"D\s+M\s+S", unit.group()):
            near = min(range(len(spans)), key=lambda k: abs(spans[k][2] - unit.end()))
            triple.add(near)
    return [(name, 3 if k in triple else 1) for k, (name, _, _) in enumerate(spans)]


def _number(text: str) -> float:
    if ":" in text or text.count("/") == 2:  # dates and times of day beside the GPS time
        return float("nan")
    return float(text)


def _streams(path: Path, of: dict[str, Array], notes: list[str]) -> Streams:
    if "GPSTime" not in of:
        raise InputError(f"{path} has no column GPSTime: export it, with Week.")
    known = "Week" in of
    week = int(of["Week"][0]) if known else 0
    time = of["GPSTime"] + ((of["Week"] - week) * WEEK if known else 0.0)
    latitude, longitude = of["Latitude"] * DEG, of["Longitude"] * DEG
    ellipsoidal = "H-Ell" in of
    height = of["H-Ell"] if ellipsoidal else of["H-MSL"]
    datum: HeightDatum = "ellipsoid" if ellipsoidal else "mean sea level"
    velocity = None
    if {"VEast", "VNorth", "VUp"} <= set(of):
        velocity = np.column_stack([of["VNorth"], of["VEast"], -of["VUp"]])
    q_nb = None
    heading = of.get("Azimuth", of.get("Heading"))
    if heading is not None and {"Roll", "Pitch"} <= set(of):
        sense = _sense(time, latitude, longitude, velocity, heading * DEG)
        notes += ["Heading is counted counter-clockwise, as the direction of motion shows."] if sense < 0.0 else []
        q_nb = rotation.quaternion_from_euler(of["Roll"] * DEG, of["Pitch"] * DEG, sense * heading * DEG)
        if velocity is None and {"VelBdyX", "VelBdyY", "VelBdyZ"} <= set(of):
            body = np.column_stack([of["VelBdyY"], of["VelBdyX"], -of["VelBdyZ"]])
            velocity = np.einsum("nij,nj->ni", rotation.dcm_from_quaternion(q_nb), body)
    sigma = None
    for names in (("SDNorth", "SDEast", "SDHeight"), ("SDHoriz", "SDHoriz", "SDHeight")):
        if sigma is None and set(names) <= set(of):
            sigma = np.column_stack([of[name] for name in names])
    clock = Clock("gps", week * WEEK if known else None, f"seconds of the GPS week {week}" if known else "GPS seconds")
    if q_nb is None:
        fixes = FixStream(time, latitude, longitude, height, datum, sigma, velocity)
        return Streams(path, "inertial-explorer", clock, fixes={"gnss": fixes}, notes=tuple(notes))
    solution = SolutionStream(time, latitude, longitude, height, datum, velocity, q_nb, sigma)
    return Streams(path, "inertial-explorer", clock, solutions={"solution": solution}, notes=tuple(notes))


def _sense(time: Array, latitude: Array, longitude: Array, velocity: Array | None, heading: Array) -> float:
    """Return 1 if the heading is clockwise from north, −1 if it is counter-clockwise, by the direction of motion."""
    if velocity is None:
        north = np.gradient(latitude, time) * _R
        east = np.gradient(np.unwrap(longitude), time) * _R * np.cos(latitude)
    else:
        north, east = velocity[:, 0], velocity[:, 1]
    moving = np.hypot(north, east) > _FASTER
    if not moving.any():
        return 1.0
    course = np.arctan2(east, north)[moving]
    with_it, against = (float(np.mean(np.cos(sense * heading[moving] - course))) for sense in (1.0, -1.0))
    return 1.0 if with_it >= against else -1.0


FORMAT = Format(recognises, read)
