"""Notes on a scenario, each with the number that it states worked out by hand."""

from __future__ import annotations

from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.logs.log_settings import Outages, outage_spans
from sinssim.scenario.ensemble_section import with_values
from sinssim.scenario.notes import (
    barometer_of_the_day,
    coarse_rates,
    keys_without_effect,
    times_not_reached,
    torquer_taken,
)
from sinssim.scenario.schema import Scenario
from sinssim.sensors.imu.imu_section import Imu
from sinssim.units import ARCSEC, DEG_SQRT_H

STILL = {"latitude_deg": 50.0, "duration_s": 100.0}


def aided(filter_: dict[str, Any], **aiding: Any) -> Scenario:
    return Scenario.model_validate({"name": "n", "parked": STILL, "aiding": aiding, "filter": filter_})


def test_what_begins_after_the_end() -> None:
    """At the end it is too late: from 100 s on nothing happens in a run of 100 s."""
    gnss = {
        "outages_s": [[10.0, 20.0], [100.0, 120.0]], "latency_s": 1.0,
        "jumps": [{"from_s": 99.9, "north_m": 1.0}, {"from_s": 130.5, "north_m": 1.0}],
        "ramps": [{"from_s": 101.0, "east_mps": 1.0}],
    }  # fmt: skip
    stops = {"during_s": [[5.0, 20.0], [300.0, 310.0]]}
    plan = aided({"alignment_s": 99.0}, gnss=gnss, zero_velocity=stops, baro={"latency_s": 100.0})
    assert sorted(times_not_reached(plan, 100.0)) == [
        "aiding.baro.latency_s = 100: no measurement arrives before the end of the run at 100 s.",
        "aiding.gnss.jumps.2 begins at 130.5 s, but the run ends at 100 s: it has no effect.",
        "aiding.gnss.outages_s.2 begins at 100 s, but the run ends at 100 s: it has no effect.",
        "aiding.gnss.ramps.1 begins at 101 s, but the run ends at 100 s: it has no effect.",
        "aiding.zero_velocity.during_s.2 begins at 300 s, but the run ends at 100 s: it has no effect.",
    ]
    assert not list(times_not_reached(aided({"alignment_s": 99.0}, gnss={}), 99.1))
    (late,) = times_not_reached(aided({"alignment_s": 99.0}, gnss={}), 99.0)
    assert late == "filter.alignment_s = 99: the alignment takes longer than the run, which ends at 99 s."


@pytest.mark.parametrize(("bias", "error"), [(55.0, ""), (54.0, ""), (50.0, "164")])
def test_a_barometer_in_the_air_of_the_day(bias: float, error: str) -> None:
    """At sea level 994 hPa are 161 to 164 m of pressure altitude: 3σ of 54 m cover it, of 50 m do not.

    h = 44 330.8 m (1 − (p/1013.25)^0.190263).
    """
    altitude = 44_330.8 * (1.0 - (994.0 / 1013.25) ** 0.190263)
    assert altitude == pytest.approx(161.0, abs=3.0)
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 0.0, "airspeed_kt": 280.0}
    flight = {"aircraft": "737", "start": start, "legs": [{"type": "hold", "duration_s": 60.0}],
              "atmosphere": {"sea_level_pressure_hpa": 994.0}}  # fmt: skip
    plan = Scenario.model_validate(
        {"name": "n", "flight": flight, "aiding": {"gnss": {}, "baro": {"bias_sigma_m": bias}}, "filter": {}}
    )
    notes = list(barometer_of_the_day(plan))
    assert bool(notes) == bool(error)
    if error:
        stated = round(altitude)
        assert notes == [
            f"aiding.baro.bias_sigma_m = 50: in the atmosphere of [flight.atmosphere] the barometer has an error of "
            f"{stated} m at a height of 0 m; the filter will reject its measurements. Give bias_sigma_m = {stated}."
        ]


@pytest.mark.parametrize(
    ("scale", "said"),
    [
        ({"scale_sigma_ppm": 20_000.0}, False),
        ({"scale_sigma_ppm": 10_000.0}, True),
        ({"scale_ppm": 20_000.0, "scale_sigma_ppm": 1.0}, False),
    ],
)
def test_a_scale_factor_that_covers_the_air_of_the_day(scale: dict[str, float], said: bool) -> None:
    """At 3000 m and 20 K above the standard day the error is 3000 m · 20/278, 215 m less 3 %: 3 · 76 m or 3 · 47 m."""
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 3000.0, "airspeed_kt": 280.0}
    flight = {"aircraft": "737", "start": start, "legs": [{"type": "hold", "duration_s": 60.0}],
              "atmosphere": {"isa_deviation_k": 20.0}}  # fmt: skip
    aiding = {"gnss": {}, "baro": {"bias_sigma_m": 47.0 if "scale_ppm" not in scale else 40.0, **scale}}
    plan = Scenario.model_validate({"name": "n", "flight": flight, "aiding": aiding, "filter": {}})
    notes = list(barometer_of_the_day(plan))
    assert bool(notes) == said
    if said:
        error = float(notes[0].partition("has an error of ")[2].partition(" m")[0])
        assert error == pytest.approx(3000.0 * 20.0 / 278.0, rel=0.1)
        assert "at a height of 3000 m" in notes[0]


def test_the_height_where_the_air_is_most_wrong_counts() -> None:
    """20 K above the standard day: 3 m at 45 m, some 140 m at 2000 m, where the climb ends."""
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 45.0, "airspeed_kt": 280.0}
    legs = [{"type": "climb", "altitude_m": 2000.0}, {"type": "hold", "duration_s": 60.0}]
    flight = {"aircraft": "737", "start": start, "legs": legs, "atmosphere": {"isa_deviation_k": 20.0}}
    aiding = {"gnss": {}, "baro": {"bias_sigma_m": 4.0}}
    plan = Scenario.model_validate({"name": "n", "flight": flight, "aiding": aiding, "filter": {}})
    (note,) = barometer_of_the_day(plan)
    error = float(note.partition("has an error of ")[2].partition(" m")[0])
    assert error == pytest.approx(2000.0 * 20.0 / 282.0, rel=0.1)
    assert "at a height of 2000 m" in note


@pytest.mark.parametrize(
    ("imu", "sigma"),
    [({"gyro_scale_sigma_ppm": 7.0}, "7"), ({"gyro_scale_ppm": [1.0, 2.0, 3.0]}, ""), ({"grade": "ideal"}, ""),
     ({"sensor_set": {"type": "platform", "torquer_scale_sigma_ppm": 3.0}, "gyro_scale_sigma_ppm": 7.0}, "")],
)  # fmt: skip
def test_the_torquing_scale_factor_taken(imu: dict[str, Any], sigma: str) -> None:
    block = {"sensor_set": {"type": "platform"}, **imu}
    plan = {"name": "n", "parked": STILL, "imu": block, "navigation": {"algorithms": ["platform", "quaternion"]}}
    found = list(torquer_taken(Scenario.model_validate(plan)))
    wanted = (
        f"imu.sensor_set.torquer_scale_sigma_ppm is not given: {sigma}, the 1σ of the gyros' scale factor, is used."
    )
    assert found == ([wanted] if sigma else [])


@pytest.mark.parametrize(("quantum", "said"), [(1.9, False), (2.1, True)])
def test_rates_that_are_coarser_than_their_noise(quantum: float, said: bool) -> None:
    """A step Q/T against the noise N √(1/T) of a rate: here of increments, Q against N √T; 25 samples a second."""
    walk = 0.06  # deg/√h
    arcsec = quantum * walk * DEG_SQRT_H / 5.0 / ARCSEC
    keys = {"grade": "ideal", "rate_hz": 25.0, "gyro_arw_deg_sqrt_h": walk, "gyro_quantum_arcsec": arcsec}
    assert not list(coarse_rates(Imu.model_validate(keys)))
    found = list(coarse_rates(Imu.model_validate({**keys, "output": "mean-rates"})))
    assert found == (
        ["imu.output: the step of the gyro rates is 2.1 times the noise of a reading: rates below half a step are "
         "lost, and the rounding is not the white noise that filter and budget assume; it is up to 2 times."]
        if said else []
    )  # fmt: skip


def test_windows_of_the_monitoring() -> None:
    def notes(**own: Any) -> list[str]:
        imu = {"sensor_set": {"type": "redundant", **own}}
        return list(keys_without_effect(Imu.model_validate(imu), 50.0))

    assert notes(windows_s=[5.0, 50.0, 51.0]) == [
        "imu.sensor_set.windows_s.3 = 51 has no effect: the window is longer than the run, which ends at 50 s."
    ]
    assert notes(windows_s=[5.0], monitoring="none") == [
        'imu.sensor_set.windows_s has no effect: there is no test with monitoring = "none".'
    ]
    assert notes() == []  # the default windows are nobody's wish


def test_outages_within_a_run() -> None:
    """Of 15 s every 40 s in a run from 5 s to 100 s: the first after a period, the last must end within the run."""
    regular = Outages(length_s=15.0, every_s=40.0)
    assert regular.spans(5.0, 100.0) == ((45.0, 60.0), (85.0, 100.0))
    assert regular.spans(5.0, 99.9) == ((45.0, 60.0),)
    assert Outages(length_s=15.0, every_s=40.0, first_s=2.0).spans(5.0, 60.0) == ((42.0, 57.0),)
    both = Outages(at_s=((70.0, 80.0), (0.0, 5.0), (100.0, 110.0), (99.0, 120.0)), length_s=15.0, every_s=40.0)
    assert both.spans(5.0, 100.0) == ((45.0, 60.0), (70.0, 80.0), (85.0, 100.0), (99.0, 120.0))
    several = Outages(length_s=15.0, every_s=40.0, first_s=(10.0, 30.0))
    assert several.spans(5.0, 100.0) == ()
    assert several.passes(5.0, 100.0) == (((10.0, 25.0), (50.0, 65.0)), ((30.0, 45.0), (70.0, 85.0)))


def test_outages_of_a_command_line() -> None:
    assert outage_spans(["70:80.5", "15/40@20"], 5.0, 100.0) == ((20.0, 35.0), (60.0, 75.0), (70.0, 80.5))
    assert outage_spans(["15/40"], 5.0, 100.0) == ((45.0, 60.0), (85.0, 100.0))
    for written, words in (
        (["15/40@20,30"], r"--outage 15/40@20,30: several beginnings need several exports; give one\."),
        (["50/40"], "length_s = 50 must be less than every_s = 40"),
        (["200:210"], r"--outage 200:210: no outage lies within the run, 5 to 100 s\."),
    ):
        with pytest.raises(InputError, match=words):
            outage_spans(written, 5.0, 100.0)


def test_values_of_varied_keys_are_put_in_their_places() -> None:
    """Entries of arrays are counted from 1; the contents that are given stay as they are."""
    contents = {"seed": 3, "imu": {"bias": [1.0, 2.0, 4.0]}, "legs": [{"a": 5}, {"a": 6, "b": 7}]}
    found = with_values(contents, {"imu.bias.2": 9.0, "legs.2.a": 8, "seed": 11, "new.key": 0.5})
    assert found == {
        "seed": 11, "imu": {"bias": [1.0, 9.0, 4.0]}, "legs": [{"a": 5}, {"a": 8, "b": 7}], "new": {"key": 0.5},
    }  # fmt: skip
    assert contents == {"seed": 3, "imu": {"bias": [1.0, 2.0, 4.0]}, "legs": [{"a": 5}, {"a": 6, "b": 7}]}
