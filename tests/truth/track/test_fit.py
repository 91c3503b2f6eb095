"""The numbers and sentences about a track, from a fit and from a curve whose numbers are worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.earth.ellipsoids import WGS84
from sinssim.truth import track_curve as module
from sinssim.truth.sampling import Channel
from sinssim.truth.track_curve import Distance, TrackFit, assess, fit_lines, fit_numbers, fit_sentences, metres
from sinssim.truth.track_samples import TrackSamples
from sinssim.truth.track_smoothing import Knots, TrackOptions

NAN = float("nan")
FIT = TrackFit(
    source="drive.gpx", samples=70, noun="fix", interval=0.5, duration=123.25, distance=4321.9,
    horizontal=Distance(0.31, 1.25, 17.5), vertical=Distance(0.012, 0.047, 60.25),
    attitude=Distance(math.radians(0.11), math.radians(0.46), 33.0), tau=(1.5, 2.25, 0.0),
    speed=Distance(9.0, 31.25, 80.0), acceleration=Distance(1.0, 4.903325, 81.5),
    turn=Distance(0.1, math.radians(12.5), 90.0),
    pitch=Distance(0.02, math.radians(3.25), 95.75), turning=0.7, standing=0.32, attitude_words="as recorded",
    smoothing_words="position τ = 1.5 s, as given", notes=("A note.",), warnings=("Doubtful.",),
)  # fmt: skip


def test_lines_of_a_recorded_track() -> None:
    assert list(fit_lines(FIT)) == [
        ("samples", "70 fixes, median interval 0.5 s"),
        ("length", "4.322 km in 123.25 s"),
        ("smoothing", "position τ = 1.5 s, as given"),
        (
            "distance from the samples",
            "horizontal rms 0.31 m, largest 1.25 m at 17.5 s; vertical rms 12 mm, largest 47 mm at 60.25 s",
        ),
        ("angle from the samples", "rms 0.11°, largest 0.46° at 33 s"),
        (
            "largest",
            "speed 31.25 m/s at 80 s, acceleration 0.5 g at 81.5 s, turn rate 12.5 °/s at 90 s, pitch 3.25° at 95.75 s",
        ),
        ("attitude", "as recorded, 32% of the time"),
    ]


def test_lines_of_a_planned_route() -> None:
    level = Distance(0.0, 0.0, 0.0)
    plan = replace(FIT, interval=0.0, horizontal=None, vertical=None, attitude=None, pitch=level, standing=0.0)
    facts = dict(fit_lines(plan))
    assert list(facts) == ["length", "largest", "attitude"]
    assert facts["largest"].endswith("turn rate 12.5 °/s at 90 s")
    assert facts["attitude"] == "as recorded"
    assert list(fit_sentences(plan)) == [
        "Planned route: 4.322 km in 123.25 s.",
        f"Largest along the track: {facts['largest']}. Attitude: as recorded.",
        "A note.",
        "WARNING: Doubtful.",
    ]


def test_sentences_of_a_recorded_track() -> None:
    facts = dict(fit_lines(FIT))
    assert list(fit_sentences(FIT)) == [
        "Track: 70 fixes, median interval 0.5 s. Distance of the curve from the samples: "
        "horizontal rms 0.31 m, largest 1.25 m at 17.5 s; vertical rms 12 mm, largest 47 mm at 60.25 s.",
        "Smoothing of the track: position τ = 1.5 s, as given.",
        f"Largest along the track: {facts['largest']}. Attitude: as recorded, 32% of the time.",
        "A note.",
        "WARNING: Doubtful.",
    ]
    assert next(iter(fit_lines(replace(FIT, samples=1, noun="row"))))[1] == "1 row, median interval 0.5 s"
    tiny = Distance(1e-8, 3e-7, 1.0)
    assert dict(fit_lines(replace(FIT, horizontal=tiny)))["distance from the samples"].startswith(
        "horizontal below 1 µm; vertical rms"
    )


def test_numbers_of_the_summary() -> None:
    assert fit_numbers(FIT) == {
        "samples": 70, "duration_s": 123.25, "distance_m": 4321.9,
        "rms_horizontal_from_samples_m": 0.31, "max_horizontal_from_samples_m": 1.25,
        "rms_vertical_from_samples_m": 0.012, "max_vertical_from_samples_m": 0.047,
        "rms_angle_from_samples_rad": math.radians(0.11), "max_angle_from_samples_rad": math.radians(0.46),
        "position_smoothing_s": 1.5, "height_smoothing_s": 2.25, "attitude_smoothing_s": 0.0,
        "max_speed_mps": 31.25, "max_acceleration_mps2": 4.903325, "max_turn_rate_radps": math.radians(12.5),
        "max_pitch_rad": math.radians(3.25), "attitude": "as recorded", "notes": ["A note."], "warnings": ["Doubtful."],
    }  # fmt: skip
    bare = fit_numbers(replace(FIT, attitude=None, tau=(1.5, 2.25, NAN)))
    assert set(fit_numbers(FIT)) - set(bare) == {
        "rms_angle_from_samples_rad", "max_angle_from_samples_rad", "attitude_smoothing_s",
    }  # fmt: skip


def test_distances_in_words() -> None:
    words = ["below 1 µm", "1.5 µm", "999 µm", "1 mm", "99.9 mm", "0.1 m", "12.3 m"]
    assert [metres(value) for value in (9.9e-7, 1.5e-6, 9.99e-4, 1e-3, 0.0999, 0.1, 12.3)] == words


def test_root_mean_square_and_largest() -> None:
    found = Distance.of(np.array([2.0, 3.0, 5.0, 8.0]), np.array([1.0, -7.0, 5.0, 3.0]))
    assert (found.rms, found.largest, found.at) == (pytest.approx(math.sqrt(21.0)), 7.0, 3.0)


@pytest.mark.parametrize(
    ("options", "tau", "words"),
    [
        ({"smoothing": 1.5}, (1.5, 1.5, NAN), "position τ = 1.5 s, as given; height τ = 1.5 s, as given"),
        (
            {"smoothing": 1.5, "chosen": "to round the corners", "height_smoothing": 0.0},
            (1.5, 0.0, NAN),
            "position τ = 1.5 s, to round the corners; height through the samples, as given",
        ),
        (
            {"sigma": 0.5, "attitude_smoothing": 3.0},
            (2.0, 4.0, 3.0),
            "position τ = 2 s, from σ; height τ = 4 s, from σ; attitude τ = 3 s, as given",
        ),
        (
            {"height_sigma": 0.5},
            (0.0, 4.125, 0.25),
            "position through the samples, by cross-validation; height τ = 4.12 s, from σ; attitude τ = 0.25 s, by "
            "cross-validation",
        ),
    ],
)
def test_smoothing_in_words(options: dict[str, Any], tau: tuple[float, float, float], words: str) -> None:
    assert module._smoothing_words(tau, TrackOptions(**options)) == words


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "pitch from climb, no roll; heading held from below 0.5 m/s until 1 m/s"),
        ({"pitch": "flat"}, "no pitch, no roll; heading held from below 0.5 m/s until 1 m/s"),
        (
            {"vehicle": "aircraft"},
            "pitch from climb, roll of a coordinated turn; heading held from below 1.5 m/s until 3 m/s",
        ),
        ({"vehicle": "sea", "standstill": 0.8}, "no pitch, no roll; heading held from below 0.4 m/s until 0.8 m/s"),
    ],
)
def test_attitude_in_words(options: dict[str, Any], words: str) -> None:
    assert module._attitude_words(samples(), TrackOptions(**options)) == f"assumed: heading along the track, {words}"


def samples(**more: Any) -> TrackSamples:
    """Four fixes on the equator, 100, 60 and 40 m apart to the east, at unlike intervals; the first at 50 s."""
    east = np.array([0.0, 100.0, 160.0, 200.0]) / WGS84.a
    return TrackSamples("x.csv", "row", 50.0 + np.array([0.0, 5.0, 7.0, 10.0]), np.zeros(4), 0.4 + east, np.zeros(4),
                        notes=("of samples",), **more)  # fmt: skip


def assessed(options: TrackOptions, q_nb: Any = None, *, planned: bool = False, **numbers: Any) -> tuple[TrackFit, Any]:
    """Assess a curve that passes 3 m north, 4 m east, 2 m up of the second sample and 1 m below the last one."""
    place = samples(q_nb=q_nb)
    time = np.array([0.0, 2.0, 5.0, 10.0])
    velocity = np.array([[0.0, 10.0, 0.0], [0.0, 0.0, 20.0], [30.0, 0.0, 40.0], [6.0, 0.0, 8.0]])
    acceleration = np.array([[1.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 3.0, 4.0], [0.0, 0.0, 0.5]])
    # level heading east, a nose at 0.1 rad, two more: q_eb by columns of the matrix
    up, east, north = (
        np.array([np.cos(0.4), np.sin(0.4), 0.0]),
        np.array([-np.sin(0.4), np.cos(0.4), 0.0]),
        np.eye(3)[2],
    )
    q_eb = []
    for nose in (0.0, 0.1, -0.3, 0.05):
        forward = np.cos(nose) * east + np.sin(nose) * up
        q_eb.append(quaternion(np.column_stack([forward, -north, np.cross(forward, -north)])))
    position = np.tile(WGS84.a * up, (4, 1))
    knots = Knots(time, position, np.array(q_eb), velocity, acceleration, np.array([True, False, False, False]),
                  (1.5, 2.5, NAN), ("of knots",))  # fmt: skip
    knots = replace(knots, **numbers)
    rates = np.array([0.1, 0.3, -0.2, 0.4])

    def state(t: np.ndarray) -> Any:
        assert t.tolist() == [0.0, 5.0, 7.0, 10.0]
        q = np.tile([1.0, 0.0, 0.0, 0.0], (4, 1)) if q_nb is None else q_nb.copy()
        q[1] = [math.cos(0.01), 0.0, math.sin(0.01), 0.0]
        r1 = WGS84.a * (1.0 - WGS84.e2)
        return SimpleNamespace(
            latitude=np.array([0.0, 3.0 / r1, 0.0, 0.0]),
            longitude=place.longitude + np.array([0.0, 4.0 / WGS84.a, 0.0, 0.0]),
            height=np.array([0.0, 2.0, 0.0, -1.0]), q_nb=q,
        )  # fmt: skip

    omega = [rate * np.array([0.6, 0.8, 0.0]) + earth_in_body(q) for rate, q in zip(rates, knots.q_eb, strict=True)]
    curve: Any = SimpleNamespace(end=10.0, state=state, rates=lambda t: (np.array(omega), None))
    return assess(curve, knots, place, options, WGS84, planned=planned)


def quaternion(matrix: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(matrix).as_quat(scalar_first=True)


def earth_in_body(q: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(q, scalar_first=True).inv().apply([0.0, 0.0, WGS84.omega])


def test_the_numbers_of_a_curve() -> None:
    q_nb = np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    fit, channels = assessed(TrackOptions(smoothing=1.5), q_nb)
    assert (fit.source, fit.samples, fit.noun, fit.interval, fit.duration) == ("x.csv", 4, "row", 3.0, 10.0)
    # speeds 10, 20, 50, 10 m/s by trapezoids over 2, 3 and 5 s
    assert fit.distance == pytest.approx(15.0 * 2.0 + 35.0 * 3.0 + 30.0 * 5.0)
    assert (fit.speed.largest, fit.speed.at) == (pytest.approx(50.0), 5.0)
    assert fit.speed.rms == pytest.approx(math.sqrt((100.0 + 400.0 + 2500.0 + 100.0) / 4.0))
    assert (fit.acceleration.largest, fit.acceleration.at) == (pytest.approx(5.0), 5.0)
    assert (fit.turn.largest, fit.turn.at) == (pytest.approx(0.4), 10.0)
    assert fit.turning == pytest.approx(0.05 * 2.0 + 0.065 * 3.0 + 0.1 * 5.0)
    assert (fit.pitch.largest, fit.pitch.at) == (pytest.approx(0.3), 5.0)
    assert fit.standing == 0.25
    assert fit.tau[:2] == (1.5, 2.5)
    assert (fit.attitude_words, fit.notes) == ("as recorded", ("of samples", "of knots"))
    assert fit.horizontal is not None
    assert fit.vertical is not None
    assert fit.attitude is not None
    assert (fit.horizontal.largest, fit.horizontal.at) == (pytest.approx(5.0, abs=1e-5), 5.0)
    assert fit.horizontal.rms == pytest.approx(2.5, abs=1e-5)
    assert (fit.vertical.largest, fit.vertical.at) == (pytest.approx(2.0, abs=1e-5), 5.0)
    assert fit.vertical.rms == pytest.approx(math.sqrt(5.0 / 4.0), abs=1e-5)
    assert (fit.attitude.largest, fit.attitude.at) == (pytest.approx(0.02), 5.0)
    assert set(channels) == {"horizontal_from_samples_m", "height_above_samples_m", "angle_from_samples_rad"}
    units = {"horizontal_from_samples_m": "m", "height_above_samples_m": "m", "angle_from_samples_rad": "rad"}
    for name, values in (
        ("horizontal_from_samples_m", [0.0, 5.0, 0.0, 0.0]), ("height_above_samples_m", [0.0, 2.0, 0.0, -1.0]),
        ("angle_from_samples_rad", [0.0, 0.02, 0.0, 0.0]),
    ):  # fmt: skip
        channel: Channel = channels[name]
        assert channel.time.tolist() == [0.0, 5.0, 7.0, 10.0]
        np.testing.assert_allclose(channel.values, values, atol=1e-5)
        assert channel.unit == units[name]


def test_doubtful_numbers_are_said() -> None:
    """A car of 15 m/s², 2 rad/s and 0.27 rad; the fastest pair of samples has 30 m/s, and 1.5 · 30 + 1 is passed."""
    fast = {"acceleration": np.diag([16.0, 1.0, 1.0, 1.0])[:, :3]}
    fit, _ = assessed(TrackOptions(smoothing=1.5), **fast)
    more = "; smooth more with track.smoothing_s or track.position_sigma_m if the samples are noisy."
    assert fit.warnings == (
        f'The largest acceleration, 1.63 g at 0 s, is implausible for vehicle = "land"{more}',
        'The largest assumed pitch, 17.2° at 5 s, is implausible for vehicle = "land": smooth the heights with '
        'track.height_smoothing_s, or give track.pitch = "flat".',
        "The curve is faster, 50 m/s at 5 s, than any two neighbouring samples, 30 m/s: the samples are too far apart "
        "for their turns. Give samples at a higher rate, or smooth them with track.smoothing_s.",
    )
    plan, channels = assessed(TrackOptions(), planned=True, **fast)
    assert plan.warnings == (
        'The largest acceleration, 1.63 g at 0 s, is implausible for vehicle = "land".',
        'The largest assumed pitch, 17.2° at 5 s, is implausible for vehicle = "land".',
    )
    assert (channels, plan.horizontal, plan.interval) == ({}, None, 0.0)
    assert plan.smoothing_words == "planned: the curve is the plan"
    slow, _ = assessed(TrackOptions(vehicle="sea", smoothing=1.0), velocity=np.full((4, 3), 0.2), held=np.ones(4, bool))
    assert slow.warnings == (
        "The vehicle covers 200 m but is never faster than 0.346 m/s, so that its heading is track.heading_deg all the "
        "time. Check the unit of the times, or lower track.standstill_mps (0.5 by default).",
    )
