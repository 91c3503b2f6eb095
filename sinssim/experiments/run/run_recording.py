"""The Rerun recording of a run.

Its streams thinned and in the units that people read, motion in further coordinates, and the vehicle in the 3D views.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, NavSolution, NavState, blocks
from sinssim.experiments.run.vehicle_mesh import Mesh, vehicle_mesh
from sinssim.recording import style
from sinssim.recording.rerun_scene import Scene
from sinssim.recording.streams import Stream, Vector
from sinssim.recording.style import RowNumbers, thinned
from sinssim.recording.track_map import airports_about, coasts_about
from sinssim.truth.flight.jsbsim_model import AIRLINER, Proportions
from sinssim.truth.sampling import FlightEvent

if TYPE_CHECKING:
    from sinssim.experiments.run.run_result import DrawnPath
    from sinssim.recording.rerun_file import Recording


_UNITS = (("_rad", "deg", units.DEG), ("_mps", "m/s", 1.0), ("_m", "km", 1e3))
_FAR = 1e5  # m: farther places are shown in km
_VECTOR = ("x", "y", "z")
_QUATERNION = ("reference", *_VECTOR)


def draw_coordinates(recording: Recording, streams: Iterable[Stream]) -> dict[str, str]:
    """Record the streams of one motion, below `coordinates/`; return labels for the view's titles: the unit of each
    vector, and that there are coordinates."""
    labels = {}
    for stream in streams:
        rows = thinned(len(stream.time))
        for vector in stream.vectors:
            values = _some(vector, rows, len(stream.time))
            names, unit, size = _shown(vector.columns, values)
            where = f"coordinates/{stream.name}/{vector.name}"
            parts = _QUATERNION if len(names) == 4 else _VECTOR
            colors = [style.COLORS[part] for part in parts[: len(names)]]
            recording.series(where, stream.time[rows], values / size, names, colors=colors, widths=1.6)
            labels[where] = unit
    return {**labels, "coordinates": "yes"} if labels else {}


def _some(vector: Vector, rows: RowNumbers, count: int) -> Array:
    """Return some rows of a vector, which is computed in blocks."""
    parts = []
    for block in blocks(count):
        inside = rows[(rows >= block.start) & (rows < block.stop)] - block.start
        parts.append(vector.values[block][inside])
    return np.concatenate(parts)


def _shown(columns: tuple[str, ...], values: Array) -> tuple[list[str], str, float]:
    """Return the names, the unit and its size for a plot; metres up to a hundred kilometres."""
    for ending, unit, size in _UNITS:
        if all(column.endswith(ending) for column in columns):
            names = [column.removesuffix(ending).replace("_", " ") for column in columns]
            near = unit == "km" and float(np.nanmax(np.abs(values), initial=0.0)) < _FAR
            return names, "m" if near else unit, 1.0 if near else size
    return [column.replace("_", " ") for column in columns], "", 1.0


_PATH_POINTS = 4096
_POSTS = 60


def draw_flight(
    recording: Recording,
    time: Array,
    truth: NavState,
    scene: Scene,
    events: Sequence[FlightEvent],
    kind: str = "",
    shape: Proportions = AIRLINER,
) -> None:
    """Record the motion of a kind of vehicle, a key of `PATHS`, with the proportions of an aircraft, on the map, in the
    3D scene and as an attitude."""
    import rerun as rr

    k = thinned(len(time))
    t, lat, lon, height, q_nb = time[k], truth.latitude[k], truth.longitude[k], truth.height[k], truth.q_nb[k]
    path = thinned(len(k), _PATH_POINTS)
    lat_lon = np.column_stack((lat, lon)) / units.DEG
    color = style.COLORS["truth"]
    grey = style.COLORS["ground"]
    if coasts := coasts_about(lat[path], lon[path]):  # also where no network has the viewer's map
        recording.static("map/coasts", rr.GeoLineStrings(lat_lon=coasts, radii=rr.Radius.ui_points(0.6), colors=grey))
    if len(airports := airports_about(lat[path], lon[path])):
        recording.static("map/airports", rr.GeoPoints(lat_lon=airports, radii=rr.Radius.ui_points(2.0), colors=grey))
    recording.static(
        "map/truth", rr.GeoLineStrings(lat_lon=[lat_lon[path]], radii=rr.Radius.ui_points(2.5), colors=color)
    )
    recording.static("map/vehicle", rr.GeoPoints.from_fields(radii=rr.Radius.ui_points(7.0), colors=[(213, 94, 0)]))
    recording.columns("map/vehicle", t, rr.GeoPoints.columns(positions=lat_lon))

    points = scene.points(lat, lon, height)
    ground = points[path] * (1.0, 1.0, 0.0)
    recording.static("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    recording.static("world/path", rr.LineStrips3D([points[path]], radii=rr.Radius.ui_points(1.8), colors=color))
    recording.static("world/ground", rr.LineStrips3D([ground], radii=rr.Radius.ui_points(1.0), colors=grey))
    posts = thinned(len(path), _POSTS)
    recording.static(
        "world/posts",
        rr.LineStrips3D(
            np.stack((ground[posts], points[path][posts]), axis=1), radii=rr.Radius.ui_points(0.6), colors=(*grey, 110)
        ),
    )
    if events:
        at = np.searchsorted(t, [event.time for event in events]).clip(max=len(t) - 1)
        texts = [event.text for event in events]
        marks = rr.Points3D(
            points[at], labels=texts, show_labels=False, radii=rr.Radius.ui_points(4.0), colors=(230, 159, 0)
        )
        recording.static("world/events", marks)
    q = scene.attitudes(lat, lon, q_nb)
    mesh = vehicle_mesh(kind, shape)
    _draw_vehicle(recording, "world/vehicle", t, points, q, scene.vehicle_length, mesh)
    _draw_attitude(recording, t, q_nb, mesh)


def draw_outages(recording: Recording, time: Array, truth: NavState, outages: Sequence[tuple[float, float]]) -> None:
    """Mark the parts of the track without satellites on the map. `time`: (N,) s; `outages`: spans, s."""
    import rerun as rr

    parts = []
    for begin, end in outages:
        first, last = (int(k) for k in np.searchsorted(time, (begin, end)))
        if last - first > 1:
            k = first + thinned(last - first, _PATH_POINTS)
            parts.append(np.column_stack((truth.latitude[k], truth.longitude[k])) / units.DEG)
    if parts:
        color = style.tint(style.COLORS["refused"])
        recording.static(
            "map/no_satellites", rr.GeoLineStrings(lat_lon=parts, radii=rr.Radius.ui_points(6.0), colors=color)
        )


def _draw_attitude(recording: Recording, t: Array, q_nb: Array, mesh: Mesh) -> None:
    """Record the vehicle's attitude in the local level, with horizon and compass, below `attitude/`."""
    import rerun as rr

    grey = style.COLORS["ground"]
    swap = rotation.multiply(np.array([0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0]), q_nb)
    recording.static("attitude", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    _draw_vehicle(recording, "attitude/vehicle", t, np.zeros((len(t), 3)), swap, 1.0, mesh)
    ring = np.linspace(0.0, 2.0 * np.pi, 73)
    horizon = 0.75 * np.column_stack((np.cos(ring), np.sin(ring), np.zeros_like(ring)))
    recording.static("attitude/horizon", rr.LineStrips3D([horizon], radii=rr.Radius.ui_points(1.0), colors=grey))
    letters = 0.82 * np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]])
    recording.static("attitude/compass", rr.Points3D(letters, labels=["N", "E", "S", "W"], radii=0.006, colors=grey))


def _draw_vehicle(
    recording: Recording, entity: str, time: Array, points: Array, q: Array, length: float, mesh: Mesh
) -> None:
    """Record a moving vehicle: a mesh in body axes below a transform over time."""
    import rerun as rr

    vertices, triangles, shades = mesh
    color = np.array(style.COLORS["vehicle"])
    drawn = rr.Mesh3D(
        vertex_positions=length * vertices,
        triangle_indices=triangles,
        vertex_colors=(shades[:, None] * color).astype(np.uint8),
    )
    recording.static(entity, drawn)
    recording.columns(entity, time, rr.Transform3D.columns(translation=points, quaternion=np.roll(q, -1, axis=1)))


def draw_path(
    recording: Recording, scene: Scene, name: str, solution: NavSolution, color: style.Rgb, width: float = 2.0
) -> None:
    """Record the path of a solution on the map and in the 3D scene, by lines as wide as in plots, points."""
    import rerun as rr

    s = solution
    path = thinned(len(s.time), _PATH_POINTS)
    lat_lon = np.column_stack((s.latitude[path], s.longitude[path])) / units.DEG
    radius = rr.Radius.ui_points(0.4 * width)
    recording.static(f"map/{name}", rr.GeoLineStrings(lat_lon=[lat_lon], radii=radius, colors=color))
    points = scene.points(s.latitude[path], s.longitude[path], s.height[path])
    recording.static(f"world/nav/{name}", rr.LineStrips3D([points], radii=radius, colors=color))


def draw_line(recording: Recording, scene: Scene, path: DrawnPath) -> None:
    """Record a line, or points with words, on the map and in the 3D scene."""
    import rerun as rr

    known = np.isfinite(path.latitude)
    parts = [part for part in np.split(np.arange(len(known)), np.flatnonzero(np.diff(known)) + 1) if known[part[0]]]
    lat_lon = [np.column_stack((path.latitude[k], path.longitude[k])) / units.DEG for k in parts]
    places = [scene.points(path.latitude[k], path.longitude[k], path.height[k]) for k in parts]
    color, radius = style.colors([path.color])[0], rr.Radius.ui_points(0.9)
    if path.words:
        points = rr.Points3D(places[0], labels=path.words, radii=rr.Radius.ui_points(4.0), colors=color)
        recording.static(f"world/{path.name}", points)
        recording.static(
            f"map/{path.name}", rr.GeoPoints(lat_lon=lat_lon[0], radii=rr.Radius.ui_points(4.0), colors=color)
        )
        return
    recording.static(f"map/{path.name}", rr.GeoLineStrings(lat_lon=lat_lon, radii=radius, colors=color))
    recording.static(f"world/{path.name}", rr.LineStrips3D(places, radii=radius, colors=color))
