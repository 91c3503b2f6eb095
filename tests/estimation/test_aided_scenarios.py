"""The aided scenarios that come with the package: short versions of each, and each as it is."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.experiments.run.run_execution import run
from sinssim.experiments.run.run_result import PlaneRun, Run
from sinssim.scenario import Scenario, load_scenario
from tests.slow import slow

DEG_H, ARCMIN = np.pi / 180.0 / 3600.0, np.pi / 180.0 / 60.0


def gyrocompass(time: float) -> float:
    """Heading accuracy of a laser-navigation unit at 50° after a time: √(σ_b² + N²/T)/(ω_ie cos φ), rad."""
    bias, walk = 0.0035 * DEG_H, 0.002 * np.pi / 180.0 / 60.0
    return float(np.sqrt(bias**2 + walk**2 / time) / (7.292115e-5 * np.cos(np.radians(50.0))))


def flown(name: str, legs: int, *overrides: str) -> Scenario:
    """Return a scenario with its first legs only."""
    s = load_scenario(name, overrides)
    return s.model_copy(update={"flight": s.flight.model_copy(update={"legs": s.flight.legs[:legs]})})


def within(result: Run | PlaneRun, sigmas: float) -> bool:
    """Say whether every state's error at the end lies within so many of its standard deviations."""
    found = result.aided.estimate
    known = found.sigma[-1] > 0.0
    return bool(np.all(np.abs(result.aided.state_errors[-1, known]) < sigmas * found.sigma[-1, known]))


@pytest.mark.parametrize(
    ("name", "legs", "overrides"),
    [
        ("aided_airliner", 1, ["aiding.gnss.outages_s=[[20.0, 35.0]]"]),
        ("in_flight_calibration", 1, []),
        ("spoofed", 1, ["aiding.gnss.ramps.1.from_s=40.0"]),
        ("align_in_motion", 2, ["flight.legs.2.turns=2", "filter.alignment_s=60.0"]),
        ("transfer_alignment", 2, ["flight.legs.2.turns=1", "aiding.master.outages_s=[[60.0, 540.0]]"]),
        *slow(("mems_uav", 1, ["aiding.gnss.outages_s=[[30.0, 40.0]]"])),
    ],
)
def test_short_flight(name, legs, overrides):
    shorter = ["flight.legs.1.duration_s=60.0"] if name == "spoofed" else []
    result = run(flown(name, legs, *overrides, *shorter))
    kept = result.summary["filter"]
    assert kept["divergence"] is None
    if name == "spoofed":
        assert kept["faults"][0]["kind"] == "ramp"
    else:
        assert kept["consistent"], kept["findings"]
        assert within(result, 4.5)
    inertial = result.summary["algorithms"]["quaternion"]
    assert kept["aided"]["rms_horizontal_error_m"] < inertial["rms_horizontal_error_m"]


def test_short_gyrocompassing():
    result = run(load_scenario("gyrocompassing", ["parked.duration_s=400.0"]))
    sigma = result.aided.estimate.sigma[-1, 8]
    # the base may have turned during the alignment's 120 s, which therefore tell less than the filter's 280 s
    assert gyrocompass(400.0) < sigma < 1.1 * gyrocompass(280.0)
    assert within(result, 4.5)


# As they are


@pytest.mark.slow
def test_airliner():
    """At the end of 15 minutes without satellites the error is within its σ, and smoothing at least halves its peak."""
    result = run(load_scenario("aided_airliner"))
    kept, found = result.summary["filter"], result.aided.estimate
    assert kept["consistent"], kept["findings"]
    for begin, end in ((1200.0, 1500.0), (2700.0, 3600.0)):
        last = int(np.searchsorted(found.time, end - 0.05)) - 1
        assert np.all(np.abs(result.aided.state_errors[last, :3]) < 3.0 * found.sigma[last, :3])
        peak = result.aided.error.horizontal[(found.time > begin) & (found.time <= end)].max()
        smoothed = result.aided.smoothed_error
        during = (smoothed.time > begin) & (smoothed.time <= end)
        assert smoothed.horizontal[during].max() < 0.5 * peak
    assert within(result, 4.5)
    assert 0.5 < kept["nees"]["all states"]["value"] < 2.0


@pytest.mark.slow
def test_uav():
    result = run(load_scenario("mems_uav"))
    kept = result.summary["filter"]
    assert kept["consistent"], kept["findings"]
    assert within(result, 4.5)
    assert (
        kept["aided"]["max_horizontal_error_m"]
        < 20.0
        < result.summary["algorithms"]["quaternion"]["final_horizontal_error_m"]
    )
    biases_only = run(load_scenario("mems_uav", ['filter.states=["gyro bias", "accelerometer bias"]']))
    assert not biases_only.summary["filter"]["consistent"]  # 1000 ppm and 1 mrad are there, and no state for them


@pytest.mark.slow
def test_gyrocompassing():
    result = run(load_scenario("gyrocompassing"))
    found = result.aided.estimate
    for time in (300.0, 600.0, 1200.0, 1800.0, 3600.0):
        row = int(np.searchsorted(found.time, time - 1e-6))
        assert gyrocompass(time) < found.sigma[row, 8] < 1.1 * gyrocompass(time - 120.0)
    assert within(result, 4.5)


@pytest.mark.slow
def test_alignment_in_motion():
    """Begins 150° off; the filter's heading is right from the first fix, to what it says."""
    result = run(load_scenario("align_in_motion"))
    kept = result.summary["filter"]
    assert kept["consistent"], kept["findings"]
    assert within(result, 4.5)
    for at in (kept["alignment"]["begin"], kept["alignment"]["end"]):
        assert abs(at["heading_error_arcmin"]) < 3.0 * at["heading_sigma_arcmin"] < 15.0
    assert result.summary["algorithms"]["quaternion"]["max_attitude_error_arcsec"] > 149.0 * 3600.0


@pytest.mark.slow
def test_transfer_alignment():
    """A degree wrong at first, some arcminutes after the turns; five minutes after the release within what σ says."""
    result = run(load_scenario("transfer_alignment"))
    kept, found = result.summary["filter"], result.aided.estimate
    assert kept["consistent"], kept["findings"]
    begin, end = kept["alignment"]["begin"], kept["alignment"]["end"]
    assert (begin["heading_sigma_arcmin"], end["time_s"]) == pytest.approx((60.0, 239.8))
    assert abs(end["heading_error_arcmin"]) < 3.0 * end["heading_sigma_arcmin"] < 6.0
    assert np.all(np.abs(result.aided.state_errors[-1, :9]) < 3.0 * found.sigma[-1, :9])
    inertial = result.summary["algorithms"]["quaternion"]["final_horizontal_error_m"]
    assert kept["aided"]["final_horizontal_error_m"] < 0.05 * inertial


@pytest.mark.slow
def test_calibration():
    """Every parameter of the unit becomes observable, and is found within 4σ with σ at least halved."""
    result = run(load_scenario("in_flight_calibration"))
    kept = result.summary["filter"]
    assert kept["consistent"], kept["findings"]
    parameters = {n: s for n, s in kept["states"].items() if n.startswith(("gyro", "accelerometer"))}
    assert len(parameters) == 24
    for name, state in parameters.items():
        assert state["observable"], name
        assert state["reduction"] >= 2.0, name
        assert abs(state["error_end"]) < 4.0 * state["sigma_end"], name


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "caught", "shows"), [(1.0, True, True), (0.2, False, True), (0.03, False, False)])
def test_spoofed(rate, caught, shows):
    """A fast ramp is refused, a slow one shows in the sums of the innovations, a very slow one does not show."""
    result = run(load_scenario("spoofed", [f"aiding.gnss.ramps.1.east_mps={rate}"]))
    kept = result.summary["filter"]
    (ramp,) = kept["faults"]
    assert ramp["caught"] is caught
    assert any(s["verdict"] != "consistent" for s in kept["sensors"].values()) is shows
    assert kept["consistent"] is False  # the truth tells anyway
    assert kept["nees"]["position"]["verdict"] == ("consistent" if caught else "optimistic")
    if not caught:  # it is followed all the way
        assert ramp["max_horizontal_error_m"] == pytest.approx(1200.0 * rate, rel=0.1)


@pytest.mark.slow
def test_the_monitor_sees_the_ramp_of_spoofed_and_nothing_else():
    """Fifty draws: the ramp of 0.2 m/s is seen within two minutes, and without it no fix is withdrawn."""
    late = []
    for seed in range(50):
        shared = [f"seed={seed}", "imu.rate_hz=20", "filter.monitor_s=300"]
        for ramps in ([], ["aiding.gnss.ramps=[]"]):
            sensors = run(load_scenario("spoofed", [*shared, *ramps])).summary["filter"]["sensors"]
            since = sensors["gnss-position"]["withdrawn_s"]
            assert (since is None) == bool(ramps), seed
            late += [] if since is None else [since - 1200.0]
    assert min(late) > 0.0
    assert max(late) < 120.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mems_uav", "aided_airliner", "gyrocompassing"])
def test_wrong_noise_is_reported(name):
    """Told 0.3 or 3 times the noise of the inertial sensors, or of the readings, the run calls its filter inconsistent.

    Of laser gyros under fixes to the metre, told three times their noise, no innovation shows it; the truth does.
    """
    for what in ("inertial", "measurement"):
        for factor, verdict in ((0.3, "optimistic"), (3.0, "pessimistic")):
            kept = run(load_scenario(name, [f"filter.{what}_noise_factor={factor}"])).summary["filter"]
            assert kept["consistent"] is False, (what, factor)
            noise = [test["verdict"] for test in kept["noise"].values()]
            if what == "inertial":
                assert set(noise) == {verdict}
            else:
                assert {s["verdict"] for s in kept["sensors"].values()} == {verdict}
                assert verdict not in noise
