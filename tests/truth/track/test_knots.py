"""Weights, gaps, bridges and knots of a track, and the smoothing it is given, worked out by hand from few samples."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.geodetic_coordinates import ecef_to_geodetic
from sinssim.errors import InputError
from sinssim.logs import track as track_file
from sinssim.logs.track import Track, _options
from sinssim.truth import track_smoothing as module
from sinssim.truth.motion import NORMAL_EARTH
from sinssim.truth.route_waypoint import Waypoint
from sinssim.truth.track_samples import TrackSamples
from sinssim.truth.track_smoothing import TrackOptions, knots_of_samples
from sinssim.truth.vehicle_attitude import VEHICLES

NAN = float("nan")


def samples(time: Any, **more: Any) -> TrackSamples:
    t = np.asarray(time, dtype=np.float64)
    columns = {"latitude": 0.5 + 1e-6 * t, "longitude": 0.2 + 2e-6 * t, "height": 100.0 + 3.0 * t, **more}
    return TrackSamples("x.csv", "row", t, **columns)


def test_weights_are_by_the_median_sigma() -> None:
    """(median/σ)², one for each of position and height; an unknown σ counts as the median; at most 10⁴."""
    sigma = np.array([[1.0, 8.0], [2.0, 4.0], [4.0, 2.0], [0.0, NAN], [1e-6, 4e6]])
    found = module._weights(samples(np.arange(5.0), sigma=sigma))
    # medians of 1, 2, 4, 1e-6 and of 8, 4, 2, 4e6
    np.testing.assert_allclose(found[:, 0], [2.25, 0.5625, 0.140625, 1.0, 1e4], rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], [0.5625, 2.25, 9.0, 1.0, 1e-4], rtol=1e-12)
    np.testing.assert_array_equal(module._weights(samples(np.arange(3.0))), np.ones((3, 2)))


def test_gaps_are_longer_than_ten_seconds_and_five_intervals() -> None:
    time = np.array([0.0, 1.0, 2.0, 12.5, 13.5, 23.5, 24.5])
    assert module._gaps(time, None).tolist() == [2]
    assert module._gaps(time, 9.0).tolist() == [2, 4]
    slow = 3.0 * np.array([0.0, 1.0, 2.0, 6.9, 7.9, 13.0, 14.0])  # five intervals are 15 s
    assert module._gaps(slow, None).tolist() == [4]


def test_a_gap_is_said_with_its_place() -> None:
    time = np.array([0.0, 1.0, 12.5, 13.5, 33.5, 34.5])
    wide = np.array([1, 3])
    q = np.tile([1.0, 0.0, 0.0, 0.0], (6, 1))
    begins = "The track has 2 gaps, the longest of 20 s after row 4, at 13.5 s: "
    assert module._about_gaps(samples(time), time, wide) == (begins + "bridged on a great circle at uniform speed.",)
    assert module._about_gaps(samples(time, q_nb=q), time, wide) == (begins + "the curve continues smoothly.",)
    assert module._about_gaps(samples(time), time, wide[:1])[0].startswith(
        "The track has a gap of 11.5 s after row 2, "
    )
    assert module._about_gaps(samples(time), time, wide[:0]) == ()


def test_a_bridge_has_the_usual_interval() -> None:
    """Over 5 s with an interval of 1 s there are four more: on the chord of the normals, with heights in proportion."""
    time = np.array([50.0, 51.0, 56.0, 57.0])
    given = samples(
        time, latitude=np.array([0.1, 0.0, 0.0, 0.2]), longitude=np.array([0.3, 0.4, 0.9, 1.0]),
        height=np.array([7.0, 10.0, 60.0, 3.0]), sigma=np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]]),
    )  # fmt: skip
    filled, since = module._bridged(given, time - 50.0, np.array([1]))
    np.testing.assert_allclose(since, np.arange(8.0), atol=1e-12)
    np.testing.assert_allclose(filled.time, 50.0 + np.arange(8.0), atol=1e-12)
    np.testing.assert_allclose(filled.height, [7.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 3.0])
    np.testing.assert_allclose(filled.latitude, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2], atol=1e-15)
    along = [math.atan2((1 - s) * math.sin(0.4) + s * math.sin(0.9), (1 - s) * math.cos(0.4) + s * math.cos(0.9))
             for s in (0.2, 0.4, 0.6, 0.8)]  # fmt: skip
    np.testing.assert_allclose(filled.longitude, [0.3, 0.4, *along, 0.9, 1.0], atol=1e-15)
    assert filled.sigma is not None
    assert filled.sigma.tolist() == [[1.0, 2.0], *[[3.0, 4.0]] * 5, [5.0, 6.0], [7.0, 8.0]]
    assert filled.rows.tolist() == list(range(1, 9))


@pytest.mark.parametrize(
    ("time", "vehicle", "tau", "derived", "expected"),
    [
        # through samples 1 s apart, with attitude: the samples; without: pieces of at most 0.1 s
        (np.arange(7.0), "land", (0.0, 0.0, 0.0), False, np.arange(7.0)),
        ([0.0, 1.0, 1.25, 2.25], "sea", (0.0, 0.0, NAN), True,
         [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25]),
        # fewer than six samples: at least five pieces
        ([0.0, 10.0], "land", (0.0, 0.0, 0.0), False, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]),
        # smoothed with attitude: evenly, a quarter of the least τ or the interval
        (np.arange(0.0, 25.0), "land", (8.0, 12.0, 16.0), False, np.linspace(0.0, 24.0, 13)),
        (np.arange(0.0, 25.0), "land", (2.0, 12.0, 16.0), False, np.arange(0.0, 25.0)),
        (np.arange(0.0, 3.0, 0.5), "sea", (2.0, 12.0, NAN), True, np.arange(0.0, 2.6, 0.25)),
    ],
)  # fmt: skip
def test_knots(time: Any, vehicle: str, tau: tuple[float, float, float], derived: bool, expected: Any) -> None:
    found = module._knot_times(np.asarray(time), VEHICLES[vehicle], tau, derived=derived)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_too_many_knots(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_MOST_KNOTS", 100)
    with pytest.raises(InputError) as error:
        module._knot_times(np.arange(0.0, 13.0), VEHICLES["land"], (0.0, 0.0, NAN), derived=True)
    assert str(error.value) == (
        "the track lasts 12 s and needs a knot every 0.1 s, more than 100 in all; cut it with track.start_s and "
        "track.end_s."
    )


def test_heights_and_positions_are_smoothed_apart() -> None:
    """Height samples that jump by 1 m are met with τ = 0, and smoothed away with τ = 5 s; the place is the same."""
    t = np.arange(0.0, 120.0)
    jumps = np.where(t % 2 > 0.0, 0.5, -0.5)
    found = {}
    for name, keys in (
        ("both", {"smoothing": 5.0}), ("position", {"smoothing": 5.0, "height_smoothing": 0.0}),
        ("height", {"smoothing": 0.0, "height_smoothing": 5.0}),
    ):  # fmt: skip
        knots = knots_of_samples(samples(t, height=200.0 + jumps), TrackOptions(**keys), "normal", WGS84)
        at = np.isin(np.round(knots.time, 6), np.arange(30.0, 90.0))
        found[name] = ecef_to_geodetic(knots.position[at])[2] - 200.0
        assert knots.tau[:2] == (keys["smoothing"], keys.get("height_smoothing", keys["smoothing"]))
        assert math.isnan(knots.tau[2])
    assert np.abs(found["both"]).max() < 0.01
    assert np.abs(found["height"]).max() < 0.01
    np.testing.assert_allclose(found["position"], jumps[30:90], atol=1e-6)


def test_what_a_sample_stands_for() -> None:
    """Half of the steps on both sides, whole at the ends; a step counts for at most three medians, here 3 s."""
    found = module._durations(np.array([0.0, 1.0, 3.0, 13.0, 14.0, 15.0]))
    np.testing.assert_allclose(found, [1.0, 1.5, 2.5, 2.0, 1.0, 1.0])


def test_values_of_tau_that_are_tried() -> None:
    """From a quarter of the interval, each √2 of the one before, to a sixth of the whole time or 128 intervals."""
    tried = module._tried(np.arange(0.0, 101.0, 2.0))  # a sixth of 100 s is 16.7 s, 33 times the least
    np.testing.assert_allclose(tried, 0.5 * np.sqrt(2.0) ** np.arange(11))
    assert 90.5 < module._tried(np.arange(0.0, 1003.0))[-1] < 128.1
    assert len(module._tried(np.array([0.0, 1.0]))) == 0


def test_tau_of_a_distance_too_large_is_the_largest_tried() -> None:
    t = np.arange(0.0, 101.0, 2.0)
    values = np.sin(t)[:, None]
    assert module.tau_by_distance(t, values, np.ones(len(t)), 50.0) == pytest.approx(16.0)
    assert module.tau_by_distance(t[:29], values[:29], np.ones(29), 0.5) == 0.0  # too few
    counted = module._mean_square(np.array([[3.0, 4.0], [1.0, 2.0]]), np.array([1.0, 3.0]), None, slice(None))
    assert counted == pytest.approx((25.0 + 3.0 * 5.0) / 4.0)


def test_smoothing_that_a_table_asks_for() -> None:
    given = {
        "vehicle": "sea", "smoothing_s": 1.0, "height_smoothing_s": 2.0, "attitude_smoothing_s": 3.0, "gap_s": 4.0,
        "standstill_mps": 5.0, "heading_deg": 60.0, "recorded_point_m": (7.0, 8.0, 9.0), "pitch": "slope",
    }  # fmt: skip
    assert _options(Track(file="a.csv", **given)) == TrackOptions(
        vehicle="sea", chosen="as given", smoothing=1.0, height_smoothing=2.0, attitude_smoothing=3.0, gap=4.0,
        standstill=5.0, heading=math.radians(60.0), point=(7.0, 8.0, 9.0), pitch="slope",
    )  # fmt: skip
    by_sigma = _options(Track(file="a.csv", position_sigma_m=1.0, height_sigma_m=2.0, speed_mps=3.0))
    assert by_sigma == TrackOptions(sigma=1.0, height_sigma=2.0)
    travelled = _options(Track(file="a.kml", speed_mps=3.0, vehicle="aircraft"))
    assert travelled == TrackOptions(vehicle="aircraft", chosen="to round the corners", smoothing=5.0)


def test_events_of_a_plan_are_at_its_waypoints() -> None:
    """1113 m of the equator at 10 m/s and 1 m/s² between stops: rest for 7 and 3 s."""
    section = Track(vehicle="land", acceleration_mps2=1.0, waypoints=(
        Waypoint(latitude_deg=0.0, longitude_deg=20.0, speed_mps=10.0, stop_s=7.0),
        Waypoint(name="B", latitude_deg=0.0, longitude_deg=20.01),
        Waypoint(name="C", latitude_deg=0.0, longitude_deg=20.02, stop_s=3.0),
    ))  # fmt: skip
    track = section.prepared(NORMAL_EARTH)
    whole, halt = math.radians(0.01) * WGS84.a, 35.0 / 16.0 * 10.0
    passed = 7.0 + halt + (whole - 5.0 * halt) / 10.0
    arrived = passed + (whole - 5.0 * halt) / 10.0 + halt
    assert [event.text for event in track.events] == ["waypoint 1: at rest for 7 s", "B", "C: at rest for 3 s"]
    assert [event.time for event in track.events] == pytest.approx([0.0, passed, arrived], abs=1e-6)
    assert track.duration == pytest.approx(arrived + 3.0, abs=1e-6)
    assert (track.fit.source, track.fit.noun, track.fit.samples) == ("the plan", "waypoint", 3)
    assert track.fit.distance == pytest.approx(2.0 * whole, rel=1e-6)
    assert track.fit.notes == ()
    corner = Track(vehicle="land", waypoints=(
        Waypoint(latitude_deg=10.0, longitude_deg=20.0, speed_mps=10.0),
        Waypoint(name="bend", latitude_deg=10.01, longitude_deg=20.0, turn_radius_m=60.0),
        Waypoint(latitude_deg=10.01, longitude_deg=20.01),
    ))  # fmt: skip
    (note,) = corner.prepared(NORMAL_EARTH).fit.notes
    # a right angle of arcs alone is cut by R (√2 − 1) = 24.85 m, with clothoids of 15 m by 15²/(24 R) = 0.16 m more
    assert note.endswith("track.waypoints.2 (bend).")
    assert note.startswith("Corners pass their waypoints at up to 24.9")


def test_a_route_that_takes_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """111.3 km of the equator at 10 m/s on a knot each tenth of a second."""
    monkeypatch.setattr(track_file, "_MOST_KNOTS", 100_000)
    section = Track(vehicle="land", waypoints=(
        Waypoint(latitude_deg=0.0, longitude_deg=20.0, speed_mps=10.0), Waypoint(latitude_deg=0.0, longitude_deg=21.0),
    ))  # fmt: skip
    with pytest.raises(InputError) as error:
        section.prepared(NORMAL_EARTH)
    assert str(error.value) == (
        "the planned route takes 1.113e+04 s and needs 111321 knots, more than 100000: give a shorter route, or a "
        "higher speed_mps."
    )
