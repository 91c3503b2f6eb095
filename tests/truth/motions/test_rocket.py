"""A sounding rocket: ascent by the rocket equation, free fall by the equations of motion, closure, refusals."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import sinssim
from sinssim.data import ImuData
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError
from sinssim.rotation.quaternions import euler_from_quaternion
from sinssim.scenario import Scenario, load_scenario
from sinssim.truth.atmosphere import Air, density
from sinssim.truth.motion import TrueEarth
from sinssim.truth.motions.rocket import Rocket, RocketFlight
from sinssim.units import G0
from tests.oracles import integrator as oracle
from tests.slow import slow
from tests.truth.motions import ecef

ONE_STAGE = {"propellant_kg": 600.0, "structure_kg": 100.0, "thrust_kn": 60.0, "burn_s": 20.0}
SPIN = np.array([0.0, 0.0, oracle.OMEGA])


def rocket(*stages: dict[str, Any], **keys: Any) -> Rocket:
    usual = {"latitude_deg": 50.0, "longitude_deg": 10.0, "altitude_m": 200.0, "elevation_deg": 90.0, "pad_s": 5.0,
             "payload_kg": 300.0}  # fmt: skip
    return Rocket.model_validate({**usual, "stages": list(stages), **keys})


@pytest.fixture(scope="module")
def shipped() -> RocketFlight:
    section = load_scenario("sounding_rocket").rocket
    assert section is not None
    motion = section.trajectory()
    assert isinstance(motion, RocketFlight)
    return motion


def inertial(motion: RocketFlight, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity in inertial axes by the oracle's formulas."""
    r, v, _ = ecef(motion, time)
    turn = Rotation.from_rotvec(np.outer(time, SPIN))
    return turn.apply(r), turn.apply(v + np.cross(SPIN, r))


def test_ascent_without_air_is_that_of_the_rocket_equation() -> None:
    """u ln(m₀/m) less ∫g dt, with u = T/ṁ = 2000 m/s and g falling as 1/r²; upwards along the plumb line."""
    motion = rocket(ONE_STAGE, drag_coefficient=0.0).trajectory()
    (end,) = (event.time for event in motion.events if event.text == "burn-out of stage 1")
    assert end == 25.0
    time = np.linspace(5.0, end, 2001)
    up, height = -motion.state(time).velocity_ned[:, 2], motion.state(time).height
    g = -oracle_gravity(50.0, height)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (g[1:] + g[:-1]) * np.diff(time))])
    expected = 2000.0 * np.log(1000.0 / (1000.0 - 30.0 * (time - 5.0))) - integral
    np.testing.assert_allclose(up, expected, atol=0.5)  # the axis is released from the turning Earth: 0.3 m/s
    force = motion.rates(np.array([5.0 + 1e-9, 25.0 - 1e-9, 25.0 + 1e-9]))[1]
    np.testing.assert_allclose(force, [[60.0, 0.0, 0.0], [150.0, 0.0, 0.0], [0.0, 0.0, 0.0]], atol=1e-6)


def oracle_gravity(latitude_deg: float, height: np.ndarray) -> np.ndarray:
    """Return gravity along the vertical, downwards negative, m/s²."""
    lat = np.radians(latitude_deg)
    r = oracle.geodetic_to_ecef(np.full(len(height), lat), np.zeros(len(height)), height)
    g = np.array([oracle.gravitation(*row, oracle.ZONAL) for row in r]) - np.cross(SPIN, np.cross(SPIN, r))
    return np.asarray(g @ [np.cos(lat), 0.0, np.sin(lat)])


def test_a_stage_takes_its_structure_along() -> None:
    """Two stages, by hand: masses before and after each step, and drag that jumps with the mass at a separation."""
    motion = rocket(
        {**ONE_STAGE, "separation_s": 2.0},
        {"propellant_kg": 100.0, "structure_kg": 50.0, "thrust_kn": 20.0, "burn_s": 10.0, "ignition_s": 3.0},
    ).trajectory()
    events = {event.text: event.time for event in motion.events}
    assert [events[f"{what} of stage {n}"] for n in (1, 2) for what in ("burn-out", "separation")] == [25, 27, 40, 40]
    assert events["ignition of stage 2"] == 30.0
    assert motion.rates(np.array([30.0 + 1e-9]))[1][0, 0] > 20_000.0 / 450.0 - 20.0  # 300 + 150 kg, less drag
    before, after = motion.rates(np.array([27.0 - 1e-9, 27.0 + 1e-9]))[1]
    np.testing.assert_allclose(after, before * 550.0 / 450.0, rtol=1e-6)  # the same drag on less mass
    assert {27.0, 30.0, 40.0} <= set(motion.breaks)


def test_air_is_the_standard_atmosphere() -> None:
    """Within 5 % of its table, and of the ICAO's up to 32 km (ρ = p/RT)."""
    height = np.arange(0.0, 32e3, 1e3)
    icao = [Air().pressure(h) / (287.05287 * Air().temperature(h)) for h in height]
    np.testing.assert_allclose(density(height), icao, rtol=0.05)
    np.testing.assert_allclose(density(np.array([50e3, 70e3, 90e3])), [1.0269e-3, 8.2829e-5, 3.416e-6], rtol=0.04)


def test_drag_is_that_of_the_flow(shipped: RocketFlight) -> None:
    """½ ρ v² C_D A over the mass, against the velocity relative to the air that turns with the Earth."""
    time = np.array([80.0 + 60.0 - 5.0, shipped.end - 5.0])  # both without thrust; 300 kg of the payload at the end
    _, v, c = ecef(shipped, time)
    force = np.einsum("nij,nj->ni", c, shipped.rates(time)[1])
    height = shipped.state(time).height
    mass = np.array([300.0, 300.0])
    speed = np.linalg.norm(v, axis=1)
    expected = 0.5 * density(height) * speed * 0.5 * 0.25 * np.pi * 0.56**2 / mass
    np.testing.assert_allclose(force, -expected[:, None] * v, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("gravity", ["j2", "normal"])
def test_free_fall_is_that_of_the_equations_of_motion(gravity: str, shipped: RocketFlight) -> None:
    """300 s about the highest point: point mass and J2 written out, or zonal harmonics to J20, integrated by itself; no
    increment of velocity."""
    motion = shipped
    if gravity == "j2":
        section = load_scenario("sounding_rocket").rocket
        assert section is not None
        motion = section.trajectory(earth=TrueEarth(gravity="j2"))
    out, back = motion._air
    assert back - out > 300.0
    time = np.linspace(0.5 * (out + back) - 150.0, 0.5 * (out + back) + 150.0, 7)
    r, v = inertial(motion, time)

    def fall(t: float, y: np.ndarray) -> np.ndarray:
        x, y_, z = y[:3]
        if gravity == "normal":
            return np.concatenate([y[3:], oracle.gravitation(x, y_, z, oracle.ZONAL)])
        size = np.linalg.norm(y[:3])
        k = 1.5 * 1.0826298e-3 * (WGS84.a / size) ** 2
        s = 5.0 * (z / size) ** 2
        pull = -WGS84.gm / size**3 * np.array([x * (1 + k * (1 - s)), y_ * (1 + k * (1 - s)), z * (1 + k * (3 - s))])
        return np.concatenate([y[3:], pull])

    kepler = solve_ivp(
        fall, (time[0], time[-1]), np.concatenate([r[0], v[0]]), "DOP853", t_eval=time, rtol=1e-12, atol=1e-6
    )
    assert np.linalg.norm(kepler.y[:3].T - r, axis=1).max() < 1e-4
    imu = motion.increments(10.0)
    free = (imu.time[:-1] > out) & (imu.time[1:] < back)
    assert free.sum() > 3000
    assert np.abs(imu.dvel[free]).max() == 0.0
    np.testing.assert_allclose(imu.dtheta[free], np.tile([np.radians(18.0), 0.0, 0.0], (free.sum(), 1)), atol=1e-14)


def test_it_stands_on_its_pad_and_comes_back(shipped: RocketFlight) -> None:
    time = np.array([0.0, 30.0, 59.99])
    state = shipped.state(time)
    assert np.abs(state.velocity_ned).max() == 0.0
    np.testing.assert_allclose(state.height, 330.0, atol=1e-8)
    assert np.degrees(state.latitude) == pytest.approx([67.89] * 3, abs=1e-12)
    roll, pitch, heading = (np.degrees(angle) for angle in euler_from_quaternion(state.q_nb))
    np.testing.assert_allclose(np.stack([roll, pitch, heading])[:, 1], [0.0, 87.0, 350.0], atol=1e-9)
    g = -oracle_gravity(67.89, np.array([330.0]))[0]
    np.testing.assert_allclose(np.linalg.norm(shipped.rates(time)[1], axis=1), g, rtol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(shipped.rates(time)[0], axis=1), oracle.OMEGA, rtol=1e-12)
    end = shipped.state(np.array([shipped.end]))
    assert end.height[0] == pytest.approx(330.0, abs=1e-6)
    assert 50.0 < end.velocity_ned[0, 2] < 600.0
    assert shipped.events[-1].text == "back at the height of the pad"
    (top,) = (event.text for event in shipped.events if event.text.startswith("highest"))
    assert 205.0 < float(top.split()[2]) < 220.0
    aloft = np.linspace(60.01, shipped.end, 4000)
    force = np.linalg.norm(shipped.rates(aloft)[1], axis=1) / G0
    assert 6.5 < force[aloft < 200.0].max() < 8.0
    assert force.max() < 11.5


TURNING = {"program": [[12.0, 84.0]], "gravity_turn_s": 12.0, "payload_kg": 100.0, "heading_deg": 70.0}


@pytest.fixture(scope="module")
def turning() -> RocketFlight:
    motion = rocket({**ONE_STAGE, "burn_s": 40.0}, **TURNING, duration_s=60.0, spin_deg_s=20.0).trajectory()
    assert isinstance(motion, RocketFlight)
    return motion


def test_a_gravity_turn_is_that_of_the_equations_of_motion(turning: RocketFlight) -> None:
    """From the end of the turn into the velocity to the burn-out, thrust along it in Earth-fixed axes:
    r̈ = γ − 2ω × v − ω × (ω × r) + (T − D) v/(m |v|), and by hand γ̇ = −(g/v − v/r) cos γ − 2ω cos φ sin ψ."""
    time = np.array([5.0 + 12.0 + 5.0, 30.0, 45.0 - 1e-6])
    r, v, c = ecef(turning, time)
    np.testing.assert_allclose(c[:, :, 0], v / np.linalg.norm(v, axis=1)[:, None], atol=1e-9)  # no angle of attack

    def climb(t: float, y: np.ndarray) -> np.ndarray:
        height = oracle_height(y[:3])
        mass, speed = 800.0 - 600.0 * (t - 5.0) / 40.0, np.linalg.norm(y[3:])
        push = 60_000.0 - 0.5 * float(density(height)) * 0.25 * np.pi * 0.25 * 0.4 * speed**2
        other = 2.0 * np.cross(SPIN, y[3:]) + np.cross(SPIN, np.cross(SPIN, y[:3]))
        return np.concatenate([y[3:], oracle.gravitation(*y[:3], oracle.ZONAL) - other + push / mass / speed * y[3:]])

    there = solve_ivp(
        climb, (time[0], time[-1]), np.concatenate([r[0], v[0]]), "LSODA", t_eval=time, rtol=1e-12, atol=1e-9
    )
    np.testing.assert_allclose(there.y[:3].T, r, atol=1e-4)
    np.testing.assert_allclose(there.y[3:].T, v, atol=1e-5)

    state = turning.state(np.array([34.9, 35.0, 35.1]))
    north, east, down = state.velocity_ned.T
    climbs, speed = np.arctan2(-down, np.hypot(north, east)), np.linalg.norm(state.velocity_ned[1])
    g, radius = -oracle_gravity(50.0, state.height[1:2])[0], oracle.A + state.height[1]
    sideways = 2.0 * oracle.OMEGA * np.cos(state.latitude[1]) * np.sin(np.arctan2(east[1], north[1]))
    by_hand = -(g / speed - speed / radius) * np.cos(climbs[1]) + sideways
    assert (climbs[2] - climbs[0]) / 0.2 == pytest.approx(by_hand, rel=2e-3)


@pytest.mark.slow
def test_a_launcher_reaches_an_orbit() -> None:
    """Perigee and apogee of its Kepler orbit after the last separation, by energy and angular momentum."""
    section = load_scenario("launch_to_orbit", ["rocket.sway_arcmin=0"]).rocket
    assert section is not None
    r, v = (of[0] for of in inertial(section.trajectory(), np.array([1100.0])))  # type: ignore[arg-type]
    a = 1.0 / (2.0 / np.linalg.norm(r) - v @ v / oracle.GM)
    e = np.sqrt(1.0 - np.sum(np.cross(r, v) ** 2) / (oracle.GM * a))
    assert (a * (1.0 - e) - oracle.A) / 1e3 == pytest.approx(186.0, abs=2.0)
    assert (a * (1.0 + e) - oracle.A) / 1e3 == pytest.approx(700.0, abs=3.0)


def oracle_height(r: np.ndarray) -> float:
    """Return the height above the ellipsoid, m, by iteration of its normal."""
    p, z, e2 = np.hypot(r[0], r[1]), r[2], oracle.F * (2.0 - oracle.F)
    latitude = np.arctan2(z, p * (1.0 - e2))
    for _ in range(4):
        n = oracle.A / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
        latitude = np.arctan2(z + e2 * n * np.sin(latitude), p)
    return float(p * np.cos(latitude) + z * np.sin(latitude) - oracle.A * np.sqrt(1.0 - e2 * np.sin(latitude) ** 2))


SWAYING = {"sway_arcmin": 5.0, "sway_hz": 0.5, "sway_arm_m": 8.0, "pad_s": 400.0, "duration_s": 401.0}


def test_a_rocket_sways_on_its_pad_by_the_given_tilt() -> None:
    """5 arcmin about each axis, mostly at 0.5 Hz; 8 m up the sensors move by 8 m times as much; nothing at lift-off."""
    motion = rocket(ONE_STAGE, **SWAYING).trajectory(seed=3)
    time = np.arange(0.0, 389.0, 0.05)
    upright = rocket(ONE_STAGE, **{**SWAYING, "sway_arcmin": 0.0, "sway_hz": 0.4, "sway_arm_m": 10.0}).trajectory()
    r, _, c = ecef(motion, time)
    still, _, upright_c = ecef(upright, time)
    moved, turn = (r - still) @ upright_c[0], Rotation.from_matrix(upright_c[0].T @ c).as_rotvec()
    np.testing.assert_allclose(np.degrees(turn[:, 1:].std(axis=0)) * 60.0, 5.0, rtol=0.25)  # of about 20 periods
    assert np.abs(turn[:, 0]).max() < 1e-5
    np.testing.assert_allclose(moved[:, 1:], 8.0 * np.column_stack([turn[:, 2], -turn[:, 1]]), atol=1e-4)
    spectrum = np.abs(np.fft.rfft(turn[:, 1] * np.hanning(len(time)))) ** 2
    f = np.fft.rfftfreq(len(time), 0.05)
    assert spectrum[(f > 0.4) & (f < 0.6)].sum() > 0.5 * spectrum.sum()
    other = rocket(ONE_STAGE, **SWAYING).trajectory(seed=4)
    assert np.abs(other.state(100.0).q_nb - motion.state(100.0).q_nb).max() > 1e-5
    after = np.array([400.0, 400.5])
    np.testing.assert_allclose(motion.state(after).q_nb, upright.state(after).q_nb, atol=1e-14)


@pytest.mark.parametrize("kind", ["turning", "swaying"])
def test_a_gravity_turn_and_a_sway_lead_back_to_the_truth(kind: str, turning: RocketFlight) -> None:
    brief = {**SWAYING, "pad_s": 20.0, "duration_s": 25.0}
    check_closure(turning if kind == "turning" else rocket(ONE_STAGE, **brief).trajectory(seed=3), 400.0, 60.0)


@pytest.mark.parametrize("until", [150.0, *slow(600.0)])
def test_increments_lead_back_to_the_truth(until: float, shipped: RocketFlight) -> None:
    """The independent integrator from one instant at which the force jumps to the next, in all three directions."""
    check_closure(shipped, 400.0, until)


def check_closure(motion: Any, rate: float, until: float) -> None:
    imu = motion.increments(rate)
    kept = int(min(until, motion.end) * rate)
    imu = ImuData(imu.time[: kept + 1], imu.dtheta[:kept], imu.dvel[:kept])
    position, velocity, c = ecef(motion, imu.time)
    edges = motion.breaks * rate
    whole = (np.abs(edges - np.round(edges)) < 1e-6) & (edges < kept - 5)
    marks = sorted({0, *np.round(edges[whole]).astype(int).tolist(), len(imu.time) - 1})
    r, v, attitude = position[0], velocity[0], c[0]
    for a, b in pairwise(marks):
        q = Rotation.from_matrix(attitude).as_quat(scalar_first=True)
        part = slice(a, b + 1)
        there, speed, turned = oracle.integrate(imu.time[part], imu.dtheta[a:b], imu.dvel[a:b], r, v, q)
        assert np.linalg.norm(there - position[part], axis=1).max() < 1e-5
        r, v, attitude = there[-1], speed[-1], turned[-1]
    assert Rotation.from_matrix(attitude @ c[-1].T).magnitude() < 1e-9


def test_defaults_have_no_air_and_a_run_ends_well() -> None:
    keys = {"name": "r", "imu": {"grade": "ideal", "rate_hz": 100.0}}
    small = {**rocket(ONE_STAGE).model_dump(exclude_none=True), "duration_s": 40.0}
    run = sinssim.run(Scenario.model_validate({**keys, "rocket": small}))
    assert run.scenario.navigation.vertical == "free"
    assert run.summary["algorithms"]["quaternion"]["max_horizontal_error_m"] < 1e-3
    assert run.truth.time[-1] == pytest.approx(40.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["rocket.stages.1.thrust_kn=15.0"], r"stages\.1\.thrust_kn = 15 does not lift 1800 kg at an elevation of 87°"),
        (["rocket.payload_kg=-3.0"], r"payload_kg.*greater than 0"),
        (["rocket.stages.2.propellant_kg=0.0"], r"propellant_kg.*greater than 0"),
        (
            ["rocket.stages.1.ignition_s=3.0"],
            r"ignition_s = 3: the rocket lifts off with the ignition of its first stage",
        ),
        (["rocket.program=[[60.0, 80.0], [15.0, 84.0]]"], r"program: its times must increase.*they are 60, 15"),
        (
            ["rocket.diameter_m=10.0"],
            r"payload_kg = 300 is too light for a drag area of 39\.3 m².*give 10 kg/m² or more",
        ),
        (["rocket.duration_s=50.0"], r"duration_s = 50 must exceed pad_s = 60"),
        (["rocket.gravity_turn_s=30.0"], r"program: the gravity turn follows it: its last time, 60"),
        (["rocket.program=[]", "rocket.gravity_turn_s=5.0"], r"gravity_turn_s = 5 must be at least 10"),
        (
            ["rocket.program=[[8.0, 89.8]]", "rocket.gravity_turn_s=20.0"],
            r"begin at an elevation of 89\.8, where gravity",
        ),
        (
            ["rocket.program=[]", "rocket.gravity_turn_s=10.0"],
            r"gravity_turn_s = 10: 13 s after lift-off the thrust jumps",
        ),
        (
            ["rocket.gravity_turn_s=740.0", "rocket.duration_s=800.0"],
            r"gravity_turn_s = 740 is after the end of the run, 800 s with 60 s on the pad",
        ),
        (["rocket.sway_hz=0.5"], r"sway_hz has no effect without sway_arcmin"),
        (["rocket.sway_arcmin=2", "rocket.pad_s=12"], r"pad_s = 12: the sway ends in the last 10 s before lift-off"),
        (["navigation.vertical=baro-loop"], r'"baro-loop" has no meaning for \[rocket\], which leaves the air'),
        (["aiding.baro.rate_hz=1.0"], r"\[aiding\.baro\] senses the air, which \[rocket\] leaves"),
        (["gravity.model=egm2008"], r"\[rocket\] falls freely in the gravity of \[truth\]"),
    ],
)
def test_what_no_rocket_does_is_refused(settings: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_scenario("sounding_rocket", settings)


def test_a_rocket_that_does_not_come_back_needs_a_duration() -> None:
    stage = {"propellant_kg": 60_000.0, "structure_kg": 10.0, "thrust_kn": 1500.0, "burn_s": 120.0}
    orbit = rocket(stage, program=[[20.0, 60.0], [110.0, 0.0]], drag_coefficient=0.0)
    with pytest.raises(InputError, match=r"not back within 3 h after lift-off; give duration_s for an orbit"):
        orbit.trajectory()
    assert orbit.model_copy(update={"duration_s": 900.0}).trajectory().end == 900.0
