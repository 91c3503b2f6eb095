"""Arguments from Python, mangled: each call succeeds or is refused in the project's words."""

from __future__ import annotations

import copy
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from scenarios.support.lock_in_equation import angle_error, turnarounds
from scenarios.support.swaying import Sway, Swaying
from sinssim import alignment, earth, rotation
from sinssim.analyses.allan_deviation import allan_deviation
from sinssim.analyses.noise_fit import fit_noise
from sinssim.data import ImuData, Measurements, NavState
from sinssim.estimation import error_model
from sinssim.estimation.estimate import estimate
from sinssim.experiments.studies.study_schema import Study
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.compensation import compensate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.laser_gyro import LaserGyro
from sinssim.sensors.single_sensors import cube, emulate_accelerometers, gyro_free_increments
from sinssim.strapdown.one_component_system import gyro_error, simulate
from sinssim.truth.curve import Curve
from sinssim.truth.motions.analytic import OnEarth, inertial_increments
from sinssim.truth.motions.coning_and_rocking import classical_cone
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from tests.fuzz import mangle

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
STILL = Parked(0.8, 0.2, 100.0, LEVEL, 20.0)
IMU = STILL.increments(10.0)
START = STILL.state(0.0)
KNOTS = np.arange(0.0, 8.0)
PLACES = earth.geodetic_to_ecef(0.8 + 1e-6 * KNOTS, 0.2, 100.0)
FIX = Measurements(
    "gnss-velocity", np.arange(1.0, 20.0), np.arange(1.0, 20.0), np.zeros((19, 3)), np.full((19, 3), 0.1), np.zeros(3)
)
MODEL = error_model(ImuErrors(TriadErrors(random_walk=1e-6), TriadErrors(random_walk=1e-4)), imu=())

PART = {"title": "t", "motions": ({"scenario": "parked"},), "rates_hz": (1.0,)}
SECTION = Imu(grade="tactical")
SIGMA = alignment.expected_errors(SECTION).sigma
DETERMINED = alignment.determine(*alignment.ideal_readings(0.5, 0.1, 0.1, 0.8))
RING = LaserGyro(0.28, 1e-8, 633e-9, 1e-3, 7e-4, 400.0)  # small, so that a fast rotation makes few steps
CUBE = cube(0.1)
FELT = CUBE.feel(np.full((7, 6, 3), 9.8))

CALLS: dict[str, tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]] = {
    "navigate": (
        sinssim.navigate,
        (IMU, START),
        {"algorithm": "quaternion", "frame": "level", "gravity": "normal", "ellipsoid": "wgs84", "curvature": "exact",
         "rates_hz": (10.0, 5.0, 1.0), "vertical": "baro-loop", "height": np.full(201, 100.0),
         "baro_time_constant": 50.0, "slow_quantities": "hold"},
    ),
    "transverse": (sinssim.navigate, (IMU, START), {"frame": "transverse", "route": (0.8, 0.2, 0.9, 0.3)}),
    "emulate": (sinssim.emulate, (IMU, Imu(grade="tactical")), {"seed": 3}),
    "parked": (Parked, (0.8, 0.2, 100.0, LEVEL, 20.0), {"lever_arm": (1.0, 2.0, 3.0), "q_bs": LEVEL, "gravity": "j2"}),
    "parked state": (STILL.state, (np.array([0.0, 1.0]),), {}),
    "parked rates": (STILL.rates, (1.0,), {}),
    "parked increments": (STILL.increments, (10.0,), {}),
    "curve": (Curve, (KNOTS, PLACES, np.tile(LEVEL, (8, 1))), {"lever_arm": (1.0, 0.0, 0.0), "gravity": "normal"}),
    "great circle": (GreatCircle, (0.8, 0.2, 100.0, 0.5, 200.0, 20.0), {"lever_arm": (1.0, 0.0, 0.0)}),
    "on earth": (OnEarth, (classical_cone(0.01, 6.0), 0.8, 0.2, 100.0, LEVEL, 20.0), {"gravity": "normal"}),
    "cone": (inertial_increments, (classical_cone(0.01, 6.0), 100.0, 5.0), {}),
    "swaying": (Swaying, (0.8, 0.2, 100.0, 0.0, 0.0, 0.0, 20.0, [Sway("roll", 0.01, 0.3, 0.0)]), {}),
    "determine": (alignment.determine, (STILL.rates(0.0)[0], STILL.rates(0.0)[1]), {}),
    "session": (alignment.determine_session, (IMU,), {}),
    "instruments": (alignment.InstrumentErrors, (1e-8, 1e-5, 1e-4, 1e-5), {}),
    "ideal readings": (alignment.ideal_readings, (0.5, 0.1, 0.1, 0.8), {"gravity": 9.81}),
    "disturbed": (alignment.align_disturbed, (IMU,), {"latitude": 0.8}),
    "expected errors": (alignment.expected_errors, (SECTION,), {}),
    "error budget": (
        alignment.error_budget, ((0.5, 0.1, 0.1), 0.8, SIGMA, 300.0),
        {"method": "disturbed", "gravity": 9.81, "start": 10.0, "rate_hz": 10.0},
    ),
    "initial covariance": (
        alignment.initial_covariance, (DETERMINED, SIGMA, 300.0),
        {"height": 100.0, "latitude": 0.8, "position_sigma": (1.0, 2.0, 3.0), "velocity_sigma": (0.1, 0.1, 0.1),
         "method": "quiet", "rate_hz": 10.0, "states": ["gyro bias right"]},
    ),
    "error model": (
        error_model, (SIGMA,),
        {"position": (1.0, 2.0, 3.0), "velocity": 0.1, "attitude": 1e-3, "imu": ["gyro bias"], "extra": (),
         "duration": 100.0},
    ),
    "turnarounds": (turnarounds, (RING, 5, np.random.default_rng(1)), {"randomised": "one", "spread": 1.0}),
    "lock-in": (angle_error, (RING, 1e-3, np.array([-7e-4, 7e-4, -7e-4])), {"phase": 1.0, "step": 0.5}),
    "accelerometers": (
        emulate_accelerometers, (KNOTS, np.full((7, 6, 3), 9.8), CUBE.direction, SECTION), {"seed": 3},
    ),
    "gyro-free": (gyro_free_increments, (KNOTS, FELT, CUBE, np.array([1e-5, 0.0, 1e-5])), {}),
    "allan": (allan_deviation, (np.random.default_rng(1).standard_normal(100), 0.1), {"samples": [1, 2, 4]}),
    "compensate": (compensate, (IMU, ImuErrors(TriadErrors(), TriadErrors())), {}),
    "estimate": (estimate, (IMU, START, [FIX], MODEL), {"loop": "closed", "rate_hz": 1.0, "gate": 1e-4}),
    "imu section": (Imu, (), {"grade": "tactical", "rate_hz": 100.0, "gyro_bias_deg_h": (1.0, 2.0, 3.0)}),
    "study": (Study, (), {"name": "x", "parts": (PART,)}),
    "load": (sinssim.load_scenario, ("parked",), {"overrides": ["imu.rate_hz=10"]}),
    "fit noise": (fit_noise, (np.random.default_rng(2).standard_normal(256) * 1e-6, 0.1), {"correlation_time": 5.0}),
    "one component": (simulate, (KNOTS, 1e-6 * KNOTS[1:], np.full((7, 2), 9.8)), {"velocity": 1.0, "radius": 6.4e6}),
    "schuler": (gyro_error, (KNOTS, 1e-8), {}),
    "multiply": (rotation.multiply, (LEVEL, LEVEL), {}),
    "rotate": (rotation.rotate, (LEVEL, np.ones(3)), {}),
    "normalize": (rotation.normalize, (LEVEL,), {}),
    "euler": (rotation.quaternion_from_euler, (0.1, 0.2, 0.3), {}),
    "to ecef": (earth.geodetic_to_ecef, (0.8, 0.2, 100.0), {}),
    "to geodetic": (earth.ecef_to_geodetic, (PLACES,), {}),
    "gravity": (earth.gravity_ned, (0.8, 100.0), {"model": "normal"}),
}  # fmt: skip


def instead(rng: np.random.Generator, sound: Any) -> Any:
    """Return something in place of a sound argument: of another kind, or of its kind with something wrong in it."""
    kind = int(rng.integers(0, 10))
    if kind < 3:
        others: tuple[Any, ...] = (
            None, "text", b"bytes", object(), {}, set(), [], (), [[1.0, 2.0], [3.0]], [None], ["a", "b"], 1j,
            np.array(["2020-01-01"], "M8[s]"), np.array([1], "m8[s]"), np.ones(3, complex), np.ones(3, bool), True,
            np.ma.masked_array([1.0, 2.0, 3.0], [0, 1, 0]), np.ma.masked, np.array([1, "a", None], object), np.nan, 1e9,
            1e308, -1e308, 10**400, 0, -1, np.float32(1.0), np.int8(3), Fraction(1, 3), Path("x"), len, float,
            np.zeros(0),
            np.zeros((0, 3)), np.ones((3, 3, 3)), np.array(1.0), np.zeros(1, [("a", float)]), range(3), iter([1.0]),
        )  # fmt: skip
        return others[rng.integers(len(others))]
    if kind == 3:
        return mangle.value(rng)
    if isinstance(sound, ImuData | NavState | Measurements):
        fields = list(vars(sound))
        wrong = copy.copy(sound)
        field = fields[rng.integers(len(fields))]
        object.__setattr__(wrong, field, instead(rng, getattr(sound, field)))
        return wrong
    if isinstance(sound, np.ndarray) and sound.dtype.kind == "f":
        array = sound.copy()
        deeds: tuple[Callable[[], Any], ...] = (
            array.tolist, lambda: array[:-1] if array.ndim else array, lambda: array[..., None], lambda: array.T,
            lambda: np.asfortranarray(array), lambda: array.astype(np.float32), lambda: array.astype(object),
            lambda: np.ma.masked_array(array), lambda: np.clip(array, -1e100, 1e100) * 1e200,
            lambda: array[::-1] if array.ndim else array,
            lambda: array * np.nan, lambda: np.array(array, copy=True, subok=False).astype(complex), lambda: -array,
            lambda: np.repeat(array[..., None], 2, -1)[..., 0],
        )  # fmt: skip
        with np.errstate(all="ignore"):  # a second mangling may overflow
            found = deeds[rng.integers(len(deeds))]()
        if isinstance(found, np.ndarray) and rng.integers(2):
            found.flags.writeable = False
        return found
    if isinstance(sound, list | tuple) and sound:
        parts = list(sound)
        k = int(rng.integers(len(parts)))
        parts[k] = instead(rng, parts[k])
        return type(sound)(parts) if rng.integers(2) else parts
    return mangle.NUMBERS[rng.integers(len(mangle.NUMBERS))] if isinstance(sound, int | float) else None


def calls(count: int, seed: int) -> mangle.Verdict:
    """Mangle one or two arguments of calls."""
    verdict, names = mangle.Verdict(), list(CALLS)
    for k in range(count):
        rng = np.random.default_rng((seed, k))
        name = names[k % len(names)]
        function, unnamed, named = CALLS[name]
        arguments, options = list(unnamed), {key: named[key] for key in named if rng.integers(2)}
        for _ in range(rng.choice([1, 1, 2])):
            which = int(rng.integers(len(arguments) + len(named)))
            if which < len(arguments):
                arguments[which] = instead(rng, arguments[which])
            else:
                key = list(named)[which - len(arguments)]
                options[key] = instead(rng, named[key])
        with np.errstate(all="ignore"):
            verdict.judge(
                lambda f=function, a=arguments, o=options: f(*a, **o), lambda k=k, n=name: f"case {seed, k}, {n}"
            )
    return verdict


def test_every_call_is_sound_as_it_stands() -> None:
    for function, unnamed, named in CALLS.values():
        if function is not alignment.align_disturbed:  # which wants a minute, and says so
            function(*unnamed, **named)


def test_mangled_arguments() -> None:
    calls(120, 1).must_be_sound()


@pytest.mark.slow
def test_fifty_thousand_mangled_arguments() -> None:
    calls(50_000, 2).must_be_sound()
