"""Tracks with and without attitude: closure, order of convergence, closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim import InputError, NavState, Trajectory, navigate, rotation
from sinssim.earth.ellipsoids import ELLIPSOIDS, OMEGA_IE
from sinssim.truth import track_curve
from sinssim.truth.curve import Curve
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from sinssim.truth.track_curve import from_samples
from sinssim.truth.track_smoothing import TrackOptions
from tests.oracles import integrator as oracle
from tests.slow import slow
from tests.truth.motions import Array, ecef, synthetic_flight

DEG = np.pi / 180.0


def fine(duration: float) -> Curve:
    """Return the synthetic flight at 20 Hz: its own error is a millionth of that at 1 Hz, and rounding stays small."""
    t = np.arange(round(duration * 20.0) + 1) / 20.0
    return Curve(t, *synthetic_flight(t))


def track_of(flight: Trajectory, hz: float, end: float, *, attitude: bool = True, **options: Any) -> Any:
    t = np.arange(round(end * hz) + 1) / hz
    s = flight.state(t)
    q = s.q_nb if attitude else None
    return from_samples(t, s.latitude, s.longitude, s.height, q, vehicle="aircraft", **options)


def closure(track: Trajectory, **options: Any) -> float:
    """Return the largest distance of a navigator with ideal sensors from the truth, m."""
    imu = track.increments(100.0)
    s = track.state(imu.time)
    start = NavState(s.latitude[0], s.longitude[0], s.height[0], s.velocity_ned[0], s.q_nb[0])
    found = navigate(imu, start, algorithm="functional-iteration", **options)
    rows = np.searchsorted(imu.time, found.time - 1e-6)
    there = oracle.geodetic_to_ecef(found.latitude, found.longitude, found.height)
    apart = there - oracle.geodetic_to_ecef(s.latitude[rows], s.longitude[rows], s.height[rows])
    return float(np.linalg.norm(apart, axis=1).max())


def test_navigator_closes_on_a_track_with_attitude() -> None:
    """Asked: 1 mm an hour. Three minutes here; the hour is the slow test."""
    assert closure(track_of(fine(181.0), 10.0, 180.0)) < 1e-4


@pytest.mark.slow
def test_navigator_closes_for_an_hour() -> None:
    assert closure(track_of(fine(3601.0), 5.0, 3600.0)) < 1e-3


def test_a_flight_as_a_track_is_the_flight() -> None:
    """The samples of a curve at its own knots give the curve back."""
    flight = fine(60.0)
    t = np.arange(0.0, 60.0 + 1e-9, 1.0 / 20.0)
    s = flight.state(t)
    track = from_samples(
        t, s.latitude, s.longitude, s.height, s.q_nb, vehicle="aircraft", smoothing_s=0.0, attitude_smoothing_s=0.0
    )
    between = np.linspace(1.0, 59.0, 501)
    assert np.abs(ecef(track, between)[0] - ecef(flight, between)[0]).max() < 1e-7
    assert np.abs(track.rates(between)[0] - flight.rates(between)[0]).max() < 1e-9


def test_order_of_convergence_with_attitude() -> None:
    """Errors fall with the interval h: force as h⁴ (second derivative of a quintic), rate as h⁵, at least."""
    flight = fine(121.0)
    t = np.linspace(30.0, 90.0, 1201)
    omega, force = flight.rates(t)
    errors = []
    for hz in (1.0, 2.0):
        track = track_of(flight, hz, 120.0, smoothing_s=0.0, attitude_smoothing_s=0.0)
        own = track.rates(t)
        errors.append((np.abs(own[0] - omega).max(), np.abs(own[1] - force).max()))
    rate, specific = np.log2(np.array(errors[0]) / np.array(errors[1]))
    assert 4.5 < rate < 7.0
    assert 3.5 < specific < 6.0


def weaving(t: Array, speed: float = 100.0) -> tuple[Array, Array, Array]:
    """Return latitude, longitude and height of a level weave near 45° north."""
    across = 300.0 * np.sin(0.1 * t)
    latitude = 45.0 * DEG + speed * t / 6.37e6
    return latitude, 10.0 * DEG + across / (6.37e6 * np.cos(latitude)), np.full(len(t), 2000.0)


def test_order_of_convergence_without_attitude() -> None:
    """Heading and roll come from velocity and acceleration: errors of the specific force fall as h⁴."""
    errors = []
    t = np.linspace(40.0, 160.0, 1201)
    dense = np.arange(0.0, 200.0001, 0.1)
    reference = from_samples(dense, *weaving(dense), vehicle="aircraft", smoothing_s=0.0)
    for h in (4.0, 2.0):
        samples = np.arange(0.0, 200.0001, h)
        track = from_samples(samples, *weaving(samples), vehicle="aircraft", smoothing_s=0.0)
        errors.append(np.abs(track.rates(t)[1] - reference.rates(t)[1]).max())
    assert 3.5 < np.log2(errors[0] / errors[1]) < 6.5


CIRCLES = {
    "oblique": (0.8, 0.2, 0.4),
    "over the north pole": (np.radians(89.0), 0.3, 0.0),
    "over the south pole": (np.radians(-89.5), 0.3, np.pi),
    "across 180°": (0.5, np.radians(179.5), np.pi / 2),
}


@pytest.mark.parametrize("name", ["oblique", "over the north pole", *slow("over the south pole", "across 180°")])
def test_great_circle_with_attitude_has_its_rates(name: str) -> None:
    """The closed form, sampled at 1 Hz; 17 nm/s² is the rounding of positions at this interval."""
    start = CIRCLES[name]
    circle = GreatCircle(start[0], start[1], 9000.0, start[2], 250.0, 1000.0)
    t = np.arange(0.0, 1001.0)
    s = circle.state(t)
    track = from_samples(t, s.latitude, s.longitude, s.height, s.q_nb, vehicle="aircraft")
    between = np.linspace(50.0, 950.0, 777)
    omega, force = circle.rates(between)
    assert np.abs(track.rates(between)[0] - omega).max() < 1e-13
    assert np.abs(track.rates(between)[1] - force).max() < 1e-7


@pytest.mark.parametrize("name", ["over the south pole", "across 180°", *slow("oblique", "over the north pole")])
def test_great_circle_without_attitude(name: str) -> None:
    """Heading within the angle between velocity and great circle, and no lateral force: a coordinated turn."""
    start = CIRCLES[name]
    circle = GreatCircle(start[0], start[1], 9000.0, start[2], 250.0, 1000.0)
    t = np.arange(0.0, 1001.0)
    s = circle.state(t)
    track = from_samples(t, s.latitude, s.longitude, s.height, vehicle="aircraft", smoothing_s=0.0)
    between = np.linspace(50.0, 950.0, 777)
    own = track.state(between)
    nose = rotation.rotate(own.q_nb, np.broadcast_to((1.0, 0.0, 0.0), (len(between), 3)))
    along = own.velocity_ned / np.linalg.norm(own.velocity_ned, axis=1)[:, None]
    assert np.abs(nose - along).max() < 1e-9
    assert np.abs(track.rates(between)[1][:, 1]).max() < 1e-6
    assert closure(track, frame="inertial") < 1e-4


@pytest.mark.parametrize("vehicle", ["aircraft", "land"])
@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_level_circle(vehicle: str, turn: float) -> None:
    """Constant speed on a circle of 2 km: roll = atan of lateral over vertical force, yaw rate v/R.

    The lateral force has the Coriolis acceleration 2 ω v sin φ beside v²/R, the vertical one 2 ω v cos φ sin(heading);
    the roll without the Earth's rotation, atan(v²/(gR)), is within 0.2°.
    """
    speed, radius, latitude = 80.0, 2000.0, 45.0 * DEG
    t = np.arange(0.0, 200.0, 0.5)
    psi = turn * speed / radius * t
    r1, r2 = (float(v) for v in sinssim.earth.radii(latitude))
    north, east = radius * np.sin(turn * psi), turn * radius * (1.0 - np.cos(psi))
    track = from_samples(
        t, latitude + north / r1, 0.2 + east / (r2 * np.cos(latitude + north / r1)), 0.0 * t,
        vehicle=vehicle, smoothing_s=0.0,
    )  # fmt: skip
    at = np.linspace(20.0, 180.0, 333)
    s = track.state(at)
    roll, pitch, heading = rotation.euler_from_quaternion(s.q_nb)
    assert np.abs(pitch).max() < 1e-3
    course = np.arctan2(s.velocity_ned[:, 1], s.velocity_ned[:, 0])
    assert np.abs(np.angle(np.exp(1j * (heading - course)))).max() < 1e-9
    omega, force = track.rates(at)
    gravity = -sinssim.earth.gravity_ned(latitude, 0.0)[2]
    lateral = turn * speed**2 / radius + 2.0 * OMEGA_IE * speed * np.sin(latitude)
    if vehicle == "land":
        assert np.abs(roll).max() < 1e-12
        assert force[:, 1] == pytest.approx(np.full(len(at), lateral), abs=0.02)
        assert omega[:, 2] == pytest.approx(turn * speed / radius - OMEGA_IE * np.sin(latitude), abs=2e-4)
    else:
        assert roll == pytest.approx(np.arctan2(lateral, -gravity), abs=2e-3)
        assert roll == pytest.approx(np.full(len(at), np.arctan(turn * speed**2 / (9.806 * radius))), abs=0.2 * DEG)
        assert np.abs(force[:, 1]).max() < 1e-5


def test_recorded_point_is_where_it_was() -> None:
    """The antenna's track with its lever arm: the curve of the antenna passes the samples, the reference point not."""
    circle = GreatCircle(0.8, 0.2, 500.0, 0.4, 50.0, 100.0)
    t = np.arange(0.0, 101.0)
    s = circle.state(t)
    arm = (2.0, -0.5, -1.5)
    track = from_samples(t, s.latitude, s.longitude, s.height, s.q_nb, recorded_point_m=arm, lever_arm_m=arm)
    antenna, _, _ = ecef(track, t)
    assert np.linalg.norm(antenna - ecef(circle, t)[0], axis=1).max() < 1e-6
    centre = from_samples(t, s.latitude, s.longitude, s.height, s.q_nb, recorded_point_m=arm)
    assert np.linalg.norm(ecef(centre, t)[0] - antenna, axis=1) == pytest.approx(np.linalg.norm(arm), abs=1e-6)
    assert centre.fit.horizontal is not None
    assert centre.fit.horizontal.largest < 1e-6


def test_distance_from_the_samples_is_that_of_the_curve() -> None:
    rng = np.random.default_rng(7)
    t = np.arange(0.0, 300.0)
    latitude, longitude, height = weaving(t, 30.0)
    height = height + rng.standard_normal(len(t))
    track = from_samples(t, latitude, longitude, height, vehicle="aircraft", position_sigma_m=0.1, height_sigma_m=0.8)
    s = track.state(t)
    fit = track.fit
    assert fit.vertical is not None
    assert fit.vertical.rms == pytest.approx(float(np.sqrt(np.mean((s.height - height) ** 2))), rel=1e-6)
    assert fit.vertical.rms == pytest.approx(0.8, rel=0.02)
    assert fit.vertical.largest == pytest.approx(float(np.abs(s.height - height).max()), rel=1e-6)


def test_interface_offers_it() -> None:
    t = np.arange(0.0, 20.0)
    track = sinssim.Trajectory.from_samples(t, 0.8 + 1e-6 * t, 0.0 * t, 0.0 * t)
    assert track.end == 19.0
    assert not hasattr(track, "from_samples")  # of the interface, not of every trajectory


def test_given_arrays_are_left_alone() -> None:
    t = np.arange(0.0, 20.0)
    q = np.tile((0.0, 0.0, 0.0, 1.0), (20, 1))
    kept = q.copy()
    from_samples(t, 0.8 + 1e-6 * t, 0.0 * t, 0.0 * t, q)
    assert np.array_equal(q, kept)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"latitude": 45.0}, "give radians"),
        ({"vehicle": "tram"}, "unknown vehicle"),
        ({"quaternion": np.ones((5, 4))}, "it must be (30, 4)"),
        ({"quaternion": np.ones((30, 4))}, "norm 2"),
        ({"smoothing_s": 1.0, "position_sigma_m": 1.0}, "give one of them"),
        ({"smoothing_s": -1.0}, "smoothing_s"),
        ({"height": np.zeros(3)}, "one number per sample"),
    ],
)
def test_refusals(change: dict[str, Any], words: str) -> None:
    t = np.arange(30.0)
    given = {
        "time": t,
        "latitude": 0.8 + 1e-6 * t,
        "longitude": 0.0 * t,
        "height": 0.0 * t,
        "vehicle": "land",
        **change,
    }
    if isinstance(given["latitude"], float):
        given["latitude"] = given["latitude"] + 0.0 * t
    with pytest.raises(InputError) as error:
        from_samples(**given)
    assert words in str(error.value)


def test_every_option_arrives(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of unlike values, and the limit of the speed, which lets 90 m/s of a ship pass."""
    seen: dict[str, Any] = {}

    def fitted(samples: Any, options: TrackOptions, gravity: str, ellipsoid: Any) -> Any:
        seen.update(samples=samples, options=options, gravity=gravity, ellipsoid=ellipsoid)
        return "knots", "fit", {"a": "channel"}

    monkeypatch.setattr(track_curve, "fitted", fitted)
    monkeypatch.setattr(track_curve, "track_curve", lambda *given, **more: (given, more))
    t = np.arange(5.0, 15.0)
    found = from_samples(
        t, 0.8 + 90.0 * t / 6.37e6, 0.2 + 0.0 * t, 7.0 + t, vehicle="sea", smoothing_s=1.0, height_smoothing_s=2.0,
        attitude_smoothing_s=3.0, height_sigma_m=4.0, pitch="slope", standstill_mps=5.0, heading=6.0, gap_s=7.0,
        max_speed_mps=100.0, recorded_point_m=(8.0, 9.0, 10.0), lever_arm_m=(11.0, 12.0, 13.0),
        q_bs=(0.6, 0.8, 0.0, 0.0), gravity="j2", ellipsoid=ELLIPSOIDS["krasovsky-1940"],
    )  # fmt: skip
    assert seen["options"] == TrackOptions(
        vehicle="sea", smoothing=1.0, height_smoothing=2.0, attitude_smoothing=3.0, height_sigma=4.0, gap=7.0,
        pitch="slope", standstill=5.0, heading=6.0, point=(8.0, 9.0, 10.0),
    )  # fmt: skip
    assert (seen["gravity"], seen["ellipsoid"].name) == ("j2", "krasovsky-1940")
    assert seen["samples"].time.tolist() == t.tolist()
    assert seen["samples"].height.tolist() == (7.0 + t).tolist()
    given, more = found
    assert given[:2] == ("knots", "fit")
    assert given[2:5] == ((11.0, 12.0, 13.0), (0.6, 0.8, 0.0, 0.0), "j2")
    assert more == {"channels": {"a": "channel"}}
    with pytest.raises(InputError, match="more than 80 m/s, max_speed_mps"):
        from_samples(t, 0.8 + 90.0 * t / 6.37e6, 0.2 + 0.0 * t, t, vehicle="sea", max_speed_mps=80.0)
    from_samples(t, 0.8 + 1e-7 * t, 0.2 + 0.0 * t, t, position_sigma_m=0.25)
    assert seen["options"] == TrackOptions(sigma=0.25)


def test_messages_of_samples_have_their_numbers() -> None:
    t = np.arange(30.0)
    with pytest.raises(InputError) as error:
        from_samples(t, np.where(t > 3.5, 45.0, 0.5), 0.0 * t, 0.0 * t)
    assert str(error.value) == (
        "sample 5: latitude = 45 rad lies beyond ±π/2: give radians, for example numpy.radians(latitude); 45° would be "
        "0.785398 rad."
    )
    with pytest.raises(
        InputError, match=r"longitude has the shape \(29,\), but time has \(30,\): one number per sample"
    ):
        from_samples(t, 0.5 + 0.0 * t, t[1:], 0.0 * t)
