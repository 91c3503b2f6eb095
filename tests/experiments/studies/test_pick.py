"""Which engine to pick, decided by hand for made-up errors and costs."""

from __future__ import annotations

from typing import Any

import pytest
from rich.console import Console

from sinssim.experiments.studies.claims import picks
from sinssim.experiments.studies.study_charts import one_draw
from sinssim.experiments.studies.study_exhibits import StudyMedia, exhibits_of
from sinssim.experiments.studies.study_results import Row, StudyResult, needed
from sinssim.experiments.studies.study_schema import Study
from sinssim.recording.console import show

PARKED = {"name": "a", "parked": {"latitude_deg": 50.0, "duration_s": 3600.0}}
FLOWN = {"name": "b", "parked": {"latitude_deg": 60.0, "duration_s": 3600.0}}
COST = {"quaternion": 100.0, "poisson-1": 50.0, "euler": 80.0}  # ns a step
MILE = 185.2  # a tenth of a nautical mile in an hour, m


def study(**more: Any) -> Study:
    part = {"title": "p", "algorithms": list(COST), "rates_hz": [50.0], "motions": [PARKED, FLOWN], **more}
    return Study.model_validate({"name": "s", "seed": 7, "parts": [part]})


def row(motion: str, algorithm: str, metres: float, arcsec: float, rate: float = 50.0, **more: Any) -> Row:
    case = {
        "part": "p", "motion": motion, "variant": "rate-gyros", "sensors": "ideal", "algorithm": algorithm,
        "frame": "level", "gravity": "normal", "curvature": "exact", "rate_hz": rate, "schedule_hz": (), "slow": "",
        "attitude_drift_arcsec_h": arcsec, "max_horizontal_error_m": metres, "duration_s": 3600.0,
        "ns_per_step": COST[algorithm],
    }  # fmt: skip
    return Row(**{**case, **more})


def picked(rows: list[Row], **more: Any) -> list[Any]:
    return picks(StudyResult(study(**more), rows=rows, media=StudyMedia()))


def both(algorithm: str, a: tuple[float, float], b: tuple[float, float], **more: Any) -> list[Row]:
    return [row("a", algorithm, *a, **more), row("b", algorithm, *b, **more)]


def test_the_cheapest_that_is_accurate_enough_everywhere() -> None:
    """One is cheapest and fails on one motion only, one is best and dear."""
    rows = both("quaternion", (1e-6, 1e-6), (1e-6, 1e-6)) + both("euler", (MILE - 1.0, 1.0), (1.0, 17.9))
    (pick,) = picked(rows + both("poisson-1", (1.0, 1.0), (1.0, 18.1)))
    assert pick.choice == "euler"
    assert pick.numbers == pytest.approx(
        {
            "max_horizontal_error_m": MILE - 1.0, "attitude_drift_arcsec_h": 17.9, "us_per_second": 4.0,
            "candidates": 3.0, "accurate_enough": 2.0, "best_max_horizontal_error_m": 1e-6,
            "best_attitude_drift_arcsec_h": 1e-6, "best_us_per_second": 5.0,
        }
    )  # fmt: skip
    assert "2 of 3 stay below 0.1 nmi/h and 0.3′/h" in pick.reason
    assert "184 m and 17.9 ″/h at most, 4.00 µs" in pick.reason
    assert "Cheaper, but in error by 18.1 ″/h on b: poisson-1." in pick.reason
    assert "quaternion has the smallest errors: 1.00e-06 m" in pick.reason
    (pick,) = picked(rows + both("poisson-1", (MILE + 1.0, 1.0), (1.0, 1.0)))
    assert (pick.choice, "Cheaper, but in error by 186 m on a: poisson-1." in pick.reason) == ("euler", True)
    (pick,) = picked(rows + both("poisson-1", (1.0, 1.0), (1.0, 1.0)))
    assert pick.choice == "poisson-1"


def test_both_bars_are_per_hour_whatever_the_duration() -> None:
    """Ten minutes and ten hours: a sixth and ten times of 185.2 m; an error at the end of 0.1″ or 100″ says nothing."""
    for hours, arcsec in ((1.0 / 6.0, 0.1), (10.0, 100.0)):
        more = {"duration_s": 3600.0 * hours, "max_attitude_error_arcsec": arcsec}
        best = both("quaternion", (1.0, 1.0), (1.0, 1.0), **more)
        for metres, drift, enough in (
            (0.99 * MILE * hours, 17.9, True), (1.01 * MILE * hours, 17.9, False), (1.0, 18.1, False),
        ):  # fmt: skip
            (pick,) = picked(
                best + both("poisson-1", (metres, drift), (1.0, 1.0), **more), algorithms=["quaternion", "poisson-1"]
            )
            assert (pick.choice == "poisson-1") == enough


def test_the_pick_agrees_with_the_claim_on_the_rate_of_attitude() -> None:
    """At 40 Hz 0.3″ in a minute are 18.1 ″/h; at 80 Hz they are less."""
    rows = [
        row(m, "quaternion", 1.0, drift, rate, duration_s=60.0, max_attitude_error_arcsec=drift / 60.0)
        for m in "ab" for rate, drift in ((40.0, 18.1), (80.0, 4.0), (400.0, 0.1))
    ]  # fmt: skip
    (pick,) = picked(rows, algorithms=["quaternion"], rates_hz=[40.0, 80.0, 400.0])
    assert pick.choice == "quaternion at 80 Hz"
    assert needed(rows)["quaternion"].rate_hz == 80.0
    assert pick.numbers["attitude_drift_arcsec_h"] == 4.0
    assert pick.numbers["best_attitude_drift_arcsec_h"] == 0.1


def test_real_sensors_are_shared_by_all_engines() -> None:
    """Far beyond the bars, what is within 10 % of the least error costs nothing that anyone could see."""
    rows = both("quaternion", (5000.0, 300.0), (900.0, 100.0)) + both("euler", (5400.0, 329.0), (980.0, 109.0))
    (pick,) = picked(rows + both("poisson-1", (5600.0, 300.0), (900.0, 100.0)))
    assert pick.choice == "euler"
    assert "Cheaper, but in error by 5600 m on a: poisson-1" in pick.reason


def test_the_rate_is_part_of_the_cost() -> None:
    """A slower rate of a dearer engine computes less."""
    rows = [r for hz in (50.0, 100.0) for name in COST for r in both(name, (1.0, 1.0), (1.0, 1.0), rate=hz)]
    dear = [r if (r.algorithm, r.rate_hz) == ("quaternion", 50.0) else row(
        r.motion, r.algorithm, 1e4, 1.0, r.rate_hz) if r.rate_hz == 50.0 else r for r in rows]  # fmt: skip
    (pick,) = picked(dear, rates_hz=[50.0, 100.0])
    # quaternion 100 ns at 50 Hz and poisson-1 50 ns at 100 Hz cost the same, and are alike
    assert pick.choice in ("quaternion at 50 Hz", "poisson-1 at 100 Hz")
    assert pick.numbers["us_per_second"] == pytest.approx(5.0)
    (pick,) = picked(rows, rates_hz=[50.0, 100.0])
    assert pick.choice == "poisson-1 at 50 Hz"


def test_what_cannot_be_navigated_is_not_picked() -> None:
    rows = both("quaternion", (1.0, 1.0), (1.0, 1.0)) + both("euler", (1.0, 1.0), (1.0, 1.0))
    failed = [row("a", "poisson-1", 1.0, 1.0), row("b", "poisson-1", 0.0, 0.0, status="failed")]
    (pick,) = picked(rows + failed)
    assert pick.choice == "euler"
    assert "1 of 3 failed on some motion." in pick.reason
    (pick,) = picked([row(m, name, 0.0, 0.0, status="failed") for name in COST for m in "ab"])
    assert (pick.choice, pick.reason[:28]) == ("", "None: every engine failed on")


def test_nobody_is_good_enough_in_both() -> None:
    rows = both("quaternion", (5000.0, 1.0), (1.0, 1.0)) + both("euler", (1.0, 500.0), (1.0, 1.0))
    (pick,) = picked(rows + both("poisson-1", (9.0, 30.0), (1.0, 1.0)))
    assert pick.choice == "poisson-1"  # 30 times the least at worst, where the others have 500 and 5000 times
    assert "It has the smallest errors; none of 3 stays below" in pick.reason


def test_a_study_that_was_broken_off_is_undecided() -> None:
    (pick,) = picked(both("quaternion", (1.0, 1.0), (1.0, 1.0)), algorithms=["quaternion", "euler"])
    assert pick.choice == ""
    assert pick.reason == "Undecided: 2 of its 4 navigations were not reached."


def test_one_engine_leaves_nothing_to_pick() -> None:
    assert picked(both("quaternion", (1.0, 1.0), (1.0, 1.0)), algorithms=["quaternion"]) == []


def test_sensors_on_one_draw_say_so() -> None:
    several = study(sensors=["ideal", "tactical"])
    said = one_draw(several.parts[0], several)
    assert said.startswith("The sensors are compared on one draw of their errors (seed 7)")
    console = Console(record=True, width=400)
    show(exhibits_of(StudyResult(several, media=StudyMedia())), console)
    assert "p:\n" + said.replace("`", "") in console.export_text()
    ideal = study()
    assert one_draw(ideal.parts[0], ideal) == ""
    alone = study(sensors=["tactical"])
    assert one_draw(alone.parts[0], alone) == ""
