"""The whole entry of a diagnosis and its whole sentences, from hypotheses that are chosen."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, nan, pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.estimation.filter_result import Diagnosis, Hypothesis, Refusals
from sinssim.experiments.run import filter_remedies
from sinssim.experiments.run.filter_remedies import (
    _explained,
    _refused,
    cause_and_remedy,
    diagnosis_numbers,
    planted,
    short,
    wide,
)
from sinssim.scenario.schema import Scenario

DEG, MINUTE, SECOND, MICRO_G = pi / 180.0, pi / 10_800.0, pi / 648_000.0, 9.80665e-6


@pytest.fixture
def log(tmp_path: Path) -> Scenario:
    """A run on recorded sensors with a barometer in km and a compass, both with errors."""
    file = str(tmp_path / "x.csv")
    gnss = {"file": file, "lever_arm_m": [2.5, 0.25, -1.0], "time_offset_s": 0.5, "velocity_delay_s": 0.125,
            "sigma_factor": 2.0, "velocity_sigma_factor": 3.0}  # fmt: skip
    kilometre = {"value": 0.02, "unit": "km"}
    baro = {"file": file, "name": "baro", "kind": "baro-height", "reading": {"column": "h", "unit": "m"},
            "sigma": kilometre, "bias_sigma": kilometre}  # fmt: skip
    degrees = {"value": 4.0, "unit": "deg"}
    compass = {"file": file, "name": "compass", "kind": "heading", "reading": {"column": "c", "unit": "deg"},
               "sigma": {"column": "s", "unit": "deg"}, "bias_sigma": degrees}  # fmt: skip
    tables = {"imu": {"file": file}, "gnss": gnss, "others": [baro, compass], "start": {"heading_deg": 310.0}}
    filter_ = {"states": ["gyro bias"], "inertial_noise_factor": 1.5, "measurement_noise_factor": 2.5}
    return Scenario.model_validate({"name": "x", "log": tables, "imu": {"grade": "tactical"}, "filter": filter_})


@pytest.fixture
def simulated() -> Scenario:
    return Scenario.model_validate(
        {"name": "x", "parked": {"latitude_deg": 50.0, "duration_s": 60.0}, "imu": {"grade": "tactical"},
         "aiding": {"gnss": {}}, "filter": {"measurement_noise_factor": 0.5}}
    )  # fmt: skip


def cause(name: str, kind: Any, value: Sequence[float], sigma: Sequence[float] = (), gain: float = 55.5) -> Hypothesis:
    return Hypothesis(name, kind, tuple(value), tuple(sigma), gain, 14.2)


ESTIMATES = "log.gnss.{} = {}, with which the filter estimates it"


@pytest.mark.parametrize(
    ("own", "what", "keys"),
    [
        (cause("gnss lever arm", "state", (0.5, -2.0, 0.03), (0.1, 0.2, 0.04)),
         "the lever arm of the antenna has an error of [0.5 ± 0.1, -2 ± 0.2, 0.03 ± 0.04] m (forward, right, down)",
         "log.gnss.lever_arm_m = [3, -1.75, -1], or " + ESTIMATES.format("lever_arm_sigma_m", "6")),
        (cause("gnss time offset", "state", (-0.125,), (0.02,)),
         "the time stamps of the fixes are too early by 0.125 ± 0.02 s",
         "log.gnss.time_offset_s = 0.625, or " + ESTIMATES.format("time_offset_sigma_s", "0.38")),
        (cause("gnss-velocity delay", "state", (0.25,), (0.03,)),
         "the GNSS velocities are older than their time stamps by 0.25 ± 0.03 s",
         "log.gnss.velocity_delay_s = 0.375, or " + ESTIMATES.format("velocity_delay_sigma_s", "0.75")),
        (cause("gnss-velocity delay", "state", (-0.25,), (0.03,)),
         "the GNSS velocities are older than their time stamps by -0.25 ± 0.03 s",
         ESTIMATES.format("velocity_delay_sigma_s", "0.75")),
        (cause("inertial noise", "inertial noise", (4.0,)),
         "the noise of gyros and accelerometers is 4.00 times the assumed noise",
         "filter.inertial_noise_factor = 6, or for vibration filter.vibration_noise = 0.4"),
        (cause("gyro", "bias walk", (5.0 * DEG / 3600.0 / 60.0,)),
         "the biases of the gyros have a random walk of 5 °/h/√h", "imu.gyro_rrw_deg_h_sqrt_h = 5"),
        (cause("accelerometer", "bias walk", (7.0 * MICRO_G / 60.0,)),
         "the biases of the accelerometers have a random walk of 7 µg/√h", "imu.accel_rrw_ug_sqrt_h = 7"),
        (cause("baro", "bias walk", (4.0,)),  # τ = 2 (20/4)²
         "the error of baro has a random walk of 4 m/√s", "log.others.1.bias_correlation_time_s = 50"),
        (cause("compass", "bias walk", (0.5 * DEG,)),
         "the error of compass has a random walk of 0.5 deg/√s", "log.others.2.bias_correlation_time_s = 130"),
        (cause("radar", "bias walk", (4.0,)),
         "the error of radar has a random walk", "a correlation time of the state radar bias"),
        (cause("compass bias", "state", (-2.0 * DEG,), (0.25 * DEG,)),
         "the constant error of compass is -2 ± 0.25°", 'log.others.2.bias_sigma = { value = 6, unit = "deg" }'),
        (cause("baro scale", "state", (-250e-6,), (12e-6,)),
         "the scale factor error of baro is -250 ± 12 ppm", "log.others.1.scale_sigma_ppm = 750"),
        (cause("gyro bias", "state", (2.0 * DEG / 3600.0, -3.0 * DEG / 3600.0, 0.0), (0.1 * DEG / 3600.0,) * 3),
         "the bias of the gyros is [2 ± 0.1, -3 ± 0.1, 0 ± 0.1] °/h, which is much larger than the filter assumes",
         "a grade or keys of [imu] with a larger 1σ of this error"),
        (cause("accelerometer bias", "state", (3e3 * MICRO_G, 0.0, 1e3 * MICRO_G), (1e2 * MICRO_G,) * 3),
         "the bias of the accelerometers is [3 ± 0.1, 0 ± 0.1, 1 ± 0.1] mg; it is not a state of the filter",
         'filter.states = ["gyro bias", "accelerometer bias"]'),
        (cause("gyro misalignment", "state", (3.0 * MINUTE, -MINUTE), (0.5 * MINUTE,) * 2),
         "the misalignment of the gyros is [3 ± 0.5, -1 ± 0.5] arcmin; it is not a state of the filter",
         'filter.states = ["gyro bias", "gyro misalignment"]'),
        (cause("accelerometer scale", "state", (3e-3, -1e-3, 2e-3), (1e-4,) * 3),
         "the scale of the accelerometers is [3000 ± 100, -1000 ± 100, 2000 ± 100] ppm; it is not a state of the "
         "filter", 'filter.states = ["gyro bias", "accelerometer scale"]'),
        (cause("gnss-position, gnss-velocity", "measurement noise", (3.0, 0.25), (0.5, 0.03)),
         "the σ of gnss-position and gnss-velocity are 3.00 ± 0.50 and 0.250 ± 0.030 times the assumed values",
         "log.gnss.sigma_factor = 6 and log.gnss.velocity_sigma_factor = 0.75"),
        (cause("baro, compass", "measurement noise", (3.0, 5.0)),
         "the σ of baro and compass are 3.00 and 5.00 times the assumed values",
         'log.others.1.sigma = { value = 0.06, unit = "km" } and log.others.2.sigma = 5 times the present value'),
        (cause("initial heading", "initial state", (-4.0 * DEG,), (0.5 * DEG,)),
         "the initial heading has an error of -4 ± 0.5°, which is larger than the filter assumes",
         "a value of log.start.heading_deg other than 310.0, or filter.initial_sigma.heading_arcmin = 720"),
    ],
)  # fmt: skip
def test_a_cause_of_a_recorded_run(log: Scenario, own: Hypothesis, what: str, keys: str) -> None:
    assert cause_and_remedy(own, log) == (what, keys)


@pytest.mark.parametrize(
    ("own", "what", "keys"),
    [
        (cause("gnss time offset", "state", (0.25,), (0.02,)),
         "the time stamps of the fixes are too late by 0.25 ± 0.02 s",
         "aiding.gnss.time_offset_sigma_s = 0.75, with which the filter estimates it"),
        (cause("gnss-position, gnss-velocity", "measurement noise", (4.0, 9.0), (0.5, 0.5)),
         "the σ of gnss-position and gnss-velocity are 4.00 ± 0.50 and 9.00 ± 0.50 times the assumed values",
         "filter.measurement_noise_factor = 3"),  # half of √(4 × 9)
        (cause("gnss-position", "measurement noise", (4.0,)),
         "the σ of gnss-position is 4.00 times the assumed value", "filter.measurement_noise_factor = 2"),
        (cause("initial position", "initial state", (3.0, -40.0, 5.0), (0.5, 2.0, 0.25)),
         "the initial position has an error of [3 ± 0.5, -40 ± 2, 5 ± 0.25] m (north, east, down), which is larger "
         "than the filter assumes", "filter.initial_sigma.position_m = 120 and filter.initial_sigma.height_m = 15"),
        (cause("initial velocity", "initial state", (0.5, 0.25, -2.0), (0.1, 0.2, 0.3)),
         "the initial velocity has an error of [0.5 ± 0.1, 0.25 ± 0.2, -2 ± 0.3] m/s (north, east, down), which is "
         "larger than the filter assumes", "filter.initial_sigma.velocity_mps = 6"),
        (cause("initial tilt", "initial state", (0.5 * DEG, -0.25 * DEG), (0.1 * DEG, 0.2 * DEG)),
         "the initial tilt has an error of [0.5 ± 0.1, -0.25 ± 0.2]° (about north, about east), which is larger than "
         "the filter assumes", "filter.initial_sigma.tilt_arcmin = 90"),
        (cause("initial heading", "initial state", ()),
         "the initial heading has an error, which is larger than the filter assumes",
         "larger keys of filter.initial_sigma"),
    ],
)  # fmt: skip
def test_a_cause_of_a_simulated_run(simulated: Scenario, own: Hypothesis, what: str, keys: str) -> None:
    assert cause_and_remedy(own, simulated) == (what, keys)


@pytest.mark.parametrize(
    ("name", "unit", "told", "keys"),
    [
        ("baro bias", 1.0, "constant error of baro is -5 ± 0.5 m", "baro.bias_sigma_m"),
        ("baro scale", 1e-6, "scale factor error of baro is -5 ± 0.5 ppm", "baro.scale_sigma_ppm"),
        ("odometer scale", 1e-6, "scale factor error of odometer is -5 ± 0.5 ppm", "odometer.scale_sigma_ppm"),
        ("magnetometer bias", DEG, "constant error of magnetometer is -5 ± 0.5°", "magnetometer.bias_sigma_deg"),
        ("airspeed bias", 1.0, "constant error of airspeed is -5 ± 0.5 m/s", "airspeed.bias_sigma_mps"),
        ("airspeed scale", 1e-6, "scale factor error of airspeed is -5 ± 0.5 ppm", "airspeed.scale_sigma_ppm"),
        ("airspeed wind", 1.0, "wind (north, east) of airspeed is -5 ± 0.5 m/s", "airspeed.wind_sigma_mps"),
        ("attitude bias", MINUTE, "constant error of attitude is -5 ± 0.5 arcmin", "attitude.bias_sigma_arcmin"),
        ("star-tracker bias", SECOND, "constant error of star-tracker is -5 ± 0.5 arcsec",
         "star_tracker.bias_sigma_arcsec"),
        ("dual-antenna bias", DEG, "constant error of dual-antenna is -5 ± 0.5°", "dual_antenna.bias_sigma_deg"),
        ("master-attitude bias", MINUTE, "constant error of master-attitude is -5 ± 0.5 arcmin",
         "master.mounting_sigma_arcmin"),
        ("land-vehicle mounting", DEG, "mounting of land-vehicle is -5 ± 0.5°", "land_vehicle.mounting_sigma_deg"),
        ("land-vehicle lever arm", 1.0, "lever arm of land-vehicle is -5 ± 0.5 m", "land_vehicle.lever_arm_sigma_m"),
    ],
)  # fmt: skip
def test_an_error_of_an_aiding_sensor(simulated: Scenario, name: str, unit: float, told: str, keys: str) -> None:
    table = keys.partition(".")[0]
    aiding = {"gnss": {}, table: {"attitude": True} if table == "master" else {}}
    scenario = Scenario.model_validate({**simulated.contents(), "aiding": aiding})
    found = cause_and_remedy(cause(name, "state", (-5.0 * unit,), (0.5 * unit,)), scenario)
    assert found == (f"the {told}", f"aiding.{keys} = 15")
    other = cause_and_remedy(cause("radar time offset", "state", (0.25,), (0.5,)), simulated)
    state = 'a state "radar time offset" in the method states() of the sensor'
    assert other == ("the time offset of radar is 0.25 ± 0.5 in SI units", state)


def test_numbers_are_short() -> None:
    assert [short(v) for v in (1234.5, 0.00123456, -2.0)] == ["1230", "0.00123", "-2"]
    assert short(1234.5, 2) == "1200"
    assert wide(-0.1234) == "0.37"


REFUSED = (
    Refusals("gnss", 20.0, 26.5, 14, (3.0, -4.0, 5.0)),
    Refusals("gnss", 50.0, 50.0, 8),
    Refusals("gnss", 5.0, 9.0, 3),
    Refusals("gnss", 60.0, 66.0, 2),
)


def test_refused_readings_in_words() -> None:
    """The three longest spans are told in the order of time; the means are those of the longest one."""
    (told,) = _refused(["gnss", "baro"], REFUSED, {"gnss": "gnss-velocity"})
    assert told == (
        "The gate rejected consecutive measurements of gnss: 5 … 9 s (3), 20 … 26.5 s (14), 50 … 50 s (8), and 1 "
        "shorter span. The measurements differ from their predictions by 3.00 m/s north, -4.00 m/s east, 5.00 m/s down "
        "on average from 20 s on."
    )
    both = [*REFUSED[:1], Refusals("baro", 7.0, 8.0, 2, (9.0,))]
    first, second = _refused(["baro", "gnss"], both, {"gnss": "gnss-velocity", "baro": "baro-height"})
    assert first == "The gate rejected consecutive measurements of baro: 7 … 8 s (2)."
    assert second == "The gate rejected consecutive measurements of gnss: 20 … 26.5 s (14)."
    once = [Refusals("compass", 7.0, 7.0, 1, (-0.5 * DEG,))]
    (told,) = _refused(["compass"], once, {"compass": "heading"})
    assert told.endswith(": 7 … 7 s (1). The measurement differs from its prediction by -0.500 °.")


def test_the_entry_of_a_search(simulated: Scenario) -> None:
    noise = cause("gnss", "measurement noise", (3.0,), (0.25,), 40.0)
    both = cause("gnss, baro", "measurement noise", (3.0, 5.0), (), 10.0)
    unknown = cause("gyro bias", "state", (1.0,), (2.0,), -inf)
    found = Diagnosis(42.34, REFUSED[:1], {"gnss": 2.5, "baro": nan}, (noise, both, unknown), 17, 3.456)
    kinds = (SimpleNamespace(sensor="gnss", kind="gnss-velocity"),)
    entry = diagnosis_numbers(SimpleNamespace(diagnosis=found, innovations=kinds), simulated)
    refused, explained, cost = entry.pop("what_to_try")
    assert refused.startswith("The gate rejected consecutive measurements of gnss: 20 … 26.5 s (14). The measurements")
    assert explained == (
        "Most likely cause: the σ of gnss is 3.00 ± 0.25 times the assumed value. Try filter.measurement_noise_factor "
        "= 1.5. (The gain is 40 for the measurements until 42.3 s: twice the logarithm of the ratio of their "
        "probabilities with and without this cause. A correct filter exceeds 14 in at most 1 % of runs. The search "
        "finds one cause at a time: correct it, and run again.)"
    )
    assert cost == "The search took 17 runs of the filter over the data until 42.3 s, 3.5 s in all."
    assert entry == {
        "until_s": 42.34, "runs": 17, "seconds": 3.5, "false_alarm": 0.01, "cause": "gnss",
        "refused": [{"sensor": "gnss", "from_s": 20.0, "to_s": 26.5, "count": 14}],
        "sensors": {"gnss": {"innovations_larger_by": 2.5, "sigma_factor": 3.0},
                    "baro": {"innovations_larger_by": None, "sigma_factor": None}},
        "hypotheses": [
            {"name": "gnss", "kind": "measurement noise", "value": [3.0], "sigma": [0.25], "gain": 40.0,
             "needed": 14.2},
            {"name": "gnss, baro", "kind": "measurement noise", "value": [3.0, 5.0], "sigma": [], "gain": 10.0,
             "needed": 14.2},
        ],
    }  # fmt: skip


def test_no_cause_and_causes_alike(simulated: Scenario) -> None:
    nothing = Diagnosis(42.0, (), {}, (cause("gyro", "bias walk", (1.0,), gain=14.1),))
    assert list(_explained(nothing, {"gnss": 2.5}, simulated)) == [
        "The innovations of gnss would require a σ of 2.50 times the assumed one.",
        "No single error explains the innovations until 42 s. The search included a lever arm, delays, initial errors, "
        "errors of the inertial and the aiding sensors, and wrong noise. Look for outliers, wrong axes or wrong units "
        "(sinssim inspect).",
    ]
    one, other = (
        cause("baro bias", "state", (5.0,), (0.5,)),
        cause("inertial noise", "inertial noise", (3.0,), gain=50.4),
    )
    _, told = _explained(Diagnosis(42.0, (), {}, (one, other)), {}, simulated)
    assert told == (
        "Equally likely for this motion: the noise of gyros and accelerometers is 3.00 times the assumed noise (gain "
        "50). Try filter.inertial_noise_factor = 3, or for vibration filter.vibration_noise = 0.4. Explanations that "
        "are equal on a straight path at constant speed differ in turns and during changes of speed."
    )


def test_faults_that_a_scenario_plants() -> None:
    """Jumps, a ramp and faults of the inertial sensors, each from the earliest on, if it begins before the instant."""
    faults = [{"type": "spike", "sensor": "gyro_x", "at_s": 12.0, "deg_h": 5.0}]
    gnss = {
        "jumps": [{"from_s": 30.0, "up_m": 5.0}, {"from_s": 20.0, "up_m": 5.0}],
        "ramps": [{"from_s": 25.0, "up_mps": 1.0}],
    }
    scenario = SimpleNamespace(
        aiding=SimpleNamespace(gnss=SimpleNamespace(**{k: [SimpleNamespace(**f) for f in v] for k, v in gnss.items()})),
        imu=SimpleNamespace(faults=[SimpleNamespace(**faults[0]), SimpleNamespace(type="bias", from_s=14.0)]),
    )  # fmt: skip
    assert list(planted(scenario, 99.0)) == [
        "aiding.gnss.jumps from 20 s on", "aiding.gnss.ramps from 25 s on", "imu.faults from 12 s on"
    ]  # fmt: skip
    assert list(planted(scenario, 25.0)) == ["aiding.gnss.jumps from 20 s on", "imu.faults from 12 s on"]
    assert list(planted(scenario, 12.0)) == []


def test_innovations_without_a_search(monkeypatch: pytest.MonkeyPatch, simulated: Scenario) -> None:
    own = (SimpleNamespace(sensor="gnss", kind="gnss-velocity"), SimpleNamespace(sensor="baro", kind="baro-height"),
           SimpleNamespace(sensor="compass", kind="heading"))  # fmt: skip
    sizes = {"gnss": 2.5, "baro": 0.75, "compass": nan}
    verdicts = [SimpleNamespace(sensor=name, verdict="optimistic") for name in sizes]
    monkeypatch.setattr(filter_remedies, "consistency", lambda e: SimpleNamespace(consistent=False, sensors=verdicts))
    monkeypatch.setattr(filter_remedies, "refusals", lambda i: REFUSED[:1] if i.sensor == "gnss" else ())
    monkeypatch.setattr(filter_remedies, "size_of_innovations", lambda i: sizes[i.sensor])
    estimate = SimpleNamespace(diagnosis=None, history="h", innovations=own)
    entry = diagnosis_numbers(estimate, simulated)
    refused, larger, more = entry.pop("what_to_try")
    assert refused.startswith("The gate rejected consecutive measurements of gnss: 20 … 26.5 s (14). The measurements")
    assert larger == "The median of the innovations of gnss is 2.50 times the assumed one."
    assert more.startswith("Set filter.diagnose = true to search for the cause")
    assert entry == {
        "refused": [{"sensor": "gnss", "from_s": 20.0, "to_s": 26.5, "count": 14}],
        "sensors": {"gnss": {"innovations_larger_by": 2.5}, "baro": {"innovations_larger_by": 0.75},
                    "compass": {"innovations_larger_by": None}},
    }  # fmt: skip
    assert diagnosis_numbers(SimpleNamespace(diagnosis=None, history=None, innovations=own), simulated) is None
