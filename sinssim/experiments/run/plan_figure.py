"""The picture of a plan before the run: the map, height and speed over time, the legs and the aircraft's ceiling."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.errors import InputError
from sinssim.experiments.run.motion_exhibits import Projection
from sinssim.recording import style
from sinssim.recording.figures import new_figure, styled
from sinssim.scenario.plan_summary import named_places
from sinssim.truth.flight.flight_plan import PlannedPath, planned_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sinssim.scenario import Scenario

_POINTS = 2000
_STANDS = 1.0  # extent below which a motion is a place [m]


def plan_of(scenario: Scenario) -> PlannedPath:
    """Return the planned motion of a scenario: of a flight by dead reckoning, of any other motion the true one."""
    if scenario.flight is not None:
        return planned_path(scenario.flight)
    if scenario.log is not None or scenario.one_component is not None:
        what = "recorded sensors" if scenario.log is not None else "a motion in a vertical plane"
        raise InputError(f"the scenario {scenario.name} has {what}: there is no plan to draw; leave out --plot.")
    from sinssim.scenario.true_motion import fly

    motion = fly(scenario)
    time = np.linspace(motion.start, motion.end, _POINTS)
    state = motion.state(time)
    speed = np.hypot(state.velocity_ned[:, 0], state.velocity_ned[:, 1])
    legs, begun = [], dict[str, float]()
    for event in motion.events:
        if event.text.endswith(" begins"):
            begun[event.text.removesuffix(" begins")] = event.time
        elif event.text.endswith(" ends") and (name := event.text.removesuffix(" ends")) in begun:
            number, _, kind = name.removeprefix("leg ").partition(" ")
            legs.append((f"{number} {kind.strip('()')}", begun[name], event.time))
    values = (time, np.unwrap(state.longitude), state.latitude, state.height, speed)
    at, lon, lat, height, over = (value.tolist() for value in values)
    return PlannedPath(at, lat, lon, height, over, legs, [])


@styled
def plan_figure(scenario: Scenario) -> Figure:
    """Draw a scenario's plan.

    Returns:
        The figure: the map on the left, height and speed over time on the right.
    """
    path = plan_of(scenario)
    figure = new_figure(11.0, 5.6)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.15))
    kind = "plan by dead reckoning" if scenario.flight is not None else "planned motion"
    figure.suptitle(f"{scenario.name}: {kind}", x=0.01, ha="left")
    _map(figure.add_subplot(grid[:, 0]), scenario, path)
    top = figure.add_subplot(grid[0, 1])
    _heights(top, path)
    _speeds(figure.add_subplot(grid[1, 1], sharex=top), path, of_legs=scenario.flight is not None)
    return figure


def _map(axes: Axes, scenario: Scenario, path: PlannedPath) -> None:
    """Draw the track, its start, its legs and its waypoints, in km about the middle."""
    latitude, longitude = np.array(path.latitude), np.array(path.longitude)
    middle = 0.5 * (latitude.min() + latitude.max()), 0.5 * (longitude.min() + longitude.max())
    projection = Projection(float(middle[0]), float(middle[1]), ELLIPSOIDS[scenario.truth.ellipsoid])
    east, north = (value / 1e3 for value in projection.plane(latitude, longitude))
    axes.set_title("Map")
    places = []
    for name, lat, lon in named_places(scenario):
        x, y = (float(value[0]) / 1e3 for value in projection.plane(np.array([lat]), np.array([lon])))
        places.append((name, x, y))
    color = style.css(style.COLORS["truth"])
    extent = max(np.ptp(east), np.ptp(north))
    if extent < _STANDS / 1e3:
        axes.plot(0.0, 0.0, "o", color=style.INK)
        degrees = np.degrees((latitude[0], longitude[0]))
        axes.annotate(f"at rest at {degrees[0]:.5f}°, {degrees[1]:.5f}°", (0.0, 0.0), xytext=(0, 10),
                      textcoords="offset points", ha="center")  # fmt: skip
        axes.set(xlim=(-1.0, 1.0), ylim=(-1.0, 1.0))
    else:
        axes.plot(east, north, color=color)
        axes.plot(east[0], north[0], "o", color=style.INK)
        axes.annotate("start", (east[0], north[0]), xytext=(6, -11), textcoords="offset points")
        _number_legs(axes, path, east, north, [(x, y) for _, x, y in places])
        pad = 0.06 * extent
        for values, limits in ((east, axes.set_xlim), (north, axes.set_ylim)):
            half = max(0.5 * np.ptp(values), 0.12 * extent) + pad
            limits(0.5 * (values.min() + values.max()) - half, 0.5 * (values.min() + values.max()) + half)
    for number, (name, x, y) in enumerate(places):
        axes.plot(x, y, "D", color=style.INK, markerfacecolor="none")
        above = 5 if number % 2 == 0 else -12
        axes.annotate(name, (x, y), xytext=(6, above), textcoords="offset points", fontweight="bold")
    axes.set_aspect("equal")
    axes.set(xlabel=f"east of {np.degrees(middle[1]):.2f}° [km]", ylabel=f"north of {np.degrees(middle[0]):.2f}° [km]")


def _number_legs(axes: Axes, path: PlannedPath, east: Array, north: Array, taken: list[tuple[float, float]]) -> None:
    """Write the number of each leg at its middle, where it does not lie on another or on a taken place."""
    time, taken = np.array(path.time), [*taken]
    least = 0.05 * max(np.ptp(east), np.ptp(north))
    for name, begin, end in path.legs:
        x, y = (float(np.interp(0.5 * (begin + end), time, values)) for values in (east, north))
        if all(np.hypot(x - a, y - b) > least for a, b in taken):
            taken.append((x, y))
            box = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": style.GRID}
            axes.annotate(name.split()[0], (x, y), ha="center", va="center", fontsize=style.SMALL, bbox=box)


def _unit(path: PlannedPath) -> tuple[float, str]:
    """Return the unit of time."""
    return (60.0, "min") if path.time[-1] > 600.0 else (1.0, "s")


def _heights(axes: Axes, path: PlannedPath) -> None:
    """Draw height over time, the ceiling, and the legs."""
    size, _ = _unit(path)
    time, height = np.array(path.time) / size, np.array(path.height)
    axes.set_title("Height above the ellipsoid [m]")
    axes.plot(time, height, color=style.css(style.COLORS["truth"]))
    low, high = height.min(), height.max()
    if path.ceiling:
        top = np.array(path.ceiling)
        axes.plot(time, top, color=style.css(style.COLORS["limit"]), linewidth=style.THIN, linestyle="--")
        axes.annotate("ceiling of the aircraft at the planned airspeed", (time[-1], top[-1]), ha="right", va="bottom",
                      xytext=(0, 2), textcoords="offset points", color=style.SOFT, fontsize=style.SMALL)  # fmt: skip
        high = max(high, float(top.max()))
    span = max(high - low, 10.0)
    axes.set_ylim(low - 0.08 * span, high + 0.25 * span)
    if len(path.legs) > 1:
        last = -np.inf
        for name, begin, end in path.legs:
            axes.axvline(begin / size, color=style.GRID, linewidth=style.HAIR)
            width = (time[-1] - time[0]) * (0.011 * len(name) + 0.01)
            words = name if end / size - begin / size > width else name.split()[0]
            width = (time[-1] - time[0]) * 0.014 * len(words)
            middle = 0.5 * (begin + end) / size
            if middle - 0.5 * width > last:
                last = middle + 0.5 * width
                axes.annotate(words, (middle, 0.96), xycoords=("data", "axes fraction"), ha="center", va="top",
                              fontsize=style.SMALL, color=style.SOFT)  # fmt: skip
    axes.tick_params(labelbottom=False)


def _speeds(axes: Axes, path: PlannedPath, *, of_legs: bool) -> None:
    """Draw the ground speed over time."""
    size, unit = _unit(path)
    axes.set_title(f"Ground speed{', mean of each leg' if of_legs else ''} [m/s]")
    axes.plot(np.array(path.time) / size, path.speed, color=style.css(style.COLORS["aided"]))
    axes.set_ylim(0.0, max(1.0, 1.15 * max(path.speed)))
    axes.set_xlabel(f"time [{unit}]")
    axes.set_xlim(0.0, max(path.time) / size)
