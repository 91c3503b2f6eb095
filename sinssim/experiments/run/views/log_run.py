"""Logs a run for the viewer: thins its streams and converts them to degrees, arcminutes, metres and nautical miles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.experiments.run.sensor_comparison import SensorComparison
from sinssim.experiments.run.views.models import vehicle_mesh
from sinssim.recording import style
from sinssim.recording.rerun.scene import Scene
from sinssim.recording.scales import Rows, gaps, thinned
from sinssim.scales import ANGLES, HEIGHTS, LENGTHS, SPEEDS, Scale, suiting
from sinssim.strapdown.nav_error import NavError
from sinssim.truth.channel import FlightEvent

if TYPE_CHECKING:
    from sinssim.recording.rerun.rrd import Recording

_PATH_POINTS = 4096
_POSTS = 60
_UP = -1.0
"""Down to up."""


def draw_flight(
    recording: Recording,
    time: Array,
    truth: NavState,
    scene: Scene,
    events: Sequence[FlightEvent],
    angles: str | None = None,
    kind: str = "",
) -> None:
    """Record the true flight as lines, map and 3D scene, below `flight/`.

    Args:
        time: (N,) s.
        scene: the scene of the 3D view.
        angles: range of the heading, or "continuous"; None for 0…360°.
        kind: kind of vehicle, a key of `sinssim.experiments.run.views.models.PATHS`.
    """
    import rerun as rr

    k = thinned(len(time))
    t, lat, lon, height = time[k], truth.latitude[k], truth.longitude[k], truth.height[k]
    velocity, q_nb = truth.velocity_ned[k], truth.q_nb[k]
    roll, pitch, _ = (angle / units.DEG for angle in rotation.euler_from_quaternion(q_nb))
    heading = rotation.shown_heading(angles, rotation.euler_from_quaternion(truth.q_nb)[2])[k] / units.DEG
    blue, green, orange = style.colors(["z", "y", "x"])
    leaning = np.column_stack((gaps(np.round(roll, 9), 360.0), np.round(pitch, 9)))  # of a level vehicle, no rounding
    recording.series("flight/roll_pitch", t, leaning, ["roll", "pitch"], colors=[orange, blue])
    recording.series("flight/heading", t, gaps(heading, 360.0)[:, None], ["heading"], colors=[green])
    recording.series("flight/height", t, height[:, None], ["height"], colors=[green])
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    recording.series("flight/ground_speed", t, speed[:, None], ["ground speed"], colors=[green])
    recording.series("flight/vertical_speed", t, _UP * velocity[:, 2:], ["vertical speed"], colors=[blue])

    path = thinned(len(k), _PATH_POINTS)
    lat_lon = np.column_stack((lat, lon)) / units.DEG
    color = style.COLORS["truth"]
    recording.static(
        "map/truth", rr.GeoLineStrings(lat_lon=[lat_lon[path]], radii=rr.Radius.ui_points(2.5), colors=color)
    )
    recording.static("map/vehicle", rr.GeoPoints.from_fields(radii=rr.Radius.ui_points(7.0), colors=[(213, 94, 0)]))
    recording.columns("map/vehicle", t, rr.GeoPoints.columns(positions=lat_lon))

    points = scene.points(lat, lon, height)
    ground = points[path] * (1.0, 1.0, 0.0)
    grey = style.COLORS["ground"]
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
    _draw_vehicle(recording, "world/vehicle", t, points, q, scene.vehicle_length, kind)

    _draw_attitude(recording, t, q_nb, kind)


def draw_outages(recording: Recording, time: Array, truth: NavState, outages: Sequence[tuple[float, float]]) -> None:
    """Mark the parts of the track without satellites on the map.

    Args:
        time: (N,) s.
        outages: spans, s.
    """
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


def _draw_attitude(recording: Recording, t: Array, q_nb: Array, kind: str) -> None:
    """Record the vehicle's attitude in the local level, with horizon and compass, below `attitude/`."""
    import rerun as rr

    grey = style.COLORS["ground"]
    swap = rotation.multiply(np.array([0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0]), q_nb)
    recording.static("attitude", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    _draw_vehicle(recording, "attitude/vehicle", t, np.zeros((len(t), 3)), swap, 1.0, kind)
    ring = np.linspace(0.0, 2.0 * np.pi, 73)
    horizon = 0.75 * np.column_stack((np.cos(ring), np.sin(ring), np.zeros_like(ring)))
    recording.static("attitude/horizon", rr.LineStrips3D([horizon], radii=rr.Radius.ui_points(1.0), colors=grey))
    letters = 0.82 * np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]])
    recording.static("attitude/compass", rr.Points3D(letters, labels=["N", "E", "S", "W"], radii=0.006, colors=grey))


def _draw_vehicle(
    recording: Recording, entity: str, time: Array, points: Array, q: Array, length: float, kind: str
) -> None:
    """Record a moving vehicle: a mesh in body axes below a transform over time."""
    import rerun as rr

    vertices, triangles, shades = vehicle_mesh(kind)
    color = np.array(style.COLORS["vehicle"])
    mesh = rr.Mesh3D(
        vertex_positions=length * vertices,
        triangle_indices=triangles,
        vertex_colors=(shades[:, None] * color).astype(np.uint8),
    )
    recording.static(entity, mesh)
    recording.columns(entity, time, rr.Transform3D.columns(translation=points, quaternion=np.roll(q, -1, axis=1)))


def draw_sensors(recording: Recording, kinds: Iterable[SensorComparison]) -> dict[str, str]:
    """Record the readings of the sensors and their errors, below `sensors/`: means over intervals, and sums.

    The reference is drawn wide and pale below the line compared with it: the ideal reading below the measured one, the
    measured error below the error after compensation.
    """
    labels: dict[str, str] = {}
    for kind in kinds:
        labels |= _draw_kind(recording, kind)
    return labels


def draw_recorded_sensors(recording: Recording, imu: ImuData) -> dict[str, str]:
    """Record what an inertial unit sensed, below `sensors/`: mean rates and specific forces."""
    labels, edges = {"sensors": "recorded"}, thinned(len(imu.time))
    for key, title, increments, size in (
        ("gyro", "Gyros", imu.dtheta, units.DEG),
        ("accel", "Accelerometers", imu.dvel, 1.0),
    ):
        labels[f"{key}_title"] = title
        rows = _means(imu.time, increments, edges) / size
        recording.series(f"sensors/{key}/measured", imu.time[edges[1:]], rows, ["x", "y", "z"], widths=1.2)
    return labels


def _draw_kind(recording: Recording, kind: SensorComparison) -> dict[str, str]:
    time, paint = kind.time, style.colors(kind.names)
    labels = {"sensor_window": f"{kind.window:g} s", f"{kind.key}_title": kind.title}
    below = ([style.tint(color) for color in paint], 4.0)
    above = (paint, 1.2)
    edges = thinned(len(time))

    def lines(key: str, at: Array, values: Array, word: str, look: tuple[list[style.Rgb], float]) -> None:
        names = [f"{axis} {word}".rstrip() for axis in kind.names]
        recording.series(f"sensors/{kind.key}/{key}", at, values, names, colors=look[0], widths=look[1])

    for word, increments, look in (("ideal", kind.ideal, below), ("measured", kind.measured, above)):
        if increments is not None:
            lines(word, time[edges[1:]], _means(time, increments, edges) / kind.reading[1], word, look)
    labels[f"{kind.key}_sum"], size = suiting(kind.sums, kind.error)
    both = [("", "", kind.error, (paint, 1.5))]
    if kind.left is not None:
        both = [("", "measured", kind.error, below), ("_compensated", "compensated", kind.left, above)]
        labels[f"{kind.key}_left"], own = suiting(kind.sums, kind.left)
        lines("left", time[edges], kind.left[edges] / own, "", (paint, 1.5))
    for suffix, word, total, look in both:
        lines(f"sum{suffix}", time[edges], total[edges] / size, word, look)
        at, means = kind.averaged(total)
        if len(at):
            lines(f"error{suffix}", at, means / (size if kind.measured is None else kind.drift[1]), word, look)
    return labels


def _means(time: Array, increments: Array, edges: Rows) -> Array:
    """Return mean rates between chosen edges, the last one among them: sums of whole increments, without aliasing."""
    sums: Array = np.add.reduceat(increments, edges[:-1], axis=0)
    means: Array = sums / np.diff(time[edges])[:, np.newaxis]
    return means


def draw_navigation(
    recording: Recording,
    scene: Scene,
    solutions: Mapping[str, NavSolution],
    errors: Mapping[str, NavError],
) -> dict[str, str]:
    """Record the errors of each algorithm, below `navigation/`: one plot per component, one line per algorithm.

    Args:
        scene: the scene of the 3D view.
    """
    names = list(errors)
    time = max((error.time for error in errors.values()), key=len)
    time = time[thinned(len(time))]
    # algorithms that take several samples per update have fewer rows: use the row at the time or the next one
    rows = {n: np.searchsorted(e.time, time).clip(max=len(e.time) - 1) for n, e in errors.items()}
    widths = style.stacked_widths(len(names))
    thin = {
        n: NavError(time, e.position_ned[rows[n]], e.velocity_ned[rows[n]], e.attitude[rows[n]])
        for n, e in errors.items()
    }
    labels: dict[str, str] = {}

    def lines(key: str, columns: list[Array], table: Scale, label: str) -> None:
        if label not in labels:
            labels[label], size[label] = suiting(table, *columns)
        recording.series(f"navigation/{key}", time, np.column_stack(columns) / size[label], names, widths=widths)

    size: dict[str, float] = {}
    found = thin.values()
    lines("horizontal", [e.horizontal for e in found], LENGTHS, "position")
    for i, axis in enumerate(("north", "east")):
        lines(f"position_{axis}", [e.position_ned[:, i] for e in found], LENGTHS, "position")
    lines("height", [e.height for e in found], HEIGHTS, "height")
    lines("speed", [e.speed for e in found], SPEEDS, "velocity")
    for i, axis in enumerate(("north", "east", "down")):
        lines(f"velocity_{axis}", [e.velocity_ned[:, i] for e in found], SPEEDS, "velocity")
    tilts = [e.attitude[:, :2] for e in found]
    labels["tilt"], size["tilt"] = suiting(ANGLES, *tilts)
    for i, axis in enumerate(("north", "east")):
        lines(f"tilt_{axis}", [e.attitude[:, i] for e in found], ANGLES, "tilt")
    lines("azimuth", [e.attitude[:, 2] for e in found], ANGLES, "azimuth")
    lines("defect", [solutions[n].defect[rows[n]] for n in names], (("", 1.0, np.inf),), "defect")
    if len(names) > 1:
        first = thin[names[0]]
        apart = [np.linalg.norm(thin[n].position_ned - first.position_ned, axis=1) for n in names[1:]]
        labels["apart"], one = suiting(LENGTHS, *apart)
        recording.series("navigation/apart", time, np.column_stack(apart) / one, names[1:], widths=widths[1:])
    if labels["position"] != "mm":
        _draw_mile_an_hour(recording, time[[0, -1]], size["position"])
    for name, color, width in zip(names, style.colors(names), widths, strict=True):
        draw_path(recording, scene, name, solutions[name], color, width)
    return labels


def _draw_mile_an_hour(recording: Recording, ends: Array, size: float) -> None:
    """Record the reference line of 1 nmi/h for horizontal errors."""
    rate = (ends - ends[0])[:, np.newaxis] / 3600.0 * units.NAUTICAL_MILE / size
    grey = [style.COLORS["reference"]]
    recording.series("navigation/one_mile_an_hour", ends, rate, ["1 nmi/h"], colors=grey, widths=1.0)


def draw_path(
    recording: Recording, scene: Scene, name: str, solution: NavSolution, color: style.Rgb, width: float
) -> None:
    """Record the path of a solution, on the map and in the 3D scene.

    Args:
        scene: the scene of the 3D view.
        width: width of the line in plots, points.
    """
    import rerun as rr

    s = solution
    path = thinned(len(s.time), _PATH_POINTS)
    lat_lon = np.column_stack((s.latitude[path], s.longitude[path])) / units.DEG
    radius = rr.Radius.ui_points(0.4 * width)
    recording.static(f"map/{name}", rr.GeoLineStrings(lat_lon=[lat_lon], radii=radius, colors=color))
    points = scene.points(s.latitude[path], s.longitude[path], s.height[path])
    recording.static(f"world/nav/{name}", rr.LineStrips3D([points], radii=radius, colors=color))
