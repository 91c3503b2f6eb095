"""Numbers of a study from few given ones: drifts, facts of a motion, headings, orders, names and costs."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.experiments.studies import attitude_claims, step_cost, study_schema
from sinssim.experiments.studies.algorithm_comparison import _errors, _seconds, drifts, rows_of
from sinssim.experiments.studies.attitude_claims import FORMS, compare_headings
from sinssim.experiments.studies.step_cost import Cost, Operations, least_time, measure_time
from sinssim.experiments.studies.study_charts import at_one_rate, labeller, line_labeller, over_rates, varying
from sinssim.experiments.studies.study_exhibits import StudyMedia
from sinssim.experiments.studies.study_results import Case, ErrorGrowth, Pick, StudyResult, Verdict, fit_orders
from sinssim.experiments.studies.study_schema import Part, Study, StudyMotion
from sinssim.units import ARCSEC, DEG, UG, duration_text
from tests.experiments.studies.test_results import row

MOTION = {"name": "m", "parked": {"latitude_deg": 50.0, "duration_s": 9.0}}


def test_drifts_of_velocity_and_attitude() -> None:
    """Lines through the origin at rows 0, 1, 3: times 0, 3, 5 s from 7 s on; Σt² = 34."""
    time, speed = np.array([7.0, 10.0, 11.0, 12.0]), np.array([9.0, 6.0, 500.0, 20.0]) * UG
    angle = np.array([2.0, 7.0, 500.0, -4.0]) * ARCSEC
    seen = SimpleNamespace(time=time, speed=speed, angle=angle)
    found = drifts(seen, np.array([0, 1, 3]))  # type: ignore[arg-type]
    slope = (18.0 + 100.0) / 34.0
    left = 81.0 + 36.0 + 400.0 - slope**2 * 34.0
    turn = (21.0 - 20.0) / 34.0
    rest = 4.0 + 49.0 + 16.0 - turn**2 * 34.0
    assert found == pytest.approx({
        "velocity_drift_ug": slope, "velocity_drift_uncertainty_ug": math.sqrt(left / 34.0),
        "attitude_drift_arcsec_h": 3600.0 * turn,
        "attitude_drift_uncertainty_arcsec_h": 3600.0 * math.sqrt(rest / 34.0),
    }, rel=1e-12)  # fmt: skip


def test_rows_of_a_solution() -> None:
    n = np.arange(5.0)
    vectors, quaternions = np.outer(n, [1.0, 2.0, 3.0]), np.outer(n, [4.0, 5.0, 6.0, 7.0])
    whole = NavSolution(n, n + 10.0, n + 20.0, n + 30.0, vectors, quaternions, n + 40.0, "q", azimuth=n + 50.0)
    found = rows_of(whole, np.array([1, 4]))
    assert found.azimuth is not None
    columns = (found.time, found.latitude, found.longitude, found.height, found.defect, found.azimuth)
    assert [column.tolist() for column in columns] == [[k + 1.0, k + 4.0] for k in (0, 10, 20, 30, 40, 50)]
    assert found.velocity_ned.tolist() == [[1.0, 2.0, 3.0], [4.0, 8.0, 12.0]]
    assert found.q_nb.tolist() == [[4.0, 5.0, 6.0, 7.0], [16.0, 20.0, 24.0, 28.0]]


class _Northwards:
    """Down by 0.02° and up by 0.04° of latitude at 60 and 120 m/s in 90 s from 5 s on, nose at most 20° down."""

    start, end, ellipsoid = 5.0, 95.0, ELLIPSOIDS["wgs84"]

    def state(self, time: Array) -> NavState:
        t, zero = np.asarray(time) - 5.0, np.zeros(len(time))
        down = t < 45.0
        latitude = np.where(down, -41.0 - 0.02 * t / 45.0, -41.02 + 0.04 * (t - 45.0) / 45.0)
        pitch = np.where(down, -20.0, 10.0) * DEG
        velocity = np.stack([np.where(down, -48.0, 0.0), np.where(down, 36.0, 120.0), zero + 99.0], axis=1)
        q = np.stack([np.cos(0.5 * pitch), zero, np.sin(0.5 * pitch), zero], axis=1)
        return NavState(latitude * DEG, zero + 0.2, zero + 1000.0, velocity, q)

    def rates(self, time: Array) -> tuple[Array, Array]:
        omega = np.tile([3.0, -4.0, 12.0], (len(time), 1)) * DEG
        omega[len(time) // 2] *= 2.0
        return omega, np.zeros((len(time), 3))


def test_facts_of_a_motion() -> None:
    """0.06° of latitude in 90 s are 2.4 deg/h; mean of 60 and 120 m/s; 26° of rate; 6.66 km along the ground."""
    cone = {"type": "coning", "half_angle_deg": 3.0, "frequency_hz": 7.0, "duration_s": 90.0}
    found = study_schema.motion_facts(StudyMotion.model_validate({"motion": cone}), _Northwards())  # type: ignore[arg-type]
    assert found.duration_s == 90.0
    assert found.latitude_rate_deg_h == pytest.approx(2.4, rel=1e-6)
    assert found.ground_speed_kmh == pytest.approx(324.0, rel=1e-3)
    assert found.max_rate_deg_s == pytest.approx(26.0, rel=1e-9)
    assert found.max_pitch_deg == pytest.approx(20.0, rel=1e-9)
    assert found.max_latitude_deg == pytest.approx(41.02, rel=1e-5)
    # radius of curvature in the meridian at 41° without the height of 1 km: a(1 − e²)/(1 − e² sin²)^1.5
    radius = 6378137.0 * (1.0 - 0.00669438) / (1.0 - 0.00669438 * math.sin(41.0 * DEG) ** 2) ** 1.5
    assert found.distance_m == pytest.approx(0.06 * DEG * radius, rel=2e-5)
    assert found.cone == pytest.approx((3.0 * DEG, 14.0 * math.pi))
    assert study_schema.motion_facts(StudyMotion.model_validate(MOTION), _Northwards()).cone is None  # type: ignore[arg-type]


def test_the_beginning_of_increments() -> None:
    """Intervals that end within 0.35 s of the start at 2 s."""
    imu = ImuData(np.array([2.0, 2.1, 2.2, 2.35, 2.4]), np.arange(12.0).reshape(4, 3), -np.arange(12.0).reshape(4, 3))
    found = study_schema.first_seconds(imu, 0.35)
    assert found.time.tolist() == [2.0, 2.1, 2.2, 2.35]
    assert found.dtheta[-1].tolist() == [6.0, 7.0, 8.0]
    assert found.dvel[-1].tolist() == [-6.0, -7.0, -8.0]


def test_headings_compared_with_the_truth(monkeypatch: pytest.MonkeyPatch) -> None:
    """A truth of 3 quarter turns over 8 samples; every second sample, six edges apart by errors that are given."""
    time = 3.0 + 0.1 * np.arange(9)
    true = np.radians(30.0 + 270.0 / 8.0 * np.arange(9.0))
    imu = ImuData(time, np.ones((8, 3)), np.full((8, 3), 2.0))
    half = 0.5 * true
    q = np.stack([np.cos(half), 0.0 * half, 0.0 * half, np.sin(half)], axis=1)
    trajectory = SimpleNamespace(state=lambda t: SimpleNamespace(q_nb=q))
    errors = {
        FORMS[0]: np.array([0.0, 0.2, -0.4, 0.1, 0.25]) / 60.0 * DEG,  # of five edges one beyond 0.3′
        FORMS[1]: np.radians([0.0, 0.0, 180.0, 180.0, 360.0]),
        FORMS[2]: np.radians([0.0, 0.0, -360.0, -360.0, -360.0]),
        FORMS[3]: np.radians([0.0, 0.0, 0.0, 0.0, -2.0]),
    }
    seen: list[ImuData] = []

    def given(trajectory: Any, imu: ImuData, truth: Array) -> dict[str, Array]:
        seen.append(imu)
        return {form: truth + error for form, error in errors.items()}

    monkeypatch.setattr(attitude_claims, "headings", given)
    found = {one.form: one for one in compare_headings("p", "m", trajectory, imu, {5.0: 2})}  # type: ignore[arg-type]
    assert seen[0].dtheta.tolist() == [[2.0] * 3] * 4
    assert seen[0].dvel.tolist() == [[4.0] * 3] * 4
    assert seen[0].time == pytest.approx(time[::2])
    one = found[FORMS[0]]
    assert (one.part, one.motion, one.rate_hz) == ("p", "m", 5.0)
    assert one.turns == pytest.approx(0.75)
    assert (one.max_error_arcsec, one.final_error_arcsec) == pytest.approx((24.0, 15.0))
    assert one.wrong == pytest.approx(0.2)
    assert one.time == pytest.approx(time[::2])
    assert one.truth == pytest.approx(true[::2])
    assert one.heading == pytest.approx(true[::2] + errors[FORMS[0]])
    assert [found[form].jumps for form in FORMS] == [0, 2, 1, 0]
    assert found[FORMS[1]].max_error_arcsec == pytest.approx(180.0 * 3600.0)
    assert found[FORMS[2]].max_error_arcsec == pytest.approx(0.0, abs=1e-6)  # 390° is 30°
    assert found[FORMS[3]].final_error_arcsec == pytest.approx(-7200.0)
    assert [found[form].least_hz > 0.0 for form in FORMS] == [False, False, False, True]


def test_the_lowest_rate_that_counts_turns() -> None:
    """A turn by 30° in each sample is counted from every fifth sample, 150°, and not from every sixth, half a turn.

    It begins at rest, four turns wound up. One sample of 100° leaves every third, 160°; two of 170° leave all alone.
    """
    steps = np.concatenate([np.zeros(20), np.full(180, 30.0)])
    turning = np.radians(1500.0 - np.cumsum(steps))
    assert attitude_claims._least_rate(turning, 40.0) == pytest.approx(8.0)
    steps[100] = 100.0
    assert attitude_claims._least_rate(np.radians(np.cumsum(steps)), 40.0) == pytest.approx(40.0 / 3.0)
    steps[100:102] = 170.0
    assert attitude_claims._least_rate(np.radians(np.cumsum(steps)), 40.0) == pytest.approx(40.0)
    assert attitude_claims._least_rate(np.radians(np.arange(9.0)), 40.0) == pytest.approx(
        8.0
    )  # of 9 samples 2 are left


def test_errors_in_coordinates() -> None:
    """A difference in metres, an angle within half a turn, and of quaternions the angle between them."""
    true = np.array([[5.0, 3.1, 1.0], [7.0, -3.0, 2.0]])
    computed = np.array([[4.5, -3.1, 1.25], [9.0, 3.0, 2.0]])
    found = dict(_errors(("x_e_m", "heading_rad", "z_rad"), true, computed))
    assert found["x_e_m"] == pytest.approx([-0.5, 2.0])
    assert found["heading_rad"] == pytest.approx([2.0 * math.pi - 6.2, 6.0 - 2.0 * math.pi])
    assert found["z_rad"] == pytest.approx([0.25, 0.0], abs=1e-12)
    one = np.array([[1.0, 0.0, 0.0, 0.0]])
    other = np.array([[math.cos(0.15), 0.0, math.sin(0.15), 0.0]])
    assert dict(_errors(("q0", "q1", "q2", "q3"), one, other))["attitude_rad"] == pytest.approx([0.3])


def test_an_order_with_its_uncertainty() -> None:
    """Of the four highest rates; slope and standard error of a line by numpy's covariance."""
    rates, errors = [10.0, 20.0, 40.0, 80.0, 160.0], [900.0, 300.0, 80.0, 21.0, 4.5]
    rows = [row("a", rate, error) for rate, error in zip(rates, errors, strict=True)]
    found = [one for one in fit_orders([*rows, *(row("best", rate, 1e-9) for rate in rates)]) if one.algorithm == "a"]
    (order,) = found
    x, y = -np.log(rates[1:]), np.log(errors[1:])
    (slope, _), covariance = np.polyfit(x, y, 1, cov=True)
    assert (order.order, order.uncertainty) == pytest.approx((slope, math.sqrt(covariance[0, 0])), rel=1e-9)
    assert (order.points, order.low_hz, order.high_hz, order.part, order.motion) == (4, 20.0, 160.0, "p", "m")
    assert order.quantity == "max_attitude_error_arcsec"


def test_an_error_near_the_best_algorithms_does_not_count() -> None:
    """The best has 0.1″: 2.9″ is below thirty times of it, and 3.1″ above."""
    for last, high in ((2.9, 80.0), (3.1, 160.0)):
        errors = zip([10.0, 20.0, 40.0, 80.0, 160.0], [800.0, 200.0, 50.0, 12.5, last], strict=True)
        rows = [row("a", rate, error) for rate, error in errors]
        (order,) = (one for one in fit_orders([*rows, row("best", 160.0, 0.1)]) if one.algorithm == "a")
        assert order.high_hz == high


def test_names_of_rows() -> None:
    rows = [row("a", 20.0, 1.0), row("b", 20.0, 1.0), row("a", 90.0, 1.0, frame="wander"), row("a", 400.0, 1.0)]
    assert varying(rows) == ("algorithm", "frame")
    assert [labeller(rows)(one) for one in rows] == ["a · level", "b · level", "a · wander", "a · level"]
    assert labeller(rows, pace=True)(rows[2]) == "a · wander · 90 Hz"
    assert labeller(rows[:1], pace=True)(rows[0]) == "a"
    assert at_one_rate(rows) == [rows[2]]  # 90 Hz is nearer to 50 Hz than 20 Hz, in ratio
    part = {"title": "p", "motions": [MOTION], "rates_hz": [40.0, 20.0, 10.0]}
    assert over_rates(Part.model_validate(part))
    assert not over_rates(Part.model_validate({**part, "rates_hz": [40.0, 20.0]}))
    scheduled = Part.model_validate({**part, "schedules_hz": [[40.0, 20.0, 10.0]]})
    assert not over_rates(scheduled)
    planned = row("a", 40.0, 1.0, schedule_hz=(40.0, 20.0, 10.0), slow="extrapolate")
    assert planned.pace == "40/20/10 extrapolate"
    assert line_labeller(scheduled, [planned, rows[1]])(planned) == "a · 40/20/10 extrapolate Hz"
    assert at_one_rate([rows[0], planned]) == [planned]
    pick = Pick("p", "tactical", "rate-gyros", "a", "")
    assert pick.block == "tactical"
    assert Pick("p", "tactical", "attitude-sensor", "a", "").block == "tactical, attitude-sensor"


def test_costs_by_a_clock_of_its_own() -> None:
    """Ten calls, of which the quickest takes 3 ms; 24 000 samples."""
    ticks = iter([t for k in range(10) for t in (float(k), k + (0.003 if k == 6 else 0.009))])
    assert least_time(lambda: None, lambda: next(ticks)) == pytest.approx(3e6, rel=1e-9)
    again = iter([t for k in range(10) for t in (float(k), k + 0.048)])
    assert measure_time("quaternion", "level", lambda: next(again)) == pytest.approx(2000.0, rel=1e-9)
    none = Operations(0.0, 0.0, 0.0, 0.0, 0.0)
    assert Cost("a", "level", 1.0, none).pace == "every sample"
    assert Cost("a", "level", 1.0, none, (200.0, 50.0, 12.5)).pace == "200/50/12.5"
    assert step_cost._ratios((200.0, 50.0, 12.5)) == (4, 4)
    assert step_cost._options((4, 2)) == {"rates_hz": (100.0, 25.0, 12.5)}
    assert Operations(1.0, 2.0, 4.0, 8.0, 0.5).total == 27.0


def test_how_long_a_study_takes() -> None:
    """Two algorithms at 20 Hz and 40 Hz on 100 s with 2 gravity models: 100 (20 + 40)(50 + 70) ns · 2."""
    part = Part.model_validate({
        "title": "p", "motions": [MOTION], "rates_hz": [40.0, 20.0], "gravities": ["normal", "order-1e-2"],
        "algorithms": ["quaternion", "euler"],
    })  # fmt: skip
    none = Operations(0.0, 0.0, 0.0, 0.0, 0.0)
    costs = {(name, "level", ()): Cost(name, "level", ns, none) for name, ns in (("quaternion", 5e4), ("euler", 7e4))}
    assert part.cases == 8
    samples = 100.0 * 40.0 * 1.5e-6
    for vibration, factor in ((), 1.5), ([{"coordinate": "roll", "rms_arcsec": 1.0, "low_hz": 2.0}], 41.5):
        motion = StudyMotion.model_validate({**MOTION, "vibration": vibration})
        for threads in (1, 2):
            found = _seconds(part, motion, 100.0, costs, threads)
            assert found == pytest.approx((1440e-3 + 0.03 * 8) / threads + samples * factor, rel=1e-9)
    assert [duration_text(s) for s in (1.2, 89.4, 90.0, 5399.0, 5400.0, 9000.0)] == [
        "1 s", "89 s", "2 min", "90 min", "1.5 h", "2.5 h",
    ]  # fmt: skip


def test_what_a_result_finds_again() -> None:
    study = Study.model_validate({"name": "s", "parts": [{"title": "p", "motions": [MOTION], "rates_hz": [10.0]}]})
    rows = [row("a", 20.0, 1.0), row("b", 20.0, 1.0, part="q")]
    course = ErrorGrowth(np.zeros(1), np.zeros(1), np.zeros(1))
    result = StudyResult(study, rows=rows, histories={rows[0].case: course}, media=StudyMedia())
    assert isinstance(rows[0].case, Case)
    assert result.history(rows[0]) is course
    assert result.history_or_none(rows[1]) is None
    assert result.of_part("q") == [rows[1]]
    said = Verdict("gyro-term", "s", "partly", "Because:", ("a.", "b"), judged=("confirmed", ""))
    assert said.lines == (("a.", "confirmed"), ("b", ""))
    assert said.text == "Because: a.; b."
    assert Verdict("gyro-term", "s", "partly", "Because.").text == "Because."
