"""A filter in summary.json and in words, from an estimate, readings and faults that are chosen."""

from __future__ import annotations

from math import pi, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import Measurements
from sinssim.estimation import consistency
from sinssim.estimation import consistency as against_truth
from sinssim.estimation.consistency import ChiSquare
from sinssim.estimation.filter_result import Innovations, Reasons
from sinssim.experiments.run import filter_summary
from sinssim.experiments.run.filter_exhibits import filter_exhibits
from sinssim.experiments.run.filter_summary import (
    _alignment_sentence,
    filter_numbers,
    for_people,
    sentences,
    unused_sentences,
)
from sinssim.recording.rerun_exhibits import markdown_of
from sinssim.scenario import Scenario
from sinssim.strapdown.navigation_error import NavError
from tests.experiments.run.test_filter_streams import MODEL
from tests.recording.made_filter import aided as aided_of_recording
from tests.recording.test_motion_streams import rows
from tests.recording.test_summary import ERROR, NUMBERS

MINUTE = pi / 10_800.0
PARTS = (
    ("position", 3),
    ("velocity", 3),
    ("attitude", 3),
    ("gyro bias", 3),
    ("gnss time offset", 1),
    ("baro scale", 1),
)
OWN = {"gyro bias": rows(50.0, 3, 4), "gnss time offset": rows(60.0, 1, 4), "baro scale": rows(65.0, 1, 4)}


def innovations(sensor: str, time: np.ndarray, accepted: list[bool], told: dict[int, str]) -> Innovations:
    nis = np.where([told.get(k, "nis") == "nis" for k in range(len(time))], 0.5 + np.arange(len(time)), np.nan)
    value = np.zeros((len(time), 1))
    return Innovations(
        sensor, "baro-height", time, value, value + 4.0, nis, np.array(accepted), Reasons(len(time), told), 9.0, 8.5
    )


def aided(known: bool = True, **parts: Any) -> SimpleNamespace:
    """Return a filter of four epochs, 5, 6, 8 and 9 s, with seven readings at sensor b-o, two before its start."""
    own = innovations(
        "b-o", np.array([5.0, 6.0, 7.0, 8.0, 9.0]), [True, False, False, True, False],
        {1: "nis", 2: "the sensor was off", 4: ""},
    )  # fmt: skip
    sigma = np.array([8.0, 6.0, 3.0, 2.0])[:, None] * np.arange(1.0, 15.0)
    sigma[:, 13] = [0.0, 0.0, 0.0, 0.0]
    sigma[:, 5] = [3.0, 3.0, 3.0, 1.6]  # not halved
    estimate = SimpleNamespace(
        time=ERROR.time, model=MODEL, sigma=sigma, parameters=OWN, divergence=None, remarks=("A remark.",),
        innovations=(own,), smoothed=None, backward=None, history=None, diagnosis=None,
    )  # fmt: skip
    estimate.__dict__.update(parts)
    baro = Measurements(
        "baro-height", np.arange(3.0, 10.0), np.arange(3.0, 10.0), rows(7.0, 1, 7), rows(1.0, 1, 7), name="b-o"
    )
    errors = np.arange(14.0) - 20.0
    return SimpleNamespace(
        estimate=estimate, end=30.0, true_parameters_known=known, smoothed_error=None, backward_error=None,
        sensed=(SimpleNamespace(measurements=baro),), error_at=ERROR.at, error_blocks=lambda: iter([ERROR]),
        block_error=lambda name, part: ERROR.attitude[part], state_errors_at=lambda part: np.tile(errors, (4, 1))[part],
        nominal_errors=None,
    )  # fmt: skip


def scenario(**tables: Any) -> Scenario:
    own = {"name": "x", "parked": {"latitude_deg": 50.0, "duration_s": 30.0}, "imu": {"grade": "tactical"},
           "aiding": {"gnss": {}}, "filter": {}}  # fmt: skip
    return Scenario.model_validate({**own, **tables})


TEST = ChiSquare("NIS", 1.23, 0.77, 1.41, 0.02)


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge the innovations of b-o and the errors as chosen here."""
    sensor = SimpleNamespace(sensor="b-o", rejected=11, expected=0.07, tests=(TEST,), verdict="optimistic")
    found = SimpleNamespace(sensors=(sensor,), consistent=False, sentences=("One.",))
    monkeypatch.setattr(consistency, "consistency", lambda estimate: found)
    one, two = (TEST, "optimistic"), (ChiSquare("n", 0.9, 0.8, 1.2, 0.6), "consistent")
    actual = against_truth.ActualConsistency({"all states": one, "gyro bias": two}, {"gyro noise": two}, ("Two.",))
    monkeypatch.setattr(filter_summary, "_actual", lambda aided: actual)
    monkeypatch.setattr(filter_summary, "diagnosis_numbers", lambda estimate, scenario: "d")
    monkeypatch.setattr(filter_summary, "hints", lambda scenario: ["A hint."])


CHI = {"value": 1.23, "lower_95": 0.77, "upper_95": 1.41, "probability": 0.02}


@pytest.mark.usefixtures("judged")
def test_the_whole_entry() -> None:
    """Of b-o's seven readings two precede the filter, two are used, one is rejected, one has its own reason, one is
    never reached."""
    smoothed = NavError(*(2.0 * part for part in (ERROR.time, ERROR.position_ned, ERROR.velocity_ned, ERROR.attitude)))
    end = SimpleNamespace(time=9.0, measurement="b-o 3", reason="why")
    own = aided(divergence=end)
    own.smoothed_error, own.backward_error = smoothed, ERROR
    found = filter_numbers(own, scenario())
    assert found.pop("divergence") == {"time_s": 9.0, "measurement": "b-o 3", "reason": "why"}
    assert found.pop("remarks") == ["A remark."]
    assert (found.pop("consistent"), found.pop("findings"), found.pop("hints")) == (
        False,
        ["One.", "Two."],
        ["A hint."],
    )
    assert found.pop("aided") == found.pop("backward") == pytest.approx(NUMBERS)
    assert found.pop("smoothed") == pytest.approx({name: 2.0 * value for name, value in NUMBERS.items()})
    assert found.pop("diagnosis") == "d"
    assert found.pop("sensors") == {
        "b-o": {
            "kind": "baro-height", "readings": 7, "taken": 2,
            "unused": {"before the start of the filter": 2, "rejected by the gate": 1, "the sensor was off": 1,
                       "after the end of the filter": 1},
            "refused": 11, "refused_expected": 0.07, "withdrawn_s": 8.5, "first_refused_s": 6.0,
            "verdict": "optimistic", "tests": {"NIS": CHI}, "detection": None,
        }
    }  # fmt: skip
    assert found.pop("faults") == found.pop("detections") == []
    second = {"value": 0.9, "lower_95": 0.8, "upper_95": 1.2, "probability": 0.6}
    assert found.pop("nees") == {
        "all states": {"states": 13, "verdict": "optimistic", **CHI},  # one is known exactly
        "gyro bias": {"states": 3, "verdict": "consistent", **second},
    }
    assert found.pop("noise") == {"gyro noise": {"verdict": "consistent", **second}}
    states = found.pop("states")
    assert found == {}
    names = ["position_n_m", "position_e_m", "position_d_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
             "phi_n_rad", "phi_e_rad", "phi_d_rad", "gyro_bias_x_radps", "gyro_bias_y_radps", "gyro_bias_z_radps",
             "gnss_time_offset_s", "baro_scale"]  # fmt: skip
    assert list(states) == names
    for k, name in enumerate(names):
        begin, last = {5: (3.0, 1.6), 13: (0.0, 0.0)}.get(k, (8.0 * (k + 1), 2.0 * (k + 1)))
        assert states[name] == {
            "sigma_start": begin, "sigma_end": last, "error_end": k - 20.0, "reduction": begin / last if last else None,
        }, name  # fmt: skip


@pytest.mark.usefixtures("judged")
def test_recorded_sensors_have_estimates_in_place_of_errors() -> None:
    found = filter_numbers(aided(known=False), scenario())
    assert found["recorded"] is True
    assert found["hints"] == []
    assert found["aided"] == pytest.approx(NUMBERS)
    assert "alignment" not in found
    ends = [state["estimate_end"] for state in found["states"].values()]
    assert np.isnan(ends[:9]).all()
    assert ends[9:] == [53.01, 53.02, 53.03, 63.01, 68.01]  # of the last epoch


def test_a_state_is_observable_if_it_is_seen_and_at_least_halved(monkeypatch: pytest.MonkeyPatch) -> None:
    from sinssim.estimation import consistency as observability

    seen = SimpleNamespace(observable=np.array([True, False] + [True] * 12))
    monkeypatch.setattr(observability, "observability", lambda model, history: seen)
    states = dict(filter_summary._state_numbers(aided(history="h")))
    shown = {name: state["observable"] for name, state in states.items()}
    assert [name for name, observable in shown.items() if not observable] == ["position_e_m", "velocity_d_mps"]


@pytest.mark.usefixtures("judged")
def test_an_alignment_by_a_master_and_one_before_the_filter() -> None:
    """φ_down is −2″, 12″, 3″ and 4″; its σ is 9 × 8, 6, 3 and 2 rad. A master ends at 8 s; alignment_s has no end."""
    arcsec = 1.0 / 60.0

    def row(time: float, sigma: float, error: float) -> dict[str, Any]:
        wanted = {"time_s": time, "heading_sigma_arcmin": sigma / MINUTE, "heading_error_arcmin": error * arcsec}
        return pytest.approx(wanted, rel=1e-12)

    masters = (innovations("master-velocity", np.array([5.0, 6.0]), [True] * 2, {}),
               innovations("master-attitude", np.array([6.0, 8.0]), [True] * 2, {}))  # fmt: skip
    sensors = {
        "sensors": [
            SimpleNamespace(sensor=i.sensor, rejected=0, expected=0.0, tests=(), verdict="unknown") for i in masters
        ]
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(consistency, "consistency", lambda e: SimpleNamespace(consistent=True, sentences=(), **sensors))
        found = filter_numbers(aided(innovations=masters), scenario())["alignment"]
    assert (found["method"], found["coarse_s"]) == ("transfer", None)
    assert found["begin"] == row(5.0, 72.0, -2.0)
    assert found["end"] == row(8.0, 27.0, 3.0)
    own = filter_numbers(aided(), scenario(filter={"alignment_s": 4.0}))["alignment"]
    assert (own["coarse_s"], own["begin"], own["end"]) == (4.0, row(5.0, 72.0, -2.0), row(9.0, 18.0, 4.0))


@pytest.mark.parametrize(
    ("method", "coarse", "expected"),
    [
        ("transfer", None, "Aligned by the master system: the heading error was 1.5 deg (1σ 2 deg) at the start and "
                           "3 arcsec (1σ 30 arcsec) at 90 s."),
        ("in-motion", 40.0, "Aligned in motion during the first 40 s: the filter started at 40 s with a heading error "
                            "of 1.5 deg (1σ 2 deg); the error was 3 arcsec (1σ 30 arcsec) at 90 s."),
        ("by-course", 40.0, "Aligned by the course, within the first 40 s: the filter started at 40 s with a heading "
                            "error of 1.5 deg (1σ 2 deg); the error was 3 arcsec (1σ 30 arcsec) at 90 s."),
        ("at-rest", 40.0, "Aligned at rest during the first 40 s: the filter started at 40 s with a heading error of "
                          "1.5 deg (1σ 2 deg); the error was 3 arcsec (1σ 30 arcsec) at 90 s."),
    ],
)  # fmt: skip
def test_an_alignment_in_words(method: str, coarse: float | None, expected: str) -> None:
    """The unit is that of the σ: degrees from 60′ on, seconds of arc below 1′."""
    begin = {"time_s": 40.0, "heading_sigma_arcmin": 120.0, "heading_error_arcmin": -90.0}
    end = {"time_s": 90.0, "heading_sigma_arcmin": 0.5, "heading_error_arcmin": 0.05}
    told = _alignment_sentence({"method": method, "coarse_s": coarse, "begin": begin, "end": end})
    assert told == expected
    exact = {"time_s": 40.0, "heading_sigma_arcmin": 1.0, "heading_error_arcmin": 2.5}
    middle = _alignment_sentence({"method": method, "coarse_s": coarse, "begin": begin, "end": exact})
    assert "2.5 arcmin (1σ 1 arcmin) at 40 s" in middle
    at = {**exact, "heading_sigma_arcmin": 60.0, "heading_error_arcmin": 30.0}
    assert "0.5 deg (1σ 1 deg) at 40 s" in _alignment_sentence(
        {"method": method, "coarse_s": coarse, "begin": begin, "end": at}
    )


def faulty() -> tuple[SimpleNamespace, Scenario]:
    """Return a filter at 10, 11, … 300 s. Positions are rejected from 100 to 139 s but for 104 s, and from 200 s on;
    velocities from 90 to 94 s and from 203 to 205 s."""
    time = np.arange(10.0, 301.0)
    position = ~((time >= 100.0) & (time < 140.0) & (time != 104.0)) & ~(time >= 200.0)
    velocity = ~((time >= 90.0) & (time < 95.0)) & ~((time >= 203.0) & (time <= 205.0))
    fixes = (innovations("gnss-position", time, position.tolist(), {}),
             innovations("gnss-velocity", time, velocity.tolist(), {}),
             innovations("baro", time, [False] * len(time), {}))  # fmt: skip
    fixes[0].nis[5] = np.nan  # a reading at 15 s that was not compared
    zero = np.zeros((len(time), 3))
    error = NavError(time, np.column_stack((3.0 * time, 4.0 * time, time)), zero, zero)
    own = SimpleNamespace(
        estimate=SimpleNamespace(time=time, innovations=fixes), error_at=error.at, end=300.0,
    )  # fmt: skip
    jumps = [
        {"from_s": 90.5, "to_s": 180.0, "north_m": 2.0, "east_m": -3.0, "up_m": 6.0},
        {"from_s": 13.0, "to_s": 16.0, "up_m": 5.0},
        {"from_s": 300.0, "up_m": 5.0},
    ]
    ramps = [{"from_s": 195.0, "north_mps": 0.2, "east_mps": 0.3, "up_mps": -0.6}]
    return own, scenario(aiding={"gnss": {"jumps": jumps, "ramps": ramps}})


def test_jumps_and_ramps() -> None:
    """A jump shows in positions, a ramp in velocities too; a fault at the end of the run does nothing."""
    jump, small, ramp = filter_summary._faults(*faulty())
    assert jump == {
        "kind": "jump", "from_s": 90.5, "to_s": 180.0, "readings": 90, "refused": 39, "first_refused_s": 100.0,
        "believed_again_s": 140.0, "forged_then_m": 7.0, "caught": False, "max_horizontal_error_m": 900.0,
    }  # fmt: skip
    assert small == {
        "kind": "jump", "from_s": 13.0, "to_s": 16.0, "readings": 3, "refused": 0, "first_refused_s": None,
        "believed_again_s": None, "forged_then_m": None, "caught": False, "max_horizontal_error_m": 80.0,
    }  # fmt: skip
    assert ramp == {
        "kind": "ramp", "from_s": 195.0, "to_s": 300.0, "readings": 212, "refused": 104, "first_refused_s": 200.0,
        "believed_again_s": None, "forged_then_m": None, "caught": False, "max_horizontal_error_m": 1500.0,
    }  # fmt: skip


def numbers(**parts: Any) -> dict[str, Any]:
    sensor = {"verdict": "consistent", "taken": 7, "unused": {}, "readings": 9, "refused": 2, "withdrawn_s": None,
              "tests": {}}  # fmt: skip
    own: dict[str, Any] = {
        "divergence": None, "faults": [], "detections": [], "consistent": True, "sensors": {"gnss": sensor},
        "remarks": [], "hints": [], "nees": {}, "noise": {}, "states": {}, "findings": [],
    }  # fmt: skip
    return {**own, **parts}


FAULT = {
    "kind": "jump", "from_s": 40.0, "to_s": 75.0, "readings": 36, "refused": 33, "first_refused_s": 43.0,
    "believed_again_s": None, "forged_then_m": None, "caught": True, "max_horizontal_error_m": 12.345,
}  # fmt: skip


def test_faults_in_words() -> None:
    lost = {**FAULT, "caught": False, "refused": 2, "max_horizontal_error_m": None}
    found = list(sentences(numbers(faults=[FAULT, lost])))
    assert found[:2] == [
        "The GNSS jump from 40 s to 75 s was detected by the gate: it rejected 33 of 36 measurements, the first 3 s "
        "after its start, and the error of the solution reached 12.3 m.",
        "The GNSS jump from 40 s to 75 s was not detected by the gate: it rejected 2 of 36 measurements, and the "
        "innovations do not show it.",
    ]
    odd = numbers(faults=[lost])
    odd["sensors"]["gnss"] = {**odd["sensors"]["gnss"], "verdict": "coloured"}
    assert next(sentences(odd)).endswith("2 of 36 measurements, but the tests of the innovations fail.")


def test_a_filter_in_words() -> None:
    right = "The filter is consistent: its innovations and its errors agree with its covariance."
    assert list(sentences(numbers(remarks=["One.", "Two."]))) == [right, "One.", "Two."]
    end = {"time_s": 12.34, "measurement": "gnss 7", "reason": "it was lost"}
    assert next(sentences(numbers(divergence=end))) == "The filter diverged at 12.3 s at gnss 7: it was lost."
    assert (
        next(sentences(numbers(divergence={**end, "measurement": ""}))) == "The filter diverged at 12.3 s: it was lost."
    )
    assert (
        next(sentences(numbers(recorded=True)))
        == "The filter is consistent: its innovations agree with its covariance."
    )
    none = numbers()
    none["sensors"]["gnss"] = {**none["sensors"]["gnss"], "taken": 0}
    assert next(sentences(none)) == "The filter used no measurement; its errors agree with its covariance."
    sensors = {
        name: {"verdict": verdict, "taken": 1, "unused": {}, "readings": 1}
        for name, verdict in (("a", "pessimistic"), ("b", "optimistic"), ("c", "optimistic"), ("d", "outliers"),
                              ("e", "coloured"), ("f", "consistent"), ("g", "unknown"))
    }  # fmt: skip
    wrong, good = {"verdict": "optimistic"}, {"verdict": "consistent"}
    bad = numbers(
        consistent=False, sensors=sensors, nees={"gyro bias": wrong, "position": good},
        noise={"gyro noise": good, "accelerometer noise": {"verdict": "pessimistic"}},
    )  # fmt: skip
    words = (
        "filter is not consistent: optimistic (the noise is larger than assumed) by b, c; pessimistic (the noise is "
        "smaller than assumed) by a; outliers (single measurements have large errors, and the others have smaller "
        "errors than assumed) by d; coloured (innovations that are not white) by e; errors larger than the covariance "
        "of gyro bias; wrong assumed variance of accelerometer noise."
    )
    chance = "A correct filter fails any of these tests in at most 1 % of runs."
    assert list(sentences(bad)) == [f"The {words}", chance]
    told = {**bad, "hints": ["A hint."], "diagnosis": {"what_to_try": ["Try."]}, "remarks": ["R."]}
    assert list(sentences(told)) == ["A hint.", f"Therefore the {words}", chance, "Try.", "R."]
    assert next(sentences(numbers(consistent=False))) == "The filter is not consistent."


def test_readings_outside_the_time_of_the_filter_in_words() -> None:
    sensors = {
        "a": {"readings": 20, "unused": {"before the start of the filter": 3, "rejected by the gate": 5}},
        "b": {"readings": 40, "unused": {"before the start of the filter": 7, "after the end of the filter": 9}},
    }
    assert list(unused_sentences(sensors)) == [
        "Measurements before the start of the filter, which are not used: 3 of 20 of a, 7 of 40 of b.",
        "Measurements after the end of the filter, which are not used: 9 of 40 of b.",
    ]


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        ("position_d_m", 3.0, ("position d", "m", 3.0)),
        ("velocity_e_mps", 3.0, ("velocity e", "m/s", 3.0)),
        ("phi_n_rad", 3.0 * MINUTE, ("phi n", "arcmin", 3.0)),
        ("gyro_bias_x_radps", 3.0 * MINUTE / 3600.0, ("gyro bias x", "deg/h", 0.05)),
        ("accelerometer_bias_y_mps2", 3.0 * 9.80665e-6, ("accelerometer bias y", "µg", 3.0)),
        ("gyro_misalignment_zy_rad", 3.0 * MINUTE, ("gyro misalignment zy", "arcsec", 180.0)),
        ("baro_scale", 3e-6, ("baro scale", "ppm", 3.0)),
        ("gnss_time_offset_s", 0.003, ("gnss time offset", "s", 0.003)),
        ("gnss_velocity_delay_s", -0.2, ("gnss velocity delay", "s", -0.2)),
        ("land_vehicle_slip_rad_per_mps2", 3.0 * MINUTE, ("land vehicle slip", "deg/g", 0.05 * 9.80665)),
    ],
)
def test_states_for_people(column: str, value: float, expected: tuple[str, str, float]) -> None:
    stem, unit, (first, none) = for_people(column, value, None)
    assert (stem, unit) == expected[:2]
    assert first == pytest.approx(expected[2], rel=1e-12)
    assert np.isnan(none)


def test_the_panel_of_a_filter() -> None:
    state = {
        "sigma_start": 3.0 * MINUTE,
        "sigma_end": 0.25 * MINUTE,
        "error_end": -0.5 * MINUTE,
        "estimate_end": 7.0 * MINUTE,
        "reduction": 12.0,
        "observable": True,
    }
    sensor = {
        "verdict": "optimistic",
        "taken": 7,
        "refused": 2,
        "refused_expected": 0.125,
        "unused": {},
        "readings": 9,
        "tests": {"NIS": CHI},
    }
    own = numbers(
        sensors={"gnss": sensor, "baro": {**sensor, "tests": {}, "verdict": "unknown", "taken": 4, "refused": 3}},
        nees={"all states": {**CHI, "states": 9}},
        noise={"gyro noise": {"value": 0.9, "lower_95": 0.8, "upper_95": 1.25}},
        aided=None,
        states={"phi_n_rad": state, "phi_e_rad": {**state, "observable": False}}, findings=["Found."], remarks=["R."],
    )  # fmt: skip
    found = panel(own)
    right = "The filter is consistent: its innovations and its errors agree with its covariance."
    assert found[0] == f"**{right}**"
    assert "R." in found
    assert found[-1] == "- Found."
    rows = [line for line in found if line.startswith("| ") and not line.startswith("| **")]
    assert rows[0] == (
        "| sensor | verdict | accepted | rejected (expected) | NIS | whiteness | sums of 16 | of 64 | of 256 |"
    )
    assert rows[1].startswith("| gnss | optimistic | 7 | 2 (0.12) | 1.23 (0.770 … 1.41) | – |")
    assert rows[2].startswith("| baro | unknown | 4 | 3 (0.12) | – | – |")
    assert rows[3:7] == [
        "| states | number | NEES per state |", "| all states | 9 | 1.23 (0.770 … 1.41) |",
        "| noise | variance / assumed variance |", "| gyro noise | 0.900 (0.800 … 1.25) |",
    ]  # fmt: skip
    assert rows[7:] == [
        "| state | σ, start | σ, end | error, end | σ reduced by |",
        "| phi n [arcmin] | 3.00 | 0.250 | −0.500 | **12.0 ×** |",
        "| phi e [arcmin] | 3.00 | 0.250 | −0.500 | 12.0 × |",
    ]  # fmt: skip
    recorded = panel({**own, "recorded": True, "nees": {}, "noise": {}})
    assert "| state | σ, start | σ, end | estimate, end | σ reduced by |" in recorded
    assert "| phi n [arcmin] | 3.00 | 0.250 | 7.00 | **12.0 ×** |" in recorded
    assert not any("NEES" in line or "assumed variance" in line for line in recorded)


def panel(of: Any) -> list[str]:
    """Return the lines that the panel of a recording has of a filter."""
    return markdown_of(list(filter_exhibits(aided_of_recording(), of, {}, (20.0, 420.0)))).splitlines()


def test_a_ramp_grows_from_its_start() -> None:
    _, faults = faulty()
    gnss = faults.aiding.sensors()["gnss"]
    assert filter_summary._forged(gnss.ramps[0], 205.0) == pytest.approx(7.0)  # √(0.04 + 0.09 + 0.36) × 10 s
    assert filter_summary._forged(gnss.jumps[0], 205.0) == pytest.approx(sqrt(4.0 + 9.0 + 36.0))
