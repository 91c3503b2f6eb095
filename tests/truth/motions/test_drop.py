"""A store that its carrier releases: the fall by equations of motion in other axes, closure, the fins, refusals."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import sinssim
from sinssim.errors import InputError
from sinssim.rotation.quaternions import euler_from_quaternion
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.planned_limits import expected_duration, limit_notes
from sinssim.scenario.true_motion import fly
from sinssim.truth.atmosphere import density
from sinssim.truth.motions.drop import Drop, Released
from tests.oracles import integrator as oracle
from tests.truth.motions import ecef

CARRIER = {"latitude_deg": 41.0, "longitude_deg": 2.0, "altitude_m": 2000.0, "course_deg": 60.0, "speed_mps": 200.0,
           "duration_s": 40.0}  # fmt: skip
SPIN = np.array([0.0, 0.0, oracle.OMEGA])


def dropped(carrier: dict[str, Any] | None = None, imu: dict[str, Any] | None = None, **drop: Any) -> Released:
    scenario = Scenario.model_validate({
        "name": "d", "great_circle": {**CARRIER, **(carrier or {})}, "drop": {"release_s": 20.0, **drop},
        "imu": imu or {},
    })  # fmt: skip
    motion = fly(scenario)
    assert isinstance(motion, Released)
    return motion


@pytest.fixture(scope="module")
def bomb() -> Released:
    return dropped(imu={"lever_arm_m": (1.0, 3.0, 0.5), "mounting_deg": (10.0, -20.0, 30.0)})


@pytest.fixture(scope="module")
def missile() -> Released:
    motor = {"propellant_kg": 60.0, "thrust_kn": 15.0, "burn_s": 5.0, "ignition_s": 1.5}
    return dropped(motor=motor, ground_m=500.0)


def test_the_fall_is_that_of_the_equations_of_motion(bomb: Released) -> None:
    """r̈ = γ − 2ω × v − ω × (ω × r) − ½ C_D A ρ |v| v/m in Earth-fixed axes, with the zonal harmonics to J20."""
    release, end = 20.0, bomb.end
    assert end == pytest.approx(release + 20.4, abs=0.3)
    r, v, _ = ecef(bomb, np.array([release, 0.5 * (release + end), end]))

    def fall(t: float, y: np.ndarray) -> np.ndarray:
        height = oracle_height(y[:3])
        drag = 0.5 * 0.15 * 0.25 * np.pi * 0.273**2 * density(height) * np.linalg.norm(y[3:]) / 227.0
        turning = 2.0 * np.cross(SPIN, y[3:]) + np.cross(SPIN, np.cross(SPIN, y[:3]))
        return np.concatenate([y[3:], oracle.gravitation(*y[:3], oracle.ZONAL) - turning - drag * y[3:]])

    there = solve_ivp(
        fall, (release, end), np.concatenate([r[0], v[0]]), "LSODA", t_eval=[0.5 * (release + end), end], rtol=1e-12,
        atol=1e-9,
    )  # fmt: skip
    np.testing.assert_allclose(there.y[:3].T, r[1:], atol=1e-4)
    np.testing.assert_allclose(there.y[3:].T, v[1:], atol=1e-5)
    assert oracle_height(there.y[:3, -1]) == pytest.approx(0.0, abs=1e-4)


def oracle_height(r: np.ndarray) -> float:
    """Return the height above the ellipsoid, m, by Newton's method on its normal."""
    p, z, e2 = np.hypot(r[0], r[1]), r[2], oracle.F * (2.0 - oracle.F)
    latitude = np.arctan2(z, p * (1.0 - e2))
    for _ in range(4):
        n = oracle.A / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
        latitude = np.arctan2(z + e2 * n * np.sin(latitude), p)
    return float(p * np.cos(latitude) + z * np.sin(latitude) - oracle.A * np.sqrt(1.0 - e2 * np.sin(latitude) ** 2))


@pytest.mark.parametrize(("kind", "jumps"), [("bomb", []), ("missile", [21.5, 26.5])])
def test_increments_lead_back_to_the_truth(kind: str, jumps: list[float], request: pytest.FixtureRequest) -> None:
    """The independent integrator, begun anew where the force jumps: release, ignition, burn-out."""
    motion: Released = request.getfixturevalue(kind)
    imu = motion.increments(400.0)
    position, velocity, c = ecef(motion, imu.time)
    marks = [0, *(round(400.0 * time) for time in (20.0, *jumps)), len(imu.time) - 1]
    for a, b in pairwise(marks):
        q = Rotation.from_matrix(c[a]).as_quat(scalar_first=True)
        there, speed, turned = oracle.integrate(
            imu.time[a : b + 1], imu.dtheta[a:b], imu.dvel[a:b], position[a], velocity[a], q
        )
        assert np.linalg.norm(there - position[a : b + 1], axis=1).max() < 1e-5
        assert np.linalg.norm(speed - velocity[a : b + 1], axis=1).max() < 1e-6
        assert Rotation.from_matrix(turned[-1] @ c[b].T).magnitude() < 1e-9


def test_nothing_jumps_at_the_release_but_the_force(bomb: Released) -> None:
    """Place, velocity, attitude and rate; the force is that of the drag then, along the flow."""
    time = 20.0 + np.array([-1e-7, 1e-7])
    r, v, c = ecef(bomb, time)
    np.testing.assert_allclose(r[1] - r[0], 2e-7 * v[0], atol=1e-8)
    np.testing.assert_allclose(v[1], v[0], atol=1e-5)
    np.testing.assert_allclose(c[1], c[0], atol=1e-9)
    omega, force = bomb.rates(time)
    np.testing.assert_allclose(omega[1], omega[0], atol=1e-6)
    drag = 0.5 * 0.15 * 0.25 * np.pi * 0.273**2 * density(bomb.state(20.0).height) / 227.0
    np.testing.assert_allclose(c[1] @ force[1], -drag * np.linalg.norm(v[1]) * v[1], rtol=1e-5)


def test_a_release_within_a_sample_loses_nothing() -> None:
    """The integrals over 0.1 s are sums of those over 0.01 s, although the release is within both."""
    motion = dropped(release_s=20.034, ground_m=1500.0)
    slow, fast = motion.increments(10.0), motion.increments(1000.0)
    for name in ("dtheta", "dvel"):
        of_fast = getattr(fast, name)[: 100 * len(slow.dvel)].reshape(-1, 100, 3).sum(axis=1)
        np.testing.assert_allclose(getattr(slow, name), of_fast, atol=1e-10)


def test_the_fins_turn_it_into_the_flow() -> None:
    """It swings with the frequency of the fins at the release, and lags behind the path's turn by 2ζγ̇/Ω in the end."""
    calm = dropped(fins_damping=0.02, fins_hz=0.3)
    time = np.arange(20.0, 24.0, 0.01)

    def attack(motion: Released, at: np.ndarray) -> np.ndarray:
        state = motion.state(at)
        north, east, down = state.velocity_ned.T
        return np.asarray(euler_from_quaternion(state.q_nb)[1] + np.arctan2(down, np.hypot(north, east)))

    angle = attack(calm, time)
    swing = 2.0 * np.pi * 0.3 * np.sqrt(density(2000.0) / density(0.0)) * 2.0
    quarter = time[np.argmax(angle)] - 20.0
    assert quarter == pytest.approx(0.5 * np.pi / swing, rel=0.1)
    assert angle.max() == pytest.approx(9.81 / 200.0 / swing, rel=0.1)  # that of an impulse of the rate g/v
    damped = dropped(fins_damping=0.7)
    late = np.array([damped.end - 1.0, damped.end])
    state = damped.state(late)
    north, _, down = np.moveaxis(state.velocity_ned, 1, 0)
    path = np.arctan2(down, np.hypot(north, state.velocity_ned[:, 1]))
    speed = np.linalg.norm(state.velocity_ned, axis=1).mean()
    end_swing = 2.0 * np.pi * 0.6 * speed / 100.0 * np.sqrt(density(state.height.mean()) / density(0.0))
    lag = attack(damped, late).mean()
    assert lag == pytest.approx(2.0 * 0.7 * (path[1] - path[0]) / end_swing, rel=0.05)


def test_its_motor_gives_thrust_per_mass(missile: Released) -> None:
    """15 kN on 227 kg, on 167 kg at the end; then drag alone."""
    force = missile.rates(np.array([21.5 + 1e-9, 26.5 - 1e-9, 26.5 + 1e-9]))[1][:, 0]
    before = missile.rates(np.array([21.5 - 1e-9]))[1][0, 0]
    assert force[0] - before == pytest.approx(15_000.0 / 227.0, rel=1e-6)
    assert force[1] - force[2] == pytest.approx(15_000.0 / 167.0, rel=1e-6)
    texts = {event.text: event.time for event in missile.events}
    assert texts["ignition of the motor"] == 21.5
    assert texts["burn-out of the motor"] == 26.5
    assert missile.state(missile.end).height == pytest.approx(500.0, abs=1e-6)


@pytest.mark.slow
def test_the_run_of_the_shipped_scenario() -> None:
    """With transfer alignment the fall adds a metre, without it more than a hundred."""
    result = sinssim.run(load_scenario("bomb_drop", ["recording.keep=summary"]))
    phases = result.summary["phases"]
    assert [phase["phase"] for phase in phases["aided"]] == ["flight", "fall"]
    aided, free = (phases[name][-1]["horizontal_added_m"] for name in ("aided", "quaternion"))
    assert aided < 5.0 < 50.0 < free
    assert expected_duration(result.scenario) == pytest.approx(result.summary["end_s"], rel=0.02)


def test_a_run_ends_on_the_ground_and_the_master_stays_on_the_carrier() -> None:
    """20 s of 5 readings a second; the last sample is up to 20 ms before the impact."""
    scenario = Scenario.model_validate({
        "name": "d", "great_circle": CARRIER, "drop": {"release_s": 20.0}, "filter": {}, "aiding": {"master": {}},
        "imu": {"grade": "tactical", "rate_hz": 50.0}, "recording": {"keep": "summary"},
    })  # fmt: skip
    result = sinssim.run(scenario)
    assert 0.0 < result.truth.state.height[-1] < 4.0
    assert [phase["phase"] for phase in result.summary["phases"]["aided"]] == ["carried", "fall"]
    assert result.summary["filter"]["sensors"]["master-velocity"]["readings"] == 20 * scenario.aiding.master.rate_hz
    assert expected_duration(scenario) == pytest.approx(result.summary["end_s"], rel=0.02)
    assert result.truth.trajectory.events[-1].text.startswith("impact with 2")


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (
            {"drop": {"release_s": 50.0}},
            r"drop\.release_s = 50 is after the motion of the carrier, \[great_circle\], which lasts 40 s",
        ),
        ({"drop": {"ground_m": 2500.0}}, r"drop\.ground_m = 2500: at the release the carrier is at 2000 m"),
        ({"drop": {"diameter_m": 5.0, "mass_kg": 20.0}}, r"mass_kg = 20 is too light for a drag area of 2\.95 m²"),
        (
            {"drop": {"motor": {"propellant_kg": 300.0, "thrust_kn": 1.0, "burn_s": 1.0}}},
            r"propellant_kg = 300 is a part",
        ),
        ({"aiding": {"airspeed": {}}, "filter": {}}, r"\[aiding\.airspeed\] is a sensor of the carrier"),
        ({"gravity": {"model": "egm2008"}}, r"\[drop\] falls in the gravity of \[truth\]"),
        (
            {"great_circle": None, "parked": {"latitude_deg": 3.0, "duration_s": 60.0}},
            r"\[drop\] needs a carrier that moves in the air, which \[parked\] is not",
        ),
    ],
)
def test_what_nothing_drops_is_refused(keys: dict[str, Any], words: str) -> None:
    plain = {"name": "d", "great_circle": CARRIER}
    with pytest.raises((InputError, ValueError), match=words):
        fly(Scenario.model_validate({**plain, **keys, "drop": {"release_s": 20.0, **keys.get("drop", {})}}))


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("flight.wind.north_mps=5.0", r"flight\.wind moves or warms the air"),
        ("flight.guidance.source=aided", r'guidance\.source = "aided" steers the carrier by the navigator of the bomb'),
    ],
)
def test_what_the_carrier_of_a_bomb_does_not_do_is_refused(setting: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_scenario("bomb_drop", [setting])


def test_a_release_after_the_flight_is_refused() -> None:
    """The duration of a flight is known when it has been flown: of a trajectory alone."""
    carrier = Scenario.model_validate({"name": "d", "great_circle": CARRIER}).source.trajectory()  # type: ignore[union-attr]
    with pytest.raises(
        InputError, match=r"drop\.release_s = 41 is after the motion of the carrier, which ends after 40 s"
    ):
        Released(carrier, Drop(release_s=41.0), np.array([1.0, 0.0, 0.0, 0.0]))


def test_a_release_after_the_flight_is_noted_before_it_is_flown() -> None:
    scenario = load_scenario("bomb_drop")
    assert scenario.flight is not None
    assert not list(limit_notes(scenario))
    lasts = scenario.flight.duration(scenario.truth)
    (note,) = limit_notes(load_scenario("bomb_drop", [f"drop.release_s={1.3 * lasts}"]))
    assert note.startswith(
        f"drop.release_s = {1.3 * lasts:g} is after the flight, which lasts about {lasts:.0f} s by its"
    )
