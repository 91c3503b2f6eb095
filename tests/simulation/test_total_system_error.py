"""The three errors of a flight by its planned path: their sum, the navigation error among them, and the corridor."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.data import NavSolution, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError
from sinssim.exhibits import Exhibits, Sentence, Table
from sinssim.experiments.ensembles.ensemble_verdicts import estimate
from sinssim.experiments.run.filter_summary import Moment
from sinssim.experiments.run.parts.guided_flight import Displaced
from sinssim.recording.page import page_of
from sinssim.scenario import Scenario, load_scenario
from sinssim.simulation import total_system_error as kept
from sinssim.simulation.total_system_error import (
    Miss,
    PathErrors,
    Piece,
    _reached,
    at_centre,
    containments,
    corridor_edges,
    ending,
    misses,
    path_errors,
    pieces_of,
    planned_pieces,
    size_of,
)
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.statistics.requirements import Quantity
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.legs.waypoint import WaypointLeg
from sinssim.truth.flight.planned_path import PlannedTrack, great_circle
from sinssim.truth.sampling import FlightEvent
from sinssim.units import signed

NMI = 1852.0
RUNS = 200


def plan(**keys: Any) -> Scenario:
    """Return a flight to the north from the equator, first along a heading, then to a waypoint, with 2 m/s of drift."""
    return Scenario.model_validate(
        {
            "name": "north",
            "flight": {
                "aircraft": "737",
                "start": {"on": "air", "latitude_deg": 0.0, "longitude_deg": 10.0, "altitude_m": 5000.0},
                "guidance": {"source": "quaternion"},
                "legs": [{"type": "hold", "duration_s": 20.0},
                         {"type": "waypoint", "name": "N", "latitude_deg": 0.12, "longitude_deg": 10.0, "rnp": 0.3},
                         {"type": "s_turns", "turns": 1, "swing_deg": 5.0}],
            },
            "imu": {"grade": "ideal", "rate_hz": 50.0},
            "navigation": {"algorithms": ["quaternion"], "vertical": "truth",
                           "initial_error": {"velocity_east_mps": 2.0}},
            **keys,
        }
    )  # fmt: skip


@pytest.fixture(scope="module")
def run() -> sinssim.Run:
    run = sinssim.run(plan())
    assert isinstance(run, sinssim.Run)
    return run


@pytest.fixture(scope="module")
def errors(run: sinssim.Run) -> PathErrors:
    return run.parts["planned_path"].errors


def test_the_total_is_the_technical_less_the_navigation_error(errors: PathErrors) -> None:
    """Across, above and along, at every instant with a planned path; s-turns have none."""
    planned = errors.leg >= 0
    assert np.flatnonzero(planned).tolist() == list(range(np.count_nonzero(planned)))  # the first legs
    assert errors.time[planned][-1] < errors.time[-1] - 20.0
    np.testing.assert_allclose(errors.tse, errors.fte - errors.nse, rtol=0.0, atol=1e-9)
    assert np.isfinite(errors.tse[planned]).all()
    assert np.isnan(errors.tse[~planned]).all()


def test_the_navigation_error_is_that_of_the_solution(run: sinssim.Run, errors: PathErrors) -> None:
    """On a level path to the north: the error to the east is across, that to the north along."""
    error = run.errors["quaternion"]
    rows = np.searchsorted(error.time, errors.time - 1e-6)
    some = errors.leg >= 0
    np.testing.assert_allclose(errors.nse[some, 0], error.position_ned[rows[some], 1], atol=5e-3)
    np.testing.assert_allclose(errors.nse[some, 1], error.position_ned[rows[some], 0], atol=0.3)  # 0.3 % of 100 m turn
    assert errors.nse[some, 0][-1] > 130.0


def test_the_aircraft_is_where_the_plan_and_the_navigator_say(run: sinssim.Run, errors: PathErrors) -> None:
    """The true place from the meridian by hand: the plan of the hold and of the way to the waypoint is the meridian."""
    assert isinstance(run.truth, Truth)
    state = run.truth.trajectory.state(errors.time)
    some = errors.leg == 1
    east = (state.longitude - math.radians(10.0)) * (6378137.0 + 5000.0)
    np.testing.assert_allclose(errors.tse[some, 0], east[some], atol=0.5)  # the lever arm, turned by the drift
    assert errors.tse[some, 0][-1] < -100.0
    assert errors.fte[some, 0][0] == pytest.approx(40.0, rel=0.02)  # 20 s of 2 m/s, which no heading takes back
    assert np.abs(errors.fte[some, 0][-5:]).max() < 10.0  # homing on the waypoint does
    assert np.abs(errors.tse[some, 2]).max() < 1.5


def test_beside_a_path_without_heights(run: sinssim.Run) -> None:
    """A solution 3 m north, 2 m east and 7 m above the true place, at which it begins; the path is the meridian."""
    assert isinstance(run.truth, Truth)
    time = np.array([1.0, 4.0, 9.0])
    true = run.truth.trajectory.state(time)
    r1, r2 = (6335439.3273 + 5000.0, 6378137.0 + 5000.0)  # a(1 − e²) and a, at the equator
    solution = NavSolution(time, true.latitude + 3.0 / r1, true.longitude + 2.0 / r2, true.height + 7.0,
                           true.velocity_ned, true.q_nb, 0.0 * time)  # fmt: skip
    ends, unknown = np.radians([[0.0, 0.02], [10.0, 10.0]]), np.full(2, np.nan)
    piece = Piece(0, 0, 0.0, 10.0, PlannedTrack(*ends, unknown, 5000.0))
    found = path_errors(run.scenario, run.truth, [piece], solution, time)
    np.testing.assert_allclose(found.nse, np.tile([2.0, 3.0, 7.0], (3, 1)), atol=1e-3)
    np.testing.assert_allclose(found.tse[:, 1], -3.0, atol=1e-3)
    assert np.isnan(found.fte[:, 2]).all()


def test_the_centre_of_gravity_of_a_block() -> None:
    """The block is 30 m ahead and 20 m to the right; at 60° M is 6383453.86 m and N 6394209.17 m."""
    here = NavState(np.radians([60.0]), np.array([0.5]), np.array([1000.0]), np.zeros((1, 3)), np.eye(4)[:1])
    centre = at_centre(here, np.array([30.0, 20.0, 5.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    assert centre.latitude - here.latitude == pytest.approx(-30.0 / 6384453.86, rel=1e-7, abs=0.0)
    assert centre.longitude - here.longitude == pytest.approx(-20.0 / (6395209.17 * 0.5), rel=1e-7, abs=0.0)
    assert centre.height == pytest.approx(1005.0)


def test_the_size_of_an_error() -> None:
    """Of 0, −1 … −100 m: 95 % are within 95 m; Σ k² is 338 350 m²."""
    size = size_of(np.append(-np.arange(101.0), np.nan))
    assert size is not None
    assert size == pytest.approx((math.sqrt(338_350 / 101), 95.0, 100.0))


def test_the_entry_says_it_by_leg_and_phase(run: sinssim.Run, errors: PathErrors) -> None:
    entry = run.summary["planned_path"]
    assert [leg["leg"] for leg in entry["legs"]] == ["1 hold", "2 waypoint"]
    across = errors.tse[errors.leg == 1, 0]
    assert entry["legs"][1]["tse_across_max_m"] == np.abs(across).max()
    assert entry["legs"][1]["tse_across_rms_m"] == pytest.approx(math.sqrt(np.mean(across**2)))
    assert [phase["phase"] for phase in entry["phases"]] == ["flight", "flight to N", "flight"]
    (corridor,) = entry["corridors"]
    assert (corridor["leg"], corridor["rnp"]) == ("2 waypoint", 0.3)
    assert (corridor["within"], corridor["exceeded_s"]) == (1.0, None)
    (miss,) = misses(run.scenario, run.truth, pieces_of(run.scenario, run.truth))
    assert (miss.number, miss.name) == (1, "N")
    assert (miss.latitude, miss.longitude) == pytest.approx((math.radians(0.12), math.radians(10.0)))
    assert miss.to_go == run.summary["guidance"]["waypoints"][0]["left_to_go_m"]
    assert math.hypot(miss.to_go, miss.right) == pytest.approx(500.0, abs=15.0)  # the capture radius
    assert miss.right == run.summary["guidance"]["waypoints"][0]["right_m"]
    assert miss.right == pytest.approx(errors.tse[errors.leg == 1, 0][-1], abs=12.0)  # 500 m on, straight


def test_the_streams_have_it(run: sinssim.Run, errors: PathErrors) -> None:
    (stream,) = run.parts["planned_path"].streams()
    columns = {name: column for v in stream.vectors for name, column in zip(v.columns, v.values[:].T, strict=True)}
    assert set(columns) == {
        *(f"{name}_{axis}_m" for name in ("tse", "nse", "fte") for axis in ("across", "along", "vertical")),
        "planned_latitude_rad", "planned_longitude_rad", "planned_height_m",
    }  # fmt: skip
    np.testing.assert_array_equal(columns["fte_across_m"], errors.fte[:, 0])
    planned = errors.leg >= 0
    np.testing.assert_allclose(columns["planned_longitude_rad"][planned], math.radians(10.0), atol=1e-7)
    true = run.truth.trajectory.state(errors.time).latitude
    np.testing.assert_allclose(
        columns["planned_latitude_rad"][planned], true[planned], atol=2e-6
    )  # a lever arm of 10.6 m
    assert columns["planned_height_m"][planned] == pytest.approx(5000.0)


def test_the_console_and_the_report_show_it(run: sinssim.Run, capsys: pytest.CaptureFixture[str]) -> None:
    from rich.console import Console

    from sinssim.recording.console import show

    show(run.exhibits, Console(width=160))
    out = capsys.readouterr().out
    assert "RNP 0.3 is met: the true path is within 0.3 nmi of the planned one 100 % of the time" in out
    assert "Distance from the planned path by leg" in out
    page = page_of(run.exhibits)
    assert "Without a planned path in space: leg 3 s_turns." in page
    assert "Across the planned path, to its right" in page
    assert "Distance from the planned path by phase" in page


def test_a_detection_is_shown_beside_the_path(
    run: sinssim.Run, errors: PathErrors, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The errors at that instant in a sentence, a mark in both charts, and the true place on the map."""
    part = run.parts["planned_path"]
    seen = [Moment(30.0, "withdrawn", "withdrawn by the monitor: gnss-position")]
    monkeypatch.setattr(type(part), "_faults", lambda self: seen)
    said = [item.text for item in part.brief({}) if isinstance(item, Sentence) and "monitor" in item.text]
    tse, nse = (float(of[np.searchsorted(errors.time, 30.0), 0]) for of in (errors.tse, errors.nse))
    assert tse < -10.0 < 40.0 < nse
    assert said == [
        "At 30 s (withdrawn by the monitor: gnss-position): across the planned path TSE "
        f"{signed(tse)} m, NSE {signed(nse)} m."
    ]
    page = page_of(Exhibits("of the path", list(part.exhibits())))
    assert page.count(">withdrawn<") == 2
    assert page.count(">withdrawn 30 s<") == 1


def by_truth(**keys: Any) -> Scenario:
    """Return the same flight, which follows the true motion, with further tables."""
    contents = plan().contents()
    contents["flight"]["guidance"] = {"source": "truth"}
    return Scenario.model_validate({**contents, **keys})


def test_a_flight_by_the_truth_has_no_navigation_error_of_its_own() -> None:
    """Its total error is that of the autopilot; those of the solutions are beside it."""
    run = sinssim.run(by_truth())
    assert isinstance(run, sinssim.Run)
    errors, entry = run.parts["planned_path"].errors, run.summary["planned_path"]
    some = errors.leg >= 0
    assert not errors.nse[some].any()
    np.testing.assert_array_equal(errors.fte, errors.tse)
    assert np.abs(errors.tse[some, 0]).max() < 3.0
    assert entry["solutions"]["quaternion"]["nse_across_max_m"] > 100.0
    part = run.parts["planned_path"]
    numbers = {f"nse_{axis}_{what}_m": float(10 * k + m) for k, axis in enumerate(("across", "along", "vertical"), 1)
               for m, what in enumerate(("95", "max"))}  # fmt: skip
    part.enter({**part.entry, "solutions": {"quaternion": numbers}})
    (table,) = (
        item for item in part.exhibits() if isinstance(item, Table) and item.title == "Navigation system errors"
    )
    heads = ["across 95 %", "across largest", "along 95 %", "along largest", "vertical 95 %", "vertical largest"]
    assert [column.head for column in table.columns] == ["solution", *heads]
    assert [list(row) for row in table.rows] == [["quaternion", 10.0, 11.0, 20.0, 21.0, 30.0, 31.0]]
    contents = by_truth().contents()
    contents["flight"]["legs"][1].pop("rnp")
    plain = sinssim.run(Scenario.model_validate(contents))
    assert "planned_path" not in plain.summary  # neither guided nor judged


def test_a_corridor_counts_the_time_inside() -> None:
    legs = [{"type": "hold", "duration_s": 50.0, "rnp": 1}, {"type": "hold", "duration_s": 50.0}]
    start = {"on": "air", "latitude_deg": 0.0, "longitude_deg": 0.0, "altitude_m": 5000.0}
    flight = FlightPlan.model_validate({"aircraft": "737", "start": start, "legs": legs, "rnp": 0.3})
    across = np.concatenate([np.linspace(0.0, 1.25 * NMI, 50), np.full(50, -0.31 * NMI)])
    tse = np.column_stack([across, across, across])
    leg = np.repeat([0, 1], 50)
    errors = PathErrors(np.arange(100.0), leg, tse, tse, tse, tse)
    first, second = containments(flight, errors)
    assert (first.rnp, first.within, first.exceeded) == (1.0, 0.8, 40.0)
    assert (second.rnp, second.within, second.exceeded) == (0.3, 0.0, 50.0)
    size = size_of(np.array([3.0, np.nan, -4.0]))
    assert size is not None
    assert (size.rms, size.largest) == (math.sqrt(12.5), 4.0)
    assert size_of(np.array([np.nan])) is None


def test_without_a_solution_the_total_error_is_known(run: sinssim.Run) -> None:
    """Where the solution begins late, the true path alone is judged until then."""
    assert isinstance(run.truth, Truth)
    late = run.solutions["quaternion"]
    rows = slice(int(30.0 * 50.0), None)
    from sinssim.data import NavSolution

    names = ("time", "latitude", "longitude", "height", "velocity_ned", "q_nb", "defect")
    part = NavSolution(*(getattr(late, name)[rows] for name in names))
    errors = path_errors(run.scenario, run.truth, pieces_of(run.scenario, run.truth), part)
    before = (errors.time < part.time[0] - 1e-6) & (errors.leg >= 0)
    assert np.isnan(errors.nse[before]).all()
    assert np.isfinite(errors.tse[before][:, [0, 2]]).all()


def test_requirements_are_judged_by_one_run(errors: PathErrors, run: sinssim.Run) -> None:
    """The values are those of the errors and of the table of waypoints; the limit of 50 m is crossed once."""
    texts = ["tse(run) <= 50 m", "nse(end) <= 1 nmi", "fte(10 s) <= 1 m", "tse_vertical <= 5 m", "miss(N) <= 0.1 nmi",
             "miss(waypoint 1) <= 100 m", "r95(20 s) <= 50 m", "position_east(20 s) <= 30 m",
             "rate(20 s) <= 2.1 m/s"]  # fmt: skip
    judged = sinssim.run(plan(), require=texts).summary["requirements"]
    assert [entry["requirement"] for entry in judged] == texts
    values = [entry["value"] * (1852.0 if entry["unit"] == "nmi" else 1.0) for entry in judged]
    some = errors.leg >= 0
    across = np.abs(errors.tse[some, 0])
    miss = abs(run.summary["guidance"]["waypoints"][0]["right_m"])
    expected = [across.max(), abs(errors.nse[some, 0][-1]), abs(errors.fte[10, 0]), np.abs(errors.tse[some, 2]).max(),
                miss, miss, 40.0, 40.0, 2.0]  # fmt: skip
    assert values == pytest.approx(expected, rel=2e-3)
    words = ["not met", "met", "not met", "met", "met", "not met", "met", "not met", "met"]
    assert [entry["verdict"] for entry in judged] == words
    row = int(np.argmax(across > 50.0))
    share = (50.0 - across[row - 1]) / (across[row] - across[row - 1])
    assert judged[0]["exceeded_from_s"] == pytest.approx(errors.time[row - 1] + share, abs=1e-6)
    assert judged[4]["time_s"] == pytest.approx(run.summary["guidance"]["waypoints"][0]["time_s"])


@pytest.mark.parametrize(
    ("require", "message"),
    [
        ("miss(waypoint 2) <= 1 nmi", "there is no 'waypoint 2' in this flight; it has waypoint 1 or N"),
        ("miss <= 1 nmi", r"a miss is that of a waypoint; write it like miss\(waypoint 3\)"),
        ("tse(run) <= 1 deg", "tse is a length"),
    ],
)
def test_what_cannot_be_judged_is_refused(require: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        sinssim.run(plan(), require=require)


def test_a_budget_predicts_the_miss(run: sinssim.Run) -> None:
    """A given error of the velocity displaces every run; a drawn one scatters it: σ sin(ω t)/ω of the time there."""
    budget = sinssim.budget(plan(navigation={
        "algorithms": ["quaternion"], "vertical": "truth",
        "initial_error": {"velocity_east_mps": 2.0, "velocity_sigma_mps": 0.5}}))  # fmt: skip
    (miss,) = budget.waypoints
    schuler = math.sqrt(9.81 / 6.378e6)
    grown = math.sin(miss.time * schuler) / schuler
    assert (miss.waypoint, abs(miss.technical) < 3.0) == ("N", True)
    assert miss.mean - miss.technical == pytest.approx(-2.0 * grown, rel=5e-3)
    assert miss.sigma == pytest.approx(0.5 * grown, rel=5e-3)
    real = run.summary["guidance"]["waypoints"][0]["right_m"]
    assert miss.mean == pytest.approx(real, abs=10.0)  # the path comes nearer by 2 % of 500 m
    assert budget.summary["waypoints"][0]["sigma_m"] == miss.sigma


@pytest.mark.slow
def test_the_predicted_miss_is_that_of_200_flights() -> None:
    """Each run flies by itself; with 3.5 standard errors of mean and σ one of 2000 such tests fails by chance."""
    scenario = plan(navigation={"algorithms": ["quaternion"], "vertical": "truth",
                                "initial_error": {"velocity_sigma_mps": 1.0}})  # fmt: skip
    (miss,) = sinssim.budget(scenario).waypoints
    runs = sinssim.ensemble(scenario, RUNS).errors.column("miss_1_m")[:, -1]
    assert abs(runs.mean() - miss.mean) < 3.5 * miss.sigma / math.sqrt(RUNS)
    assert abs(runs.std(ddof=1) / miss.sigma - 1.0) < 3.5 / math.sqrt(2.0 * RUNS)


def test_a_requirement_by_the_path_needs_one() -> None:
    parked = load_scenario("parked")
    with pytest.raises(InputError, match=r"'tse <= 1 nmi' is about a planned path, which the scenario parked has not"):
        sinssim.run(parked, require="tse <= 1 nmi")
    with pytest.raises(InputError, match="a budget has the errors of the navigator, not the flight"):
        sinssim.budget(parked, require="miss(waypoint 1) <= 1 nmi")
    with pytest.raises(InputError, match="is about a planned path"):
        sinssim.ensemble(parked, 2, require="fte(end) <= 1 nmi")


def test_an_ensemble_keeps_and_judges_them() -> None:
    """Four velocity errors v at the start, on one flight: NSE across is v sin(ω t)/ω, and the flight does not miss."""
    vary = {"key": "navigation.initial_error.velocity_east_mps", "type": "uniform", "low": 1.0, "high": 4.0}
    scenario = by_truth(ensemble={"vary": [vary]})
    require = ["nse(60 s) <= 300 m", "nse(60 s) <= 10 m", "tse(run) <= 0.3 nmi", "miss(N) <= 50 m"]
    result = sinssim.ensemble(scenario, 4, threads=1, require=require)
    row = int(np.argmin(np.abs(result.elapsed - 60.0)))
    schuler = math.sqrt(9.81 / 6.378e6)
    expected = result.errors.values[vary["key"]] * math.sin(60.0 * schuler) / schuler
    assert result.errors.column("nse_m")[:, row] == pytest.approx(expected, rel=3e-3)
    assert np.ptp(result.errors.column("tse_m")[:, row]) == 0.0
    assert [verdict.verdict for verdict in result.verdicts][:2] == ["undecided", "not met"]
    assert result.verdicts[0].value == pytest.approx(expected.max(), rel=0.01)
    assert result.verdicts[2].value < 3.0
    assert result.verdicts[3].value < 3.0
    sizes = np.abs(result.errors.column("nse_m"))
    assert estimate(result, Quantity("nse", "at", 60.0)).value == pytest.approx(sizes[:, row].max())
    assert estimate(result, Quantity("nse", "end")).value == max(of_run[np.isfinite(of_run)][-1] for of_run in sizes)
    assert estimate(result, Quantity("nse", "run")).value == pytest.approx(np.nanmax(sizes))


def test_the_recording_has_the_three_paths(run: sinssim.Run, errors: PathErrors) -> None:
    """The planned path, the believed one, both edges of the corridor of 0.3 nmi, and the waypoint with its miss."""
    paths = {path.name: path for path in run.parts["planned_path"].paths()}
    assert set(paths) == {"planned", "believed", "corridor/0", "corridor/1", "waypoints"}
    east = 6378137.0 + 5000.0
    for name, side in (("corridor/0", -1.0), ("corridor/1", 1.0)):
        edge = paths[name]
        assert (edge.longitude - math.radians(10.0)) * east == pytest.approx(side * 0.3 * NMI, rel=1e-3)
        assert edge.height == pytest.approx(5000.0)
    assert paths["planned"].longitude[errors.leg >= 0] == pytest.approx(math.radians(10.0), abs=1e-7)
    assert np.isnan(paths["planned"].latitude[errors.leg < 0]).all()
    miss = abs(run.summary["guidance"]["waypoints"][0]["right_m"])
    assert paths["waypoints"].words == (f"N ({miss:.3g} m left)",)


def test_the_aided_solution_comes_with_the_filter(run: sinssim.Run) -> None:
    """It is here that of the algorithm, and has the same errors: of its own flight, or beside one by the truth."""
    assert isinstance(run.truth, Truth)
    assert run.truth.guided is not None
    solution = run.solutions["quaternion"]
    aided: Any = SimpleNamespace(estimate=SimpleNamespace(solution=solution, innovations=()))
    by_filter = replace(run.truth, guided=replace(run.truth.guided, source="aided"))
    flown: Any = SimpleNamespace(scenario=run.scenario, truth=by_filter, solutions={})
    for name in ("planned_path", "guidance"):
        kept = run.parts[name]
        part = replace(kept, run=flown, aided=aided, **({"kept": {}} if name == "planned_path" else {}))
        part.enter({"not": "this"})
        found: Any = part.with_filter()
        assert found == {**kept.entry, "source": "aided"}
    path = run.parts["planned_path"]
    assert replace(path, run=flown).after_filter
    assert not path.after_filter
    truth: Any = SimpleNamespace(scenario=run.scenario, truth=replace(run.truth, guided=None), solutions={})
    beside = replace(path, run=truth, aided=aided, kept={})
    beside.enter({"solutions": {"quaternion": {"nse_across_max_m": 1.0}}})
    sizes: Any = beside.with_filter()["solutions"]
    assert list(sizes) == ["quaternion", "aided"]
    largest = path.entry["flight"]["nse_across_max_m"]
    assert sizes["aided"]["nse_across_max_m"] == pytest.approx(largest, rel=1e-9)


def test_the_places_of_a_route_are_reached_in_their_order() -> None:
    """Only during the leg; a place without a name has its number."""
    places = [{"latitude_deg": 1.0, "longitude_deg": 0.0, "name": "A"}, {"latitude_deg": 2.0, "longitude_deg": 0.0},
              {"latitude_deg": 3.0, "longitude_deg": 0.0, "name": "C"}]  # fmt: skip
    leg = WaypointLeg.model_validate({"type": "waypoint", "waypoints": places})
    events = [(5.0, "A"), (20.0, "A"), (30.0, "C"), (40.0, "waypoint 2"), (50.0, "C"), (70.0, "C")]
    path: Any = SimpleNamespace(events=[FlightEvent(at, f"{name} reached: 3.0 km away") for at, name in events])
    assert _reached(path, leg, 10.0, 60.0) == [20.0, 40.0, 50.0]
    assert _reached(path, leg, 20.0, 40.0) == [20.0, 40.0]


def test_a_waypoint_that_the_flight_does_not_reach_is_not_missed(run: sinssim.Run) -> None:
    assert isinstance(run.truth, Truth)
    path, pieces = run.truth.trajectory, pieces_of(run.scenario, run.truth)
    events = [event for event in path.events if event.text != "leg 2 (waypoint) ends"]
    shorter: Any = SimpleNamespace(
        trajectory=SimpleNamespace(events=events, state=path.state, ellipsoid=path.ellipsoid)
    )
    assert len(misses(run.scenario, run.truth, pieces)) == 1
    assert misses(run.scenario, shorter, pieces) == []


def test_a_bounded_path_says_nothing_beyond_its_ends() -> None:
    """A kilometre to the north along the prime meridian at the equator, where the radius is a(1 − e²)."""
    north = np.array([0.0, 1000.0 / 6335439.3273])
    track = PlannedTrack(north, np.zeros(2), np.full(2, 50.0), 0.0, bounded=True)
    assert track.at(np.array([500.0]))[0] == pytest.approx([0.5 * north[1], 0.0, 50.0], rel=1e-6, abs=1e-12)
    assert np.isnan(track.at(np.array([-1.0, 1001.0]))).all()
    there = great_circle((0.5, 1.0), (0.5, 1.0))
    assert there.tolist() == [[0.5, 1.0], [0.5, 1.0]]


def test_the_charts_and_the_map_of_the_paths(run: sinssim.Run) -> None:
    part: Any = run.parts["planned_path"]
    across, vertical = part._charts()
    assert [chart.key for chart in (across, vertical)] == ["planned_path/across", "planned_path/vertical"]
    assert [chart.title for chart in (across, vertical)] == ["Across the planned path, to its right",
                                                             "Above the planned path"]  # fmt: skip
    labels = [[mark.label for mark in chart.marks] for chart in (across, vertical)]
    assert labels == [["FTE", "NSE", "TSE", "RNP 0.3", ""], ["FTE", "NSE", "TSE"]]
    left, right = across.marks[3:]
    assert (left.y.tolist(), right.y.tolist()) == ([-0.3 * NMI] * 2, [0.3 * NMI] * 2)
    errors = part.errors
    ends = errors.time[errors.leg == 1]
    assert left.x.tolist() == [ends[0], ends[-1]]
    assert not left.counts  # 556 m is more than four times the largest error
    for chart, column in ((across, 0), (vertical, 2)):
        for mark, values in zip(chart.marks, (errors.fte, errors.nse, errors.tse), strict=False):
            np.testing.assert_array_equal(mark.y, values[:, column])
    ((chart,),) = part._map().rows
    named = [mark.label for mark in chart.marks if getattr(mark, "label", "")]
    assert named == ["true", "believed", "planned", "RNP 0.3"]


def test_where_a_flight_has_ended() -> None:
    """One minute of arc north and 202 m above the threshold, near the equator: 1842.9 m on the ground."""
    land = {"type": "land", "latitude_deg": 0.5, "longitude_deg": 9.0, "altitude_m": 10.0, "heading_deg": 0.0}
    start = {"on": "air", "latitude_deg": 0.0, "longitude_deg": 9.0, "altitude_m": 500.0}
    flight = FlightPlan.model_validate({"aircraft": "c172x", "start": start, "legs": [land]})
    latitude, longitude = np.radians([0.5 + 1.0 / 60.0]), np.radians([9.0])
    here = NavState(latitude, longitude, np.array([212.0]), np.array([[60.0, 1.0, 2.5]]), np.eye(4)[:1])
    path: Any = SimpleNamespace(end=321.5, ellipsoid=WGS84, state=lambda time: here)
    found = ending(flight, path)
    assert found == {
        "time_s": 321.5, "latitude_deg": pytest.approx(0.5 + 1.0 / 60.0), "longitude_deg": pytest.approx(9.0),
        "height_m": 212.0, "descent_mps": 2.5, "threshold_m": pytest.approx(1842.9, abs=0.1),
    }  # fmt: skip
    hold = FlightPlan.model_validate(
        {"aircraft": "c172x", "start": start, "legs": [{"type": "hold", "duration_s": 9.0}]}
    )
    assert ending(hold, path)["threshold_m"] is None


def level_track(level: float, *height: float, bounded: bool = False) -> PlannedTrack:
    """Return a kilometre on the ellipsoid to the north, from the equator at 9° E."""
    north = np.linspace(0.0, 1000.0 / 6335439.3273, 2)  # a(1 − e²)
    return PlannedTrack(north, np.full(2, math.radians(9.0)), np.array(height), level, bounded)


def test_lengths_are_at_the_level_of_a_path() -> None:
    """At 10 km a kilometre on the ground is 1000 · (1 + 10 000/6 335 439) m long."""
    assert level_track(10_000.0, math.nan, math.nan).length == pytest.approx(1001.578, abs=1e-3)


def test_above_a_bounded_path_nothing_is_said_beyond_its_ends() -> None:
    track = level_track(0.0, 50.0, 80.0, bounded=True)
    north = np.array([-10.0, 500.0, 1010.0]) / 6335439.3273
    there = track.beside(north, np.full(3, math.radians(9.0)), np.full(3, 70.0))
    np.testing.assert_allclose(there.above, [np.nan, 5.0, np.nan], atol=1e-3)
    np.testing.assert_allclose(there.right, [np.nan, 0.0, np.nan], atol=1e-3)


def test_a_great_circle_goes_on_over_the_date_line() -> None:
    points = great_circle((0.0, math.pi - 1e-3), (0.0, -math.pi + 1e-3))
    np.testing.assert_allclose(points[[0, -1], 1], [math.pi - 1e-3, math.pi + 1e-3], rtol=1e-12)
    assert (np.diff(points[:, 1]) > 0.0).all()
    assert np.diff(points[:, 1]).max() * 6.37e6 < 1000.0


def test_a_corridor_has_the_heights_of_the_path() -> None:
    """0.3 nmi to the left and to the right; where no height is planned, that of the beginning."""
    legs = [{"type": "hold", "duration_s": 9.0, "rnp": 0.3}, {"type": "hold", "duration_s": 9.0}]
    start = {"on": "air", "latitude_deg": 0.0, "longitude_deg": 9.0, "altitude_m": 500.0}
    flight = FlightPlan.model_validate({"aircraft": "c172x", "start": start, "legs": legs})
    pieces = [
        Piece(0, 0, 0.0, 9.0, level_track(60.0, 50.0, math.nan)),
        Piece(1, 0, 9.0, 18.0, level_track(1.0, 2.0, 3.0)),
    ]
    left, right = corridor_edges(flight, pieces)
    for (rnp, latitude, longitude, height), side in ((left, -1.0), (right, 1.0)):
        assert rnp == 0.3
        np.testing.assert_allclose(latitude, pieces[0].track.latitude, rtol=1e-12, atol=1e-15)
        assert (longitude - math.radians(9.0)) * 6378197.0 == pytest.approx(side * 555.6, rel=1e-7)
        assert height.tolist() == [50.0, 60.0]


@pytest.mark.parametrize("guided", [True, False])
def test_which_errors_an_ensemble_keeps(guided: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A flight by the truth has the total error as technical error, whatever its solution."""
    nse, fte, tse = (np.tile([10.0 * k + 1.0, 10.0 * k + 2.0, 10.0 * k + 3.0], (2, 1)) for k in (1, 2, 3))
    errors = PathErrors(np.zeros(2), np.zeros(2, np.intp), nse, fte, tse, tse)
    monkeypatch.setattr(kept, "pieces_of", lambda *given: [])
    monkeypatch.setattr(kept, "path_errors", lambda *given: errors)
    monkeypatch.setattr(kept, "misses", lambda *given: [Miss(2, "B", 0.0, 0.0, 5.0, -7.0, 1.0)])
    truth: Any = SimpleNamespace(guided=guided or None)
    found = kept.path_values(plan(), truth, None, np.zeros(2))  # type: ignore[arg-type]
    assert {name: values.tolist() for name, values in found.items()} == {
        "tse_m": [31.0] * 2, "nse_m": [11.0] * 2, "fte_m": [21.0 if guided else 31.0] * 2, "tse_vertical_m": [33.0] * 2,
        "miss_2_m": [-7.0] * 2,
    }  # fmt: skip


def test_the_entry_of_the_guidance(run: sinssim.Run) -> None:
    """The displacement once a second, at the end, and its largest by leg; the errors of the solution from its own."""
    part, entry = run.parts["guidance"], run.summary["guidance"]
    time, values = part.displaced
    size = np.hypot(values[:, 0], values[:, 1])
    assert (entry["displacement_max_m"], entry["displacement_end_m"]) == pytest.approx((size.max(), size[-1]))
    assert np.diff(time)[:-1] == pytest.approx(1.0)
    begin, error = 0.0, run.errors["quaternion"]
    assert [leg["leg"] for leg in entry["legs"]] == ["1 hold", "2 waypoint", "3 s_turns"]
    for leg in entry["legs"]:
        here = (time >= begin) & (time <= leg["end_s"])
        assert leg["horizontal_max_m"] == pytest.approx(size[here].max())
        place = [np.interp(leg["end_s"], time, column) for column in values.T]
        assert [leg["along_m"], leg["right_m"], leg["up_m"]] == pytest.approx(place)
        row = int(np.searchsorted(error.time, leg["end_s"] + 1e-9)) - 1
        assert leg["navigation_error_m"] == pytest.approx(error.horizontal[row], rel=1e-6)
        begin = leg["end_s"]
    nearer = replace(part)
    vars(nearer)["displaced"] = Displaced(time, values[::-1])  # comes nearer and nearer
    firsts = np.searchsorted(time, [0.0, *(leg["end_s"] - 1e-9 for leg in entry["legs"][:-1])])
    assert [leg["horizontal_max_m"] for leg in nearer.numbers()["legs"]] == pytest.approx(size[::-1][firsts])


def test_a_planned_path_is_drawn_at_its_height(run: sinssim.Run, errors: PathErrors) -> None:
    """5000 m in the holds; the true height where none is planned."""
    assert isinstance(run.truth, Truth)
    (planned,) = (path for path in run.parts["planned_path"].paths() if path.name == "planned")
    true = run.truth.trajectory.state(errors.time).height
    known = np.isfinite(errors.planned[:, 2])
    assert planned.height[known] == pytest.approx(5000.0)
    paths = {path.name: path for path in run.parts["planned_path"].paths()}
    solution, believed = run.solutions["quaternion"], paths["believed"]
    rows = np.searchsorted(solution.latitude, believed.latitude)
    assert len(rows) > 100
    np.testing.assert_array_equal(solution.longitude[rows], believed.longitude)
    np.testing.assert_array_equal(solution.height[rows], believed.height)
    waypoint = paths["waypoints"]
    assert np.degrees([waypoint.latitude[0], waypoint.longitude[0]]) == pytest.approx([0.12, 10.0])
    assert waypoint.height[0] == pytest.approx(5000.0, abs=5.0)
    np.testing.assert_array_equal(planned.height[~known], true[~known])
    assert np.abs(true[known] - 5000.0).max() > 1e-3


NORTH, EAST = 1000.0 / 6335439.3273, 1000.0 / 6378137.0
"""A kilometre north, a(1 − e²), and east, a, at the equator, rad."""


def corner() -> PlannedTrack:
    """Return a kilometre to the north and one to the east."""
    return PlannedTrack(np.array([0.0, NORTH, NORTH]), np.array([0.0, 0.0, EAST]), np.array([0.0, 100.0, 300.0]), 0.0)


def test_beside_a_corner() -> None:
    """10 m to the left of the way before it, 10 m to the left of that after it."""
    there = corner().beside(np.array([0.9, 1.01]) * NORTH, np.array([-0.01, 0.1]) * EAST, np.zeros(2))
    np.testing.assert_allclose(there.right, [-10.0, -10.0], atol=1e-3)
    np.testing.assert_allclose(there.along, [900.0, 1100.0], atol=1e-2)
    np.testing.assert_allclose(there.above, [-90.0, -120.0], atol=1e-2)


def test_places_along_a_corner_and_beyond_its_ends() -> None:
    places = corner().at(np.array([-100.0, 500.0, 1500.0, 2100.0]))
    np.testing.assert_allclose(places[:, 0] / NORTH, [-0.1, 0.5, 1.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(places[:, 1] / EAST, [0.0, 0.0, 0.5, 1.1], atol=1e-6)
    np.testing.assert_allclose(places[:, 2], [0.0, 50.0, 200.0, 300.0], atol=1e-2)
    assert corner().right_at_end == pytest.approx([-1.0, 0.0], abs=1e-6)


def test_where_the_legs_begin() -> None:
    """A block that is turned by 90° in an aircraft on a heading of 30°, 2 m ahead of the centre of gravity."""
    begins: list[Any] = []
    one, other = level_track(0.0, 0.0, 0.0), level_track(1.0, 0.0, 0.0)
    tracks = [[one], [other]]
    flight: Any = SimpleNamespace(planned_tracks=lambda given: begins.extend(given) or tracks, legs=["hold", "turn"])
    c, s = math.cos(math.radians(60.0)), math.sin(math.radians(60.0))  # half of 120°
    here = NavState(np.array([0.5, 0.6]), np.array([1.0, 1.1]), np.array([100.0, 200.0]), np.zeros((2, 3)),
                    np.tile([c, 0.0, 0.0, s], (2, 1)))  # fmt: skip
    events = [FlightEvent(5.0, "leg 1 (hold) begins"), FlightEvent(8.0, "leg 1 (hold) ends"),
              FlightEvent(8.0, "leg 2 (turn) begins")]  # fmt: skip
    reference: Any = SimpleNamespace(events=events, start=0.0, end=20.0, state=lambda time: here)
    later = [FlightEvent(event.time + 1.0, event.text) for event in events]
    path: Any = SimpleNamespace(events=later, end=22.0)
    half = math.sqrt(0.5)
    pieces = planned_pieces(flight, path, reference, np.array([2.0, 0.0, 0.5]), np.array([half, 0.0, 0.0, half]))
    assert pieces == [Piece(0, 0, 6.0, 9.0, one), Piece(1, 0, 9.0, 22.0, other)]
    assert [(begin.time, begin.height) for begin in begins] == [(5.0, 100.5), (8.0, 200.5)]
    assert [math.degrees(begin.heading) for begin in begins] == pytest.approx([30.0, 30.0])
    behind = [(begin.latitude - 0.5 - 0.1 * k) * 6.37e6 for k, begin in enumerate(begins)]
    assert behind == pytest.approx([-2.0 * math.cos(math.radians(30.0))] * 2, rel=0.01)


def test_a_perfect_navigator_passes_when_the_flight_does(run: sinssim.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """At 60 s instead of 55 s; what the flight does not reach is left out."""
    assert isinstance(run.truth, Truth)
    perfect = [Miss(1, "N", 0.0, 0.0, 55.0, 3.0, 1.0), Miss(2, "M", 0.0, 0.0, 70.0, 4.0, 1.0)]
    monkeypatch.setattr(
        kept, "misses", lambda s, truth, p: perfect if truth.guided is None else [perfect[0]._replace(time=60.0)]
    )
    ((miss, time, right),) = kept.passages(run.scenario, run.truth)
    assert (miss, time) == (perfect[0], 60.0)
    assert right == pytest.approx([0.0, 1.0], abs=1e-3)  # to the right of a way to the north


M60, N60 = 6383453.857, 6394209.174
"""a(1 − e²)/W³ and a/W at 60°, where the cosine is a half."""
AT60, AT200 = math.pi / 3.0, math.radians(200.0)


def flown_over(time: Any) -> NavState:
    """Return 60° N and 200° E, 1000 m high, left to the north with 10 m/s at 100 s; level, heading north."""
    at = np.asarray(time, float)
    north = 10.0 * (at - 100.0)
    velocity, q = np.tile([10.0, 0.0, 0.0], (len(at), 1)), np.tile([1.0, 0.0, 0.0, 0.0], (len(at), 1))
    return NavState(AT60 + north / (M60 + 1000.0), np.full(len(at), AT200), np.full(len(at), 1000.0), velocity, q)


def meridian(*height: float) -> PlannedTrack:
    """Return a kilometre to the north from there, 6 m to the west, with the height 1000 m for its lengths."""
    latitude, west = AT60 + np.array([-100.0, 900.0]) / (M60 + 1000.0), 6.0 / ((N60 + 1000.0) * 0.5)
    return PlannedTrack(latitude, np.full(2, AT200 - west), np.array(height), 1000.0)


def test_the_errors_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    """The block is 4 m to the right and 1 m below the centre, which is 2 m to the right of the path and 1 m above the
    block. The solution is 5 m north, 3 m west and 7 m above the block; it has rows at 100, 100.4 and 101.2 s."""
    mounted = SimpleNamespace(lever_arm_m=(0.0, 4.0, 1.0), q_bs=np.array([1.0, 0.0, 0.0, 0.0]))
    monkeypatch.setattr(kept, "mounting", lambda scenario: mounted)
    truth: Any = SimpleNamespace(trajectory=SimpleNamespace(start=100.0, end=102.5, state=flown_over))
    at = np.array([100.0, 100.4, 101.2])
    true, none = flown_over(at), np.zeros(3)
    solution = NavSolution(at, true.latitude + 5.0 / (M60 + 1000.0), true.longitude - 3.0 / ((N60 + 1000.0) * 0.5),
                           true.height + 7.0, true.velocity_ned, true.q_nb, none)  # fmt: skip
    pieces = [Piece(0, 0, 99.0, 100.2, meridian(990.0, 990.0)), Piece(2, 0, 100.2, 102.0, meridian(math.nan, math.nan))]
    none_yet: Any = None
    found = path_errors(none_yet, truth, pieces, solution, np.array([99.5, 100.0, 101.0]))
    assert found.time.tolist() == [99.5, 100.0, 100.4]
    assert found.leg.tolist() == [0, 0, 2]
    unknown = [math.nan] * 3
    np.testing.assert_allclose(found.nse, [unknown, [-3.0, 5.0, 7.0], [-3.0, 5.0, 7.0]], atol=2e-3)
    np.testing.assert_allclose(found.tse, [[2.0, math.nan, 11.0], [2.0, -5.0, 11.0], [2.0, -5.0, math.nan]], atol=2e-3)
    np.testing.assert_allclose(found.fte, [unknown, [-1.0, 0.0, 18.0], [-1.0, 0.0, math.nan]], atol=2e-3)
    north = (found.planned[:, 0] - AT60) * (M60 + 1000.0)
    np.testing.assert_allclose(north, [-5.0, 0.0, 4.0], atol=2e-3)
    np.testing.assert_allclose((AT200 - found.planned[:, 1]) * (N60 + 1000.0) * 0.5, 6.0, atol=2e-3)
    np.testing.assert_allclose(found.planned[:, 2], [990.0, 990.0, math.nan], atol=1e-6)
    assert path_errors(none_yet, truth, pieces, None).time.tolist() == [100.0, 101.0, 102.0, 102.5]


def test_beside_the_end_of_a_path_only_the_solution_has_an_error() -> None:
    """The first row: the truth is beyond the end of the path, the solution not. The second is known, 3 m higher."""
    nse, fte = np.full((2, 4, 3), math.nan)
    here = kept.Beside(np.array([1.0, 2.0]), np.array([10.0, 20.0]), np.array([5.0, math.nan]))
    there = kept.Beside(np.array([0.5, 0.5]), np.array([math.nan, 24.0]), np.array([math.nan, math.nan]))
    assert kept.Beside._fields == ("along", "right", "above")
    kept._put(nse, fte, np.array([3, 1]), here, there, np.array([7.0, 3.0]))
    np.testing.assert_array_equal(fte, [[math.nan] * 3, [20.0, 0.0, math.nan], [math.nan] * 3, [10.0, 0.0, 5.0]])
    np.testing.assert_array_equal(nse, [[math.nan] * 3, [-4.0, 1.5, 3.0], [math.nan] * 3, [math.nan] * 3])


ROUTE = [{"latitude_deg": 60.0, "longitude_deg": 10.0, "name": "A"}, {"latitude_deg": 61.0, "longitude_deg": 12.0}]


def route(**more: Any) -> FlightPlan:
    """Return a route with a named place and one without a name, a hold, and a waypoint "C"."""
    start = {"on": "air", "latitude_deg": 59.0, "longitude_deg": 9.0, "altitude_m": 500.0}
    last = {"type": "waypoint", "latitude_deg": 62.0, "longitude_deg": 13.0, "name": "C"}
    legs = [{"type": "waypoint", "waypoints": ROUTE}, {"type": "hold", "duration_s": 9.0}, last]
    return FlightPlan.model_validate({"aircraft": "c172x", "start": start, "legs": legs, **more})


def test_the_columns_of_waypoints() -> None:
    """A place without a name has its number alone; numbers are from 1, and small letters do."""
    flight = route()
    assert kept.waypoints_of(flight) == ["A", "", "C"]
    texts = {"": "tse_m", "A": "miss_1_m", "C": "miss_3_m", "Waypoint 2": "miss_2_m", "waypoint 3": "miss_3_m"}
    found = {
        place: kept.path_column(flight, Quantity("miss" if place else "tse", "run", place=place)) for place in texts
    }
    assert found == texts
    for place in ("waypoint 0", "waypoint 4", "B"):
        with pytest.raises(InputError) as error:
            kept.path_column(flight, Quantity("miss", "run", place=place))
        assert str(error.value) == (
            f"'miss({place})': there is no '{place}' in this flight; it has waypoint 1, waypoint 2, waypoint 3, A or C."
        )
    scenario: Any = SimpleNamespace(flight=flight)
    assert kept.path_columns(scenario) == ()
    judged: Any = SimpleNamespace(flight=route(rnp=1))
    assert kept.path_columns(judged) == (
        "tse_m",
        "nse_m",
        "fte_m",
        "tse_vertical_m",
        "miss_1_m",
        "miss_2_m",
        "miss_3_m",
    )


def test_how_waypoints_are_passed() -> None:
    """30 m/s north and 40 m/s west; the waypoint is 100 m north and 50 m east of where the navigator has reached it:
    100 · 0.6 − 50 · 0.8 m are to go, and it is passed 100 · 0.8 + 50 · 0.6 m to its left. The last one is not reached.
    """
    flight = route()
    one = np.ones(1)
    east = math.radians(10.0) - 50.0 / ((N60 + 800.0) * 0.5)
    here = NavState((AT60 - 100.0 / (M60 + 800.0)) * one, east * one, 800.0 * one, np.array([[30.0, -40.0, 1.0]]),
                    np.eye(4)[:1])  # fmt: skip
    events = [FlightEvent(70.0, "leg 1 (waypoint) ends"), FlightEvent(79.0, "leg 2 (hold) ends")]
    path: Any = SimpleNamespace(events=events, state=lambda time: here, ellipsoid=WGS84)
    none: Any = None
    pieces = [Piece(0, 0, 0.0, 40.0, none), Piece(0, 1, 40.0, 70.0, none), Piece(1, 0, 70.0, 79.0, none),
              Piece(2, 0, 79.0, 99.0, none)]  # fmt: skip
    scenario: Any = SimpleNamespace(flight=flight)
    truth: Any = SimpleNamespace(trajectory=path)
    first, second = misses(scenario, truth, pieces)
    assert (first.number, first.name, first.time) == (1, "A", 40.0)
    assert (second.number, second.name, second.time) == (2, "waypoint 2", 70.0)
    assert (first.to_go, first.right) == pytest.approx((20.0, -110.0), abs=0.02)
    assert (second.latitude, second.longitude) == pytest.approx((math.radians(61.0), math.radians(12.0)))
    single: Any = SimpleNamespace(flight=flight.model_copy(update={"legs": (flight.legs[1], WaypointLeg.model_validate(
        {"type": "waypoint", "latitude_deg": 62.0, "longitude_deg": 13.0}))}))  # fmt: skip
    over = SimpleNamespace(events=[FlightEvent(9.0, "leg 2 (waypoint) ends")], state=path.state, ellipsoid=WGS84)
    ended: Any = SimpleNamespace(trajectory=over)
    (only,) = misses(single, ended, [Piece(1, 0, 5.0, 9.0, none)])
    assert only.name == "leg 2"


def test_the_corridor_of_one_leg_by_hand() -> None:
    """0.3 nmi are 555.6 m; three of four seconds are within, from 12 s on it is outside; NaN is not judged."""
    tse = np.full((6, 3), 9e9)
    tse[:, 0] = 1e6, 555.0, -556.0, 0.0, -555.0, math.nan
    errors = PathErrors(np.arange(10.0, 16.0), np.array([0, 2, 2, 2, 2, 2]), tse, tse, tse, tse)
    start = {"on": "air", "latitude_deg": 59.0, "longitude_deg": 9.0, "altitude_m": 500.0}
    hold = {"type": "hold", "duration_s": 9.0}
    flight = FlightPlan.model_validate(
        {"aircraft": "c172x", "start": start, "legs": [hold, hold, {**hold, "rnp": 0.3}]}
    )
    (only,) = containments(flight, errors)
    assert only == (2, 0.3, 4.0, 0.75, 12.0)


@pytest.mark.parametrize(
    ("reached", "edges"), [([20.0, 50.0], [5.0, 20.0, 60.0]), ([20.0], [5.0, 20.0, 60.0]), ([], [5.0, 60.0])]
)
def test_a_route_is_flown_place_by_place(reached: list[float], edges: list[float]) -> None:
    """Its second part begins where the first place is reached; without that there is the first part alone."""
    tracks = [level_track(0.0, 0.0, 0.0), level_track(1.0, 0.0, 0.0)]
    leg = WaypointLeg.model_validate({"type": "waypoint", "waypoints": ROUTE})
    flight: Any = SimpleNamespace(legs=[leg], planned_tracks=lambda begins: [tracks])
    events = [FlightEvent(5.0, "leg 1 (waypoint) begins")]
    events += [
        FlightEvent(at, f"{name} reached: 1 km away") for at, name in zip(reached, ("A", "waypoint 2"), strict=False)
    ]
    path: Any = SimpleNamespace(events=events, start=0.0, end=60.0, state=flown_over)
    level = np.array([1.0, 0.0, 0.0, 0.0])
    pieces = planned_pieces(flight, path, path, np.zeros(3), level)
    assert pieces == [Piece(0, k, *ends, tracks[k]) for k, ends in enumerate(pairwise(edges))]
