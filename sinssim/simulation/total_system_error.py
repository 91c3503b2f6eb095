"""How far a flight is from its planned path: navigation system error, flight technical error, total system error.

The navigation system error (NSE) is solution minus truth, the flight technical error (FTE) solution minus planned path,
the total system error (TSE) truth minus planned path: TSE = FTE − NSE. Each is resolved by the planned path: across it
to the right, along it, and above its height. On a slope the NSE above the path has the share of the error along it.

A plan has no schedule: along the path the aircraft is to be where its navigator thinks that it is. The FTE along is
zero, and the TSE along is −NSE. A flight by the true motion has no NSE.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef, radii
from sinssim.errors import InputError
from sinssim.rotation import conjugate, euler_from_quaternion, multiply, rotate
from sinssim.scenario import Scenario
from sinssim.scenario.true_motion import mounting
from sinssim.statistics.requirements import BY_PATH, MISS, Quantity, Requirement
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.guidance import TRUTH
from sinssim.truth.flight.legs.landing import LandLeg
from sinssim.truth.flight.legs.waypoint import WaypointLeg
from sinssim.truth.flight.planned_path import Begin, Beside, PlannedTrack
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG, NAUTICAL_MILE, listed

if TYPE_CHECKING:
    from sinssim.simulation.truth_and_sensors import Truth

AXES = ("across", "along", "vertical")
"""Directions of the errors: to the right of the planned path, along it, above it."""
WITHIN = 0.95
"""Share of the time within the corridor that a required navigation performance asks for."""
_RATE = 1.0  # Hz
_SLACK = 1e-9  # s
_WAYPOINT = re.compile(r"waypoint (\d+)")
_BEGINS = re.compile(r"leg (\d+) \(\w+\) begins")


class Piece(NamedTuple):
    """A part of the planned path while it is flown: number of the leg from 0, place of a route, beginning and end, s,
    and the track."""

    leg: int
    place: int
    begin: float
    end: float
    track: PlannedTrack


@dataclass(frozen=True)
class PathErrors:
    """The errors of a flight by its planned path, once a second."""

    time: Array  # instants, (K,) s
    leg: NDArray[np.intp]  # number of the leg flown, from 0; −1 where none has a planned path, (K,)
    # nse, fte, tse: across, along and above, (K, 3) m; NaN without a planned path, or before the solution begins
    nse: Array
    fte: Array
    tse: Array
    planned: Array  # latitude and longitude, rad, and height, m, of the planned path beside the true place, (K, 3)


def planned_pieces(
    flight: FlightPlan, path: Trajectory, reference: Trajectory, lever: Array, place: Array
) -> list[Piece]:
    """Return the planned path of a flight while it flies it. A leg that begins at no stated place begins where the
    flight of the same plan by the true motion, the reference, flies it. Lever and place are those of the sensor block:
    forward, right, down of the centre of gravity, (3,) m, and its attitude in the aircraft, a quaternion."""
    begun = _begins(reference)
    state = at_centre(reference.state(np.clip(begun, reference.start, reference.end)), lever, place)
    heading = euler_from_quaternion(multiply(state.q_nb, conjugate(place)))[2]
    columns = (begun, state.latitude, state.longitude, state.height, heading)
    tracks = flight.planned_tracks([Begin(*(float(v) for v in row)) for row in zip(*columns, strict=True)])
    begins = _begins(path)
    pieces = []
    for number, (begin, end, of_leg) in enumerate(zip(begins, [*begins[1:], path.end], tracks, strict=False)):
        leg, edges = flight.legs[number], [float(begin)]
        if isinstance(leg, WaypointLeg) and len(of_leg) > 1:
            edges += _reached(path, leg, float(begin), float(end))[: len(of_leg) - 1]
        for place_of, (first, last) in enumerate(zip(edges, [*edges[1:], float(end)], strict=True)):
            if of_leg:
                pieces.append(Piece(number, place_of, first, last, of_leg[place_of]))
    return pieces


def _begins(path: Trajectory) -> Array:
    """Return when the legs of a flight begin, s."""
    return np.array([event.time for event in path.events if _BEGINS.fullmatch(event.text)])


def _reached(path: Trajectory, leg: WaypointLeg, begin: float, end: float) -> list[float]:
    """Return when the places of a route are reached, in their order, as far as the flight gets, s."""
    times: list[float] = []
    for event in path.events:
        label = leg.label(min(len(times), len(leg.places()) - 1))
        if begin - _SLACK <= event.time <= end + _SLACK and event.text.startswith(f"{label} reached: "):
            times.append(event.time)
    return times


def at_centre(state: NavState, lever: Array, place: Array) -> NavState:
    """Return the states of the aircraft's centre of gravity from those of the sensor block."""
    north, east, down = rotate(multiply(state.q_nb, conjugate(place)), -lever).T
    r1, r2 = radii(state.latitude)
    latitude = state.latitude + north / (r1 + state.height)
    longitude = state.longitude + east / ((r2 + state.height) * np.cos(state.latitude))
    return NavState(latitude, longitude, state.height - down, state.velocity_ned, state.q_nb)


def pieces_of(scenario: Scenario, truth: Truth) -> list[Piece]:
    """Return the planned path of a scenario's flight while it is flown."""
    assert scenario.flight is not None
    how, path = mounting(scenario), truth.trajectory
    reference = path if truth.guided is None else truth.guided.by_truth
    return planned_pieces(scenario.flight, path, reference, np.array(how.lever_arm_m), how.q_bs)


def path_errors(
    scenario: Scenario,
    truth: Truth,
    pieces: Sequence[Piece],
    solution: NavSolution | None,
    instants: Array | None = None,
) -> PathErrors:
    """Return the errors of a flight by its planned pieces, see `pieces_of`, at instants, (K,) s, by default once a
    second. With the solution of a navigator the instants are those of its last rows until then; without one the flight
    follows the true motion."""
    path, how = truth.trajectory, mounting(scenario)
    once = np.append(np.arange(path.start, path.end - _SLACK, 1.0 / _RATE), path.end)
    time = once if instants is None else instants
    rows = np.zeros(len(time), np.intp)
    known = np.ones(len(time), np.bool_)
    if solution is not None:
        rows = np.searchsorted(solution.time, time + _SLACK, side="right") - 1
        known, rows = rows >= 0, np.maximum(rows, 0)
        time = np.where(known, solution.time[rows], time)
    block = path.state(time)
    true = at_centre(block, np.array(how.lever_arm_m), how.q_bs)
    believed = (true.latitude, true.longitude, true.height)
    if solution is not None:
        off = (solution.latitude[rows] - block.latitude, solution.longitude[rows] - block.longitude,
               solution.height[rows] - block.height)  # fmt: skip
        believed = (true.latitude + off[0], true.longitude + off[1], true.height + off[2])
        known &= np.isfinite(believed[0] + believed[1] + believed[2])
    leg = np.full(len(time), -1, np.intp)
    nse, fte, tse, planned = np.full((4, len(time), 3), np.nan)
    for piece in pieces:  # the next one takes over at its beginning
        some = np.flatnonzero((time >= piece.begin - _SLACK) & (time <= piece.end + _SLACK))
        leg[some] = piece.leg
        there = piece.track.beside(true.latitude[some], true.longitude[some], true.height[some])
        tse[some, 0], tse[some, 2] = there.right, there.above
        planned[some] = piece.track.at(there.along)
        seen, some = known[some], some[known[some]]
        here = piece.track.beside(*(v[some] for v in believed))
        _put(nse, fte, some, here, Beside(*(v[seen] for v in there)), believed[2][some] - true.height[some])
    tse[:, 1] = -nse[:, 1]
    return PathErrors(time, leg, nse, fte, tse, planned)


def _put(nse: Array, fte: Array, rows: NDArray[np.intp], here: Beside, there: Beside, higher: Array) -> None:
    """Fill in the errors of a solution `here` with the truth `there`, which the solution is `higher` than, m."""
    fte[rows, 0], fte[rows, 2] = here.right, here.above
    fte[rows, 1] = np.where(np.isfinite(here.right), 0.0, np.nan)
    above = here.above - there.above
    nse[rows] = np.column_stack(
        (here.right - there.right, here.along - there.along, np.where(np.isfinite(above), above, higher))
    )
    nse[rows[~np.isfinite(there.right)]] = np.nan


def has_path(scenario: Scenario) -> bool:
    """Return whether a scenario's flight is told by its planned path: it follows its navigator, or has a corridor."""
    flight = scenario.flight
    if flight is None or not any("track" in leg.plans for leg in flight.legs):
        return False
    judged = any(flight.rnp_of(number) is not None for number in range(len(flight.legs)))
    return judged or flight.guidance.source != TRUTH


def waypoints_of(flight: FlightPlan) -> list[str]:
    """Return the names of all waypoints of a flight, "" for those without one."""
    legs = (leg for leg in flight.legs if isinstance(leg, WaypointLeg))
    return [place.name or "" for leg in legs for place in leg.places()]


def check_path(scenario: Scenario, require: Iterable[Requirement | Quantity]) -> None:
    """Raise InputError for a requirement by the planned path, or on a waypoint, that a scenario does not have."""
    for wanted in require:
        if wanted.quantity not in (*BY_PATH, MISS):
            continue
        if scenario.flight is None or not has_path(scenario):
            raise InputError(
                f"{wanted.text!r} is about a planned path, which the scenario {scenario.name} has not: it needs a "
                "[flight] along waypoints, turns or constant headings with an rnp, or one that follows its navigator "
                "([flight.guidance])."
            )
        if wanted.place:
            path_column(scenario.flight, wanted)


def path_column(flight: FlightPlan, wanted: Requirement | Quantity) -> str:
    """Return the name of the column of a requirement by the planned path, one of `path_columns`."""
    if not wanted.place:
        return f"{wanted.quantity}_m"
    names, number = waypoints_of(flight), _WAYPOINT.fullmatch(wanted.place.lower())
    if number is not None and 1 <= int(number[1]) <= len(names):
        return f"miss_{number[1]}_m"
    if number is None and wanted.place in names:
        return f"miss_{names.index(wanted.place) + 1}_m"
    known = listed([*(f"waypoint {k + 1}" for k in range(len(names))), *filter(None, names)], "or")
    raise InputError(f"{wanted.text!r}: there is no {wanted.place!r} in this flight; it has {known or 'no waypoint'}.")


def path_columns(scenario: Scenario) -> tuple[str, ...]:
    """Return the names of what is kept by the planned path of each run of an ensemble, with the unit; none without
    one."""
    if scenario.flight is None or not has_path(scenario):
        return ()
    return (*(f"{name}_m" for name in BY_PATH), *(f"miss_{k + 1}_m" for k in range(len(waypoints_of(scenario.flight)))))


def path_values(scenario: Scenario, truth: Truth, solution: NavSolution, instants: Array) -> dict[str, Array]:
    """Return the columns of `path_columns` at instants, (K,) s and m; a miss is the same at all of them. `solution`:
    whose navigation error it is."""
    pieces = pieces_of(scenario, truth)
    errors = path_errors(scenario, truth, pieces, solution, instants)
    fte = errors.fte if truth.guided is not None else errors.tse
    columns = (errors.tse[:, 0], errors.nse[:, 0], fte[:, 0], errors.tse[:, 2])
    values = {f"{name}_m": column for name, column in zip(BY_PATH, columns, strict=True)}
    misses_of = {
        f"miss_{miss.number}_m": np.full(len(instants), miss.right) for miss in misses(scenario, truth, pieces)
    }
    return values | misses_of


class Size(NamedTuple):
    """An error over a time: root mean square, what 95 % of the time does not exceed, and the largest, m."""

    rms: float
    most_95: float
    largest: float


def size_of(values: Array) -> Size | None:
    """Return how large an error is, from its values, (K,) m; None if none is known."""
    known = np.abs(values[np.isfinite(values)])
    if not len(known):
        return None
    return Size(float(np.sqrt(np.mean(known**2))), float(np.percentile(known, 95.0)), float(known.max()))


class Containment(NamedTuple):
    """The corridor of a leg: number from 0, required navigation performance, nmi, how long it is judged, s, the share
    of this time within, and the first time outside, s, None if there is none."""

    leg: int
    rnp: float
    lasts: float
    within: float
    exceeded: float | None


def containments(flight: FlightPlan, errors: PathErrors) -> Iterator[Containment]:
    """Yield how the true path of each leg with a required navigation performance lies in its corridor."""
    for number in range(len(flight.legs)):
        rnp = flight.rnp_of(number)
        rows = (errors.leg == number) & np.isfinite(errors.tse[:, 0])
        if rnp is None or not rows.any():
            continue
        outside = np.abs(errors.tse[rows, 0]) > rnp * NAUTICAL_MILE
        first = float(errors.time[rows][outside][0]) if outside.any() else None
        yield Containment(number, rnp, np.count_nonzero(rows) / _RATE, 1.0 - float(np.mean(outside)), first)


def corridor_edges(flight: FlightPlan, pieces: Iterable[Piece]) -> Iterator[tuple[float, Array, Array, Array]]:
    """Yield both edges of the corridors: the required navigation performance, nmi, latitude, longitude, rad, height, m,
    that of the beginning where none is planned."""
    for piece in pieces:
        rnp = flight.rnp_of(piece.leg)
        for side in () if rnp is None else (-1.0, 1.0):
            assert rnp is not None
            track = piece.track
            heights = np.where(np.isfinite(track.height), track.height, track.level)
            yield rnp, *track.shifted(side * rnp * NAUTICAL_MILE), heights


class Miss(NamedTuple):
    """How the true path passes a waypoint, continued straight on from where the navigator has reached it."""

    number: int  # of the waypoint in the plan, from 1
    name: str  # its name, or that of its leg
    # latitude, longitude: of the waypoint, rad
    latitude: float
    longitude: float
    time: float  # when the navigator has reached it, s
    # right, to_go: of the waypoint the path is to the right, and it is still ahead, m
    right: float
    to_go: float


def misses(scenario: Scenario, truth: Truth, pieces: Sequence[Piece]) -> list[Miss]:
    """Return how the waypoints of a flight are missed that its navigator has reached."""
    flight, path = scenario.flight, truth.trajectory
    assert flight is not None
    ended = {event.text for event in path.events}
    missed: list[Miss] = []
    for number, piece in enumerate((p for p in pieces if isinstance(flight.legs[p.leg], WaypointLeg)), start=1):
        leg = flight.legs[piece.leg]
        assert isinstance(leg, WaypointLeg)
        if piece.place == len(leg.places()) - 1 and f"leg {piece.leg + 1} ({leg.type}) ends" not in ended:
            continue  # the flight ends before
        place, at = leg.places()[piece.place], np.array([piece.end])
        here, latitude, longitude = path.state(at), place.latitude_deg * DEG, place.longitude_deg * DEG
        target = NavSolution(at, np.array([latitude]), np.array([longitude]), here.height, here.velocity_ned, here.q_nb,
                             0.0 * at)  # fmt: skip
        north, east, _ = navigation_error(here, target, path.ellipsoid).position_ned[0]
        course = math.atan2(here.velocity_ned[0, 1], here.velocity_ned[0, 0])
        to_go = float(north * math.cos(course) + east * math.sin(course))
        right = float(north * math.sin(course) - east * math.cos(course))
        name = leg.label(piece.place) or f"leg {piece.leg + 1}"
        missed.append(Miss(number, name, latitude, longitude, piece.end, right, to_go))
    return missed


class Ending(TypedDict):
    """Where a flight ends: time, s; latitude and longitude, deg; height, m; rate of descent, m/s; and the distance from
    the threshold of the plan's last landing, m, None without one."""

    time_s: float
    latitude_deg: float
    longitude_deg: float
    height_m: float
    descent_mps: float
    threshold_m: float | None


def ending(flight: FlightPlan, path: Trajectory) -> Ending:
    """Return where a flight of a plan has ended in truth."""
    end = path.state(np.array([path.end]))
    threshold = None
    for leg in flight.legs:
        if isinstance(leg, LandLeg):
            place = geodetic_to_ecef(leg.latitude_deg * DEG, leg.longitude_deg * DEG, leg.altitude_m, path.ellipsoid)
            here = geodetic_to_ecef(end.latitude[0], end.longitude[0], leg.altitude_m, path.ellipsoid)
            threshold = float(np.linalg.norm(here - place))
    return Ending(
        time_s=path.end,
        latitude_deg=float(end.latitude[0]) / DEG,
        longitude_deg=float(end.longitude[0]) / DEG,
        height_m=float(end.height[0]),
        descent_mps=float(end.velocity_ned[0, 2]),
        threshold_m=threshold,
    )


def passages(scenario: Scenario, truth: Truth) -> list[tuple[Miss, float, Array]]:
    """Return how a perfect navigator would pass the waypoints that a flight by its navigator reaches: its miss of each,
    the time at which the flight is there, s, and the direction to the right of the planned path, north and east,
    (2,)."""
    flight = scenario.flight
    assert flight is not None
    assert truth.guided is not None
    perfect = replace(truth, trajectory=truth.guided.by_truth, guided=None)
    pieces = pieces_of(scenario, truth)
    times = {miss.number: miss.time for miss in misses(scenario, truth, pieces)}
    of_perfect = pieces_of(scenario, perfect)
    right = [p.track.right_at_end for p in of_perfect if isinstance(flight.legs[p.leg], WaypointLeg)]
    there = [miss for miss in misses(scenario, perfect, of_perfect) if miss.number in times]
    return [(miss, times[miss.number], right[miss.number - 1]) for miss in there]
