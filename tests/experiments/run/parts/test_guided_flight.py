"""What a flight by its navigator says, from entries whose every number is written by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.data import NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.experiments.run.parts.guided_flight import (
    Displaced,
    Guidance,
    OffPath,
    _air_words,
    _between,
    _closing,
    _horizontal,
    _missed_words,
)
from sinssim.simulation.path_errors import Miss

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
    passes: Any = {"in_sections": False, "moved_m": [120.0, 6.0, 0.6]}
    assert _closing(passes) == (
        "The plan was flown 4 times, first by the true motion, then with the errors of the navigator on the flight "
        "before, which moved the path by 120 m, 6.00 m, 0.600 m. "
        "It is 0.0600 m from that of the closed loop, or nearer."
    )
    sections: Any = {"in_sections": True, "moved_m": [0.0004, 0.0009]}
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
    part.enter({"source": "euler", "moved_m": [0.5], "in_sections": False, "ended_early": "", "legs": [],
                "waypoints": [], "seen": {"airspeed": "true", "height": "true"}})  # fmt: skip
    said, charts = part.exhibits()
    assert said.text.startswith("The autopilot and the legs see the solution euler. Its airspeed is true, its height")  # type: ignore[union-attr]
    (chart,) = charts  # type: ignore[misc]
    assert chart.title == "Displacement from the flight of a perfect navigator"
    assert (chart.x.low, chart.x.high) == (10.0, 70.0)
    assert [(line.label, line.color) for line in chart.marks] == [("along", "x"), ("right", "y"), ("up", "z")]
    np.testing.assert_array_equal([line.y for line in chart.marks], values.T)
