"""What a flight by its navigator says, from entries whose every number is written by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.charts import PAIR
from sinssim.data import NavSolution, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.experiments.run.filter_summary import Moment
from sinssim.experiments.run.parts import guided_flight
from sinssim.experiments.run.parts.guided_flight import (
    Displaced,
    Guidance,
    OffPath,
    _air_words,
    _between,
    _closing,
    _horizontal,
    _missed_words,
    _sizes,
)
from sinssim.experiments.run.parts.phases import Phase
from sinssim.simulation.total_system_error import Miss, PathErrors, Piece
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.sampling import FlightEvent

SHOWN = ("tse_across_95", "tse_across_max", "tse_vertical_max", "nse_across_95", "nse_along_95", "nse_vertical_95",
         "fte_across_95", "fte_vertical_95")  # fmt: skip


def sizes(first: float, **of: str) -> dict[str, Any]:
    """Return errors of which those that a table shows count up from a first one, m."""
    return {f"{name}_m": first + k for k, name in enumerate(SHOWN)} | of


def off_path() -> OffPath:
    part = OffPath(SimpleNamespace())  # type: ignore[arg-type]
    inside = {"leg": "1 hold", "rnp": 0.3, "judged_s": 100.0, "within": 1.0, "exceeded_s": None}
    outside = {"leg": "2 waypoint", "rnp": 0.3, "judged_s": 300.0, "within": 0.9, "exceeded_s": 140.0}
    part.enter({
        "source": "euler", "legs": [sizes(10.0, leg="1 hold"), sizes(20.0, leg="2 waypoint")], "phases": [],
        "flight": sizes(30.0), "solutions": {}, "corridors": [inside, outside],
    })  # fmt: skip
    return part


def test_a_corridor_that_is_not_kept() -> None:
    """100 s within and 90 % of 300 s are 92.5 % of the time."""
    (verdict,) = off_path()._verdicts()
    assert verdict.text == (
        "RNP 0.3 is NOT met: the true path is within 0.3 nmi of the planned one 92.5 % of the time (95 % on every leg "
        "are needed); first outside at 140 s, on leg 2 waypoint. On leg 2 waypoint it is 90 %."
    )


def test_the_errors_by_leg() -> None:
    table = off_path()._table(("page",))
    assert table.title == "Distance from the planned path by leg"
    assert [(column.group, column.head) for column in table.columns] == [
        ("", "leg"), ("TSE", "across 95 %"), ("TSE", "across largest"), ("TSE", "vertical largest"),
        ("NSE", "across 95 %"), ("NSE", "along 95 %"), ("NSE", "vertical 95 %"), ("FTE", "across 95 %"),
        ("FTE", "vertical 95 %"), ("", "RNP"), ("", "within"), ("", "first outside"),
    ]  # fmt: skip
    assert [list(row) for row in table.rows] == [
        ["1 hold", *np.arange(10.0, 18.0), "0.3", "100 %", "–"],
        ["2 waypoint", *np.arange(20.0, 28.0), "0.3", "90 %", "140 s"],
        ["flight, all", *np.arange(30.0, 38.0), "", "", ""],
    ]


def test_the_waypoints_and_their_misses() -> None:
    part = Guidance(SimpleNamespace())  # type: ignore[arg-type]
    waypoint = {"waypoint": "N", "time_s": 60.0, "right_m": 5.0, "left_to_go_m": 7.0, "navigation_error_m": 9.0}
    part.enter({"legs": [], "waypoints": [waypoint]})
    (table,) = part._tables(("page",))
    heads = [column.head for column in table.columns]  # type: ignore[union-attr]
    assert dict(zip(heads, table.rows[0], strict=True)) == {  # type: ignore[union-attr]
        "waypoint": "N", "at": 60.0, "passed to the right by": 5.0, "left to go": 7.0, "navigation error": 9.0,
    }  # fmt: skip
    for right, words in ((12.5, "right"), (-12.5, "left")):
        assert _missed_words(Miss(1, "N", 0.8, 0.2, 60.0, right, 7.0)) == f"N (12.5 m {words})"


def test_the_displacement_is_along_the_velocity_to_its_right_and_up() -> None:
    """Flying east at the equator, a place 10 m north, 4 m east and 2 m higher is 4 m ahead and 10 m to the left."""
    r1, r2 = 6335439.3273 + 1000.0, 6378137.0 + 1000.0
    east, level, at = np.array([[0.0, 100.0, 0.0]]), np.eye(4)[:1], np.zeros(1)
    there = NavState(at, at, at + 1000.0, east, level)
    here = NavState(at + 10.0 / r1, at + 4.0 / r2, at + 1002.0, east, level)
    path: Any = SimpleNamespace(ellipsoid=WGS84)
    np.testing.assert_allclose(_between(there, here, at, path), [[4.0, -10.0, 2.0]], atol=1e-4)


def test_a_flight_that_ends_early_tells_where() -> None:
    part = Guidance(SimpleNamespace())  # type: ignore[arg-type]
    end = {"time_s": 123.46, "latitude_deg": 47.12346, "longitude_deg": 8.5, "height_m": 432.4, "descent_mps": 2.34}
    text = (
        "The flight ends early, at 123.5 s, in leg 3 (land): too low. It is then at 47.1235°, 8.5000°, 432 m high{}, "
        "sinking at 2.3 m/s."
    )
    for threshold, words in ((850.0, ", 850 m from the threshold of the runway"), (None, "")):
        part.enter({"ended_early": "leg 3 (land): too low", "end": {**end, "threshold_m": threshold}})
        (said,) = part._early(("page",))
        assert said.text == text.format(words)  # type: ignore[union-attr]


def test_without_a_solution_its_error_is_unknown() -> None:
    begun: Any = SimpleNamespace(time=np.array([5.0, 6.0]))
    assert np.isnan(_horizontal(None, None, 1.0))  # type: ignore[arg-type]
    assert np.isnan(_horizontal(None, begun, 4.9))  # type: ignore[arg-type]


def test_the_displacement_by_leg() -> None:
    part = Guidance(SimpleNamespace())  # type: ignore[arg-type]
    leg = {"leg": "2 hold", "end_s": 61.5, "navigation_error_m": 1.5, "along_m": 2.5, "right_m": -3.5, "up_m": 4.5,
           "horizontal_max_m": 5.5}  # fmt: skip
    waypoint = {"waypoint": "N", "time_s": 60.5, "right_m": 6.5, "left_to_go_m": 7.5, "navigation_error_m": 8.5}
    part.enter({"legs": [leg], "waypoints": [waypoint]})
    pages = [table.shown("page")[1:] for table in part._tables(("page",))]  # type: ignore[union-attr]
    assert [([", ".join(filter(None, head)) for head in heads], rows) for heads, rows in pages] == [
        (["leg", "end, s", "navigation error, m", "along, m", "right, m", "up, m", "largest, m"],
         [["2 hold", "61.50", "1.50", "2.50", "−3.50", "4.50", "5.50"]]),
        (["waypoint", "at, s", "passed to the right by, m", "left to go, m", "navigation error, m"],
         [["N", "60.50", "6.50", "7.50", "8.50"]]),
    ]  # fmt: skip


def test_how_the_loop_was_closed() -> None:
    passes: Any = {"in_sections": False, "moved_m": [120.0, 6.0, 0.6], "left_m": 0.06}
    assert _closing(passes) == (
        "The plan was flown 4 times, first by the true motion, then with the errors of the navigator on the flight "
        "before, which moved the path by 120 m, 6.00 m, 0.600 m. "
        "It is 0.0600 m from that of the closed loop, or nearer."
    )
    sections: Any = {"in_sections": True, "moved_m": [0.0009, 0.0004], "left_m": 0.0009}
    assert _closing(sections) == (
        "The plan was flown in 2 sections, because a decision of the navigator turns with the path: each again with "
        "the errors of the navigator on the trial before, until that moved its path by at most 0.000900 m."
    )
    seen: Any = {"seen": {"airspeed": "sensor", "height": "solution"}}
    assert _air_words(seen) == "Its airspeed is that of [aiding.airspeed], its height that of the solution."


def test_where_it_went_on_the_console() -> None:
    part = Guidance(SimpleNamespace())  # type: ignore[arg-type]
    entry = {"source": "euler", "displacement_end_m": 12.5, "displacement_max_m": 31.25, "ended_early": "", "legs": [],
             "waypoints": [], "seen": {"airspeed": "true", "height": "sensor"}}  # fmt: skip
    part.enter(entry)
    (said,) = part.brief({})
    assert said.text == (  # type: ignore[union-attr]
        "The flight follows euler: at its end it is 12.5 m from where a perfect navigator with perfect air data would "
        "have taken it, at most 31.2 m. Its airspeed is true, its height that of [aiding.baro]."
    )


def test_the_displacement_over_time() -> None:
    part = Guidance(SimpleNamespace())  # type: ignore[arg-type]
    values = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    vars(part)["displaced"] = Displaced(np.array([10.0, 70.0]), values)
    part.enter({"source": "euler", "moved_m": [0.5], "left_m": 0.5, "in_sections": False, "ended_early": "", "legs": [],
                "waypoints": [], "seen": {"airspeed": "true", "height": "true"}})  # fmt: skip
    said, charts = part.exhibits()
    assert said.text.startswith("The autopilot and the legs see the solution euler. Its airspeed is true, its height")  # type: ignore[union-attr]
    assert charts.size == (PAIR[0] / 2.0, PAIR[1])  # type: ignore[union-attr]
    (chart,) = charts  # type: ignore[misc]
    assert chart.title == "Displacement from the flight of a perfect navigator"
    assert (chart.x.low, chart.x.high) == (10.0, 70.0)
    assert [(line.label, line.color) for line in chart.marks] == [("along", "x"), ("right", "y"), ("up", "z")]
    np.testing.assert_array_equal([line.y for line in chart.marks], values.T)


M60, N60 = 6383453.857, 6394209.174
"""a(1 − e²)/W³ and a/W at 60°, where the cosine is a half."""


def states(north: float, east: float, up: float, velocity: tuple[float, float, float]) -> NavState:
    """Return a place beside 60° N, 200° E and 1000 m, by metres."""
    one = np.ones(1)
    return NavState(np.pi / 3.0 + north / (M60 + 1000.0) * one, np.radians(200.0) + east / ((N60 + 1000.0) * 0.5) * one,
                    (1000.0 + up) * one, np.array([velocity]), np.eye(4)[:1])  # fmt: skip


def test_the_displacement_on_an_oblique_course() -> None:
    """30 m/s south and 40 m/s west of the perfect flight: a place 10 m north and 5 m east is −10 · 0.6 − 5 · 0.8 m
    along, and 10 · 0.8 − 5 · 0.6 m to the right, whatever its own velocity."""
    there, here = states(0.0, 0.0, 0.0, (-30.0, -40.0, 5.0)), states(10.0, 5.0, -3.0, (70.0, 1.0, 0.0))
    path: Any = SimpleNamespace(ellipsoid=WGS84)
    np.testing.assert_allclose(_between(there, here, np.array([9.0]), path), [[-10.0, 5.0, -3.0]], atol=1e-3)


def test_the_error_in_the_last_row_before_an_instant() -> None:
    """Rows at 10, 10.5 and 11 s, 5, 13 and 25 m off: 3-4-5, 5-12-13 and 7-24-25, north and west, and 100 m too high."""
    rows = [states(north, -east, 100.0, (0.0, 0.0, 0.0)) for north, east in ((3.0, 4.0), (5.0, 12.0), (7.0, 24.0))]
    columns = (np.concatenate([getattr(row, name) for row in rows]) for name in
               ("latitude", "longitude", "height", "velocity_ned", "q_nb"))  # fmt: skip
    solution = NavSolution(np.array([10.0, 10.5, 11.0]), *columns, np.zeros(3))
    asked: list[float] = []
    true = states(0.0, 0.0, 0.0, (0.0, 0.0, 0.0))
    path: Any = SimpleNamespace(ellipsoid=WGS84, state=lambda time: asked.extend(time) or true)
    found = [_horizontal(path, solution, at) for at in (10.0, 10.4, 10.5, 99.0)]
    assert found == pytest.approx([5.0, 5.0, 13.0, 25.0], abs=1e-3)
    assert asked == [10.0, 10.0, 10.5, 11.0]


def test_the_displacement_ends_with_the_shorter_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    """A flight from 5 to 8.5 s beside a perfect one until 7.25 s, and the other way round."""
    monkeypatch.setattr(guided_flight, "_between", lambda there, here, time, path: np.outer(time, [1.0, 2.0, 3.0]))
    for ends in ((8.5, 7.25), (7.25, 8.5)):
        path, perfect = (SimpleNamespace(start=5.0, end=end, state=lambda time: time) for end in ends)
        truth = Truth.__new__(Truth)
        vars(truth).update(trajectory=path, guided=SimpleNamespace(by_truth=perfect))
        displaced = Guidance(SimpleNamespace(truth=truth)).displaced  # type: ignore[arg-type]
        assert displaced.time.tolist() == [5.0, 6.0, 7.0, 7.25]


def test_the_displacement_at_an_instant() -> None:
    displaced = Displaced(np.array([10.0, 14.0]), np.array([[0.0, 8.0, -4.0], [4.0, 0.0, 12.0]]))
    assert displaced.at(11.0).tolist() == [1.0, 6.0, 0.0]


def off_by(across: list[float]) -> PathErrors:
    """Return errors from 10 s on, on legs 1, 1, 3 and 3 of which the second is unknown; along is ten times, above a
    hundred times, those across, NSE minus once, and FTE twice, TSE."""
    tse = np.outer(across, [1.0, 10.0, 100.0])
    tse[1] = np.nan
    leg = np.array([0, 0, 2, 2])
    return PathErrors(np.arange(10.0, 14.0), leg, -tse, 2.0 * tse, tse, np.zeros((4, 3)))


def test_the_sizes_of_errors() -> None:
    """Of 3 and 4 m: √12.5, 3.95 (95 % of the way from the one to the other) and 4 m."""
    errors = off_by([9.0, 9.0, 3.0, -4.0])
    found = _sizes(errors, errors.leg == 2)
    size = {"rms": np.sqrt(12.5), "95": 3.95, "max": 4.0}
    expected = {
        f"{name}_{axis}_{what}_m": pytest.approx(of * factor * value)
        for name, of in (("tse", 1.0), ("nse", 1.0), ("fte", 2.0))
        for axis, factor in (("across", 1.0), ("along", 10.0), ("vertical", 100.0))
        for what, value in size.items()
    }
    assert found == expected
    assert list(_sizes(errors, np.array([False, True, False, False]), ("nse",)).values()) == [None] * 9


def flying(*legs: dict[str, Any], **more: Any) -> Any:
    """Return a run of a flight of these legs, by its navigator "mine"."""
    start = {"on": "air", "latitude_deg": 60.0, "longitude_deg": 10.0, "altitude_m": 500.0}
    plan = FlightPlan.model_validate({"aircraft": "c172x", "start": start, "legs": legs, **more})
    events = [FlightEvent(10.0, "leg 1 (hold) begins"), FlightEvent(12.0, "leg 3 (hold) begins")]
    path = SimpleNamespace(events=events, start=10.0, end=14.0, ellipsoid=WGS84)
    truth = Truth.__new__(Truth)
    vars(truth).update(trajectory=path, guided=SimpleNamespace(source="mine"))
    return SimpleNamespace(scenario=SimpleNamespace(flight=plan), truth=truth, solutions={})


HOLD = {"type": "hold", "duration_s": 2.0}
TURNS = {"type": "s_turns", "turns": 1}


def of_flight(across: list[float], **more: Any) -> OffPath:
    """Return the part of three legs, of which the first and the last have a path."""
    errors = off_by(across)
    part = OffPath(flying(HOLD, TURNS, {**HOLD, "rnp": 0.3}, **more), kept={False: errors})
    track: Any = None
    vars(part)["pieces"] = [Piece(0, 0, 10.0, 12.0, track), Piece(2, 0, 12.0, 14.0, track)]
    return part


def test_the_entry_of_the_path() -> None:
    """The last leg leaves 555.6 m at 13 s: within for one of two seconds."""
    entry = of_flight([9.0, 9.0, 3.0, -556.0]).numbers()
    assert [leg["leg"] for leg in entry["legs"]] == ["1 hold", "3 hold"]
    assert [leg["tse_across_max_m"] for leg in entry["legs"]] == [9.0, 556.0]
    assert (entry["source"], entry["solutions"]) == ("mine", {})
    assert entry["flight"]["fte_along_max_m"] == 11120.0
    assert entry["corridors"] == [{"leg": "3 hold", "rnp": 0.3, "judged_s": 2.0, "within": 0.5, "exceeded_s": 13.0}]


def test_the_errors_by_phase(monkeypatch: pytest.MonkeyPatch) -> None:
    """A row on the edge of two phases belongs to the later one."""
    phases = [Phase("climb", 10.0, 12.0), Phase("cruise", 12.0, 13.0)]
    monkeypatch.setattr(guided_flight, "phases_of", lambda events: phases)
    entry = of_flight([9.0, 9.0, 3.0, -4.0]).numbers()
    assert [(phase["phase"], phase["tse_across_max_m"], phase["nse_along_max_m"]) for phase in entry["phases"]] == [
        ("climb", 9.0, 90.0), ("cruise", 3.0, 30.0),
    ]  # fmt: skip


def test_the_corridors_over_time() -> None:
    """1 nmi on the first leg and 0.3 nmi on the last; they widen a chart whose errors are more than a quarter of it."""
    part = of_flight([9.0, 9.0, 3.0, -464.0], rnp=1)
    edges = list(part._limits())
    assert [line.label for line in edges] == ["RNP 1", "", "RNP 0.3", ""]
    assert [line.x.tolist() for line in edges] == [[10.0, 11.0]] * 2 + [[12.0, 13.0]] * 2
    assert [line.y.tolist() for line in edges] == [
        [y] * 2 for y in (-1852.0, 1852.0, pytest.approx(-555.6), pytest.approx(555.6))
    ]
    assert [line.counts for line in edges] == [True] * 4
    assert [line.counts for line in of_flight([9.0, 9.0, 3.0, -462.0], rnp=1)._limits()] == [False] * 2 + [True] * 2


def test_two_legs_in_one_corridor() -> None:
    """Kept on both legs, in 96 % of 100 s and all of 300 s; each width by itself, the narrow one first."""
    part = off_path()
    legs = [("1 hold", 1.0, 100.0, 0.96, 30.0), ("2 turn", 0.3, 50.0, 1.0, None), ("3 hold", 1.0, 300.0, 1.0, None)]
    keys = ("leg", "rnp", "judged_s", "within", "exceeded_s")
    part.enter({**part.entry, "corridors": [dict(zip(keys, leg, strict=True)) for leg in legs]})
    assert [verdict.text for verdict in part._verdicts()] == [
        "RNP 0.3 is met: the true path is within 0.3 nmi of the planned one 100 % of the time (95 % on every leg are "
        "needed).",
        "RNP 1 is met: the true path is within 1 nmi of the planned one 99 % of the time (95 % on every leg are "
        "needed); first outside at 30 s, on leg 1 hold. On leg 1 hold it is 96 %.",
    ]


def test_the_charts_of_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """From 10 to 13 s; two detections 0.5 s apart have their words together, at the first."""
    seen = [Moment(10.5, "one", "of them"), Moment(11.0, "other", "of them")]
    monkeypatch.setattr(OffPath, "_faults", lambda self: seen)
    across, above = of_flight([9.0, 9.0, 3.0, -4.0])._charts()
    assert (across.key, above.key) == ("planned_path/across", "planned_path/vertical")
    for chart, factor in ((across, 1.0), (above, 100.0)):
        assert (chart.x.low, chart.x.high) == (10.0, 13.0)
        fte, nse, tse, *marks = chart.marks
        lines: list[Any] = [fte, nse, tse]
        assert [(line.label, line.color) for line in lines] == [("FTE", "fte"), ("NSE", "nse"), ("TSE", "tse")]
        assert [line.y[3] for line in lines] == [-8.0 * factor, 4.0 * factor, -4.0 * factor]
        assert [mark.at for mark in marks if hasattr(mark, "at")] == [10.5, 11.0]
        assert "one, other" in repr(marks)


@pytest.mark.parametrize(
    ("quantities", "sensors", "seen"),
    [(("position", "height"), ["airspeed"], ("sensor", "solution")), (("position",), [], ("true", "true")),
     (("position",), ["height"], ("true", "sensor"))],
)  # fmt: skip
def test_whose_air_data_the_autopilot_sees(
    quantities: tuple[str, ...], sensors: list[str], seen: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guided_flight, "air_sensors", lambda scenario: dict.fromkeys(sensors))
    part = Guidance(flying(HOLD, guidance={"quantities": quantities}))
    assert part._seen() == {"airspeed": seen[0], "height": seen[1]}


def test_the_entry_of_the_guidance(monkeypatch: pytest.MonkeyPatch) -> None:
    """From 10 to 13.5 s, once a second: on the first leg, until 12 s, at most 3-4-5, on the second 6-8-10 m. At its
    end, 12.5 s, the displacement is the mean of those at 12 and 13 s; the flight ends 5-12-13 m off."""
    events = [FlightEvent(10.0, "leg 1 (hold) begins"), FlightEvent(12.0, "leg 1 (hold) ends"),
              FlightEvent(13.2, "leg 2 (turn) ends"),
              FlightEvent(13.5, f"{guided_flight.ENDED}leg 3 (land): too low")]  # fmt: skip
    run = flying(HOLD)
    path = SimpleNamespace(events=events, start=10.0, end=13.5)
    guided = SimpleNamespace(source="mine", moved=(120.0, 0.5), left=0.25, in_sections=True)
    vars(run.truth).update(trajectory=path, guided=guided)
    run.solutions["mine"] = "solution"
    part = Guidance(run)
    values = np.array([[0.0, 0.0, 9.0], [3.0, -4.0, 1.0], [1.0, 0.0, -2.0], [-6.0, 8.0, 3.0], [5.0, 12.0, 99.0]])
    vars(part)["displaced"] = Displaced(np.array([10.0, 11.0, 12.0, 13.0, 13.5]), values)
    monkeypatch.setattr(Guidance, "_seen", lambda self: {"airspeed": "true", "height": "sensor"})
    monkeypatch.setattr(guided_flight, "pieces_of", lambda scenario, truth: "pieces")
    monkeypatch.setattr(guided_flight, "misses", lambda *given: [Miss(1, str(given[2]), 0.8, 0.2, 11.5, -7.0, 4.0)])
    monkeypatch.setattr(guided_flight, "_horizontal", lambda path, solution, time: 100.0 * time + (solution is None))
    monkeypatch.setattr(guided_flight, "ending", lambda plan, path: {"time_s": path.end})
    assert part.numbers() == {
        "source": "mine", "seen": {"airspeed": "true", "height": "sensor"}, "ended_early": "leg 3 (land): too low",
        "end": {"time_s": 13.5}, "moved_m": [120.0, 0.5], "left_m": 0.25, "in_sections": True,
        "displacement_max_m": 13.0, "displacement_end_m": 13.0,
        "legs": [
            {"leg": "1 hold", "end_s": 12.0, "navigation_error_m": 1200.0, "along_m": 1.0, "right_m": 0.0, "up_m": -2.0,
             "horizontal_max_m": 5.0},
            {"leg": "2 turn", "end_s": 13.2, "navigation_error_m": 1320.0, "along_m": pytest.approx(-1.6),
             "right_m": pytest.approx(9.6), "up_m": pytest.approx(41.4), "horizontal_max_m": 10.0},
        ],
        "waypoints": [{"waypoint": "pieces", "time_s": 11.5, "right_m": -7.0, "left_to_go_m": 4.0,
                       "navigation_error_m": 1150.0}],
    }  # fmt: skip
    part.enter("as before")  # type: ignore[arg-type]
    assert part.with_filter() == "as before"  # type: ignore[comparison-overlap]
    guided.source = "aided"
    assert part.with_filter()["source"] == "aided"


def test_the_errors_at_a_detection_on_the_console(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of the next row; none beyond the end, and none where no path is planned."""
    part = of_flight([9.0, 9.0, 3.0, -4.0])
    part.enter({**off_path().entry, "corridors": []})
    seen = [Moment(10.5, "a", "first"), Moment(11.5, "b", "second"), Moment(99.0, "c", "third")]
    monkeypatch.setattr(OffPath, "_faults", lambda self: seen)
    table, said = part.brief({})
    assert table.title == "Distance from the planned path by leg"  # type: ignore[union-attr]
    assert said.text == "At 11.5 s (second): across the planned path TSE 3.00 m, NSE −3.00 m."  # type: ignore[union-attr]


def test_what_the_page_says_of_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """Verdict, tables by leg and by phase, legs without a path, the solutions, the map and the charts."""
    part = of_flight([9.0, 9.0, 3.0, -4.0])
    monkeypatch.setattr(OffPath, "_map", lambda self: "map")
    monkeypatch.setattr(OffPath, "_charts", lambda self: iter(("across", "above")))
    nse = {f"nse_{axis}_{what}_m": 10.0 * k + m for k, axis in enumerate(("across", "along", "vertical"), 1)
           for m, what in enumerate(("95", "max"))}  # fmt: skip
    entry = {**off_path().entry, "phases": [sizes(40.0, phase="climb")], "solutions": {"euler": nse}}
    part.enter(entry)
    verdict, legs, phases, without, follows, navigation, drawn, charts = (*part.exhibits(),)
    assert verdict.text.startswith("RNP 0.3 is NOT met")  # type: ignore[union-attr]
    assert [(table.title, table.on) for table in (legs, phases, navigation)] == [  # type: ignore[union-attr]
        ("Distance from the planned path by leg", ("page",)), ("Distance from the planned path by phase", ("page",)),
        ("Navigation system errors", ("page",)),
    ]  # fmt: skip
    assert [list(row) for row in phases.rows] == [  # type: ignore[union-attr]
        ["climb", *np.arange(40.0, 48.0)], ["flight, all", *np.arange(30.0, 38.0)],
    ]  # fmt: skip
    assert (legs.note[:3], phases.note) == ("TSE", "")  # type: ignore[union-attr]
    assert [list(row) for row in navigation.rows] == [["euler", 10.0, 11.0, 20.0, 21.0, 30.0, 31.0]]  # type: ignore[union-attr]
    assert without.text == "Without a planned path in space: leg 2 s_turns."  # type: ignore[union-attr]
    assert follows.text == (  # type: ignore[union-attr]
        "The flight follows the true motion: its NSE is zero. Those of its solutions are:"
    )
    assert (drawn, charts.rows, charts.size) == ("map", (("across", "above"),), PAIR)  # type: ignore[union-attr]
    part.enter({**entry, "phases": [], "solutions": {}})
    assert len([*part.exhibits()]) == 5


def test_the_map_and_the_lines_of_a_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    """The true path, the believed one in the colour of its navigator, the planned one where it is known, at the true
    height where no height is planned, the corridors with one name for each width, and the waypoints with their miss."""
    part = of_flight([9.0, 9.0, 3.0, -4.0])
    time = np.arange(10.0, 14.0)
    planned = np.column_stack([time, 10.0 * time, [500.0, np.nan, 520.0, 530.0]])
    planned[3] = np.nan
    part.kept[False] = replace(part.errors, planned=planned)
    state = SimpleNamespace(latitude=0.1 * time, longitude=0.2 * time, height=1000.0 + time)
    vars(part.run.truth).update(time=time, state=state)
    higher = SimpleNamespace(latitude=None, longitude=None)
    part.run.truth.trajectory.state = lambda at: SimpleNamespace(height=1000.0 + np.asarray(at), **vars(higher))
    part.run.solutions["mine"] = SimpleNamespace(time=time, latitude=time, longitude=-time, height=2.0 * time)
    edge = np.array([1.0, 2.0])
    edges = [(0.3, edge, 3.0 * edge, 5.0 * edge), (0.3, -edge, -3.0 * edge, 5.0 * edge), (1.0, edge, edge, edge)]
    monkeypatch.setattr(guided_flight, "corridor_edges", lambda plan, pieces: iter(edges))
    missed = [Miss(1, "N", 0.8, 0.2, 11.0, 12.5, 7.0), Miss(2, "S", 0.9, 0.3, 12.0, -3.0, 7.0)]
    monkeypatch.setattr(guided_flight, "misses", lambda *given: missed)
    monkeypatch.setattr(OffPath, "_faults", lambda self: [Moment(11.0, "jump", "text")])
    found = SimpleNamespace(named=[("jump 11 s", 0.5, 0.6)])
    monkeypatch.setattr(guided_flight, "places_of", lambda some, path: found)
    drawn: dict[str, Any] = {}
    monkeypatch.setattr(guided_flight, "track_map", lambda tracks, ellipsoid, **more: drawn.update(
        tracks=tracks, ellipsoid=ellipsoid, **more))  # fmt: skip
    part._map()
    assert [(t.name, t.color, t.latitude.tolist(), t.longitude.tolist()) for t in drawn["tracks"]] == [
        ("true", "truth", (0.1 * time).tolist(), (0.2 * time).tolist()),
        ("believed", "mine", time.tolist(), (-time).tolist()),
        ("planned", "planned", [10.0, 11.0, 12.0], [100.0, 110.0, 120.0]),
        ("RNP 0.3", "corridor", [1.0, 2.0], [3.0, 6.0]), ("", "corridor", [-1.0, -2.0], [-3.0, -6.0]),
        ("RNP 1", "corridor", [1.0, 2.0], [1.0, 2.0]),
    ]  # fmt: skip
    assert drawn["places"] == [("N (12.5 m right)", 0.8, 0.2), ("S (3.00 m left)", 0.9, 0.3), ("jump 11 s", 0.5, 0.6)]
    assert (drawn["ellipsoid"], "the middle of the true track" in drawn["note"]) == (WGS84, True)
    lines = list(part.paths())
    assert [(line.name, line.color, line.words) for line in lines] == [
        ("planned", "planned", ()), ("believed", "mine", ()), ("corridor/0", "corridor", ()),
        ("corridor/1", "corridor", ()), ("corridor/2", "corridor", ()),
        ("waypoints", "planned", ("N (12.5 m right)", "S (3.00 m left)")),
    ]  # fmt: skip
    np.testing.assert_array_equal(lines[0].height, [500.0, 1011.0, 520.0, 1013.0])
    np.testing.assert_array_equal((lines[0].latitude, lines[0].longitude), planned[:, :2].T)
    heights = [line.height.tolist() for line in lines[1:]]
    assert heights == [[20.0, 22.0, 24.0, 26.0], [5.0, 10.0], [5.0, 10.0], [1.0, 2.0], [1011.0, 1012.0]]
    assert [line.latitude.tolist() for line in lines[1:]] == [
        time.tolist(), [1.0, 2.0], [-1.0, -2.0], [1.0, 2.0], [0.8, 0.9],
    ]  # fmt: skip
    assert [line.longitude.tolist() for line in lines[1:]] == [
        (-time).tolist(), [3.0, 6.0], [-3.0, -6.0], [1.0, 2.0], [0.2, 0.3],
    ]  # fmt: skip
