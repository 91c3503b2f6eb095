"""What a person passes from Python: taken if it is clear, otherwise refused by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import sinssim
from scenarios.support.lock_in_equation import angle_error, turnarounds
from sinssim import alignment, rotation
from sinssim.arguments import POSITIVE, check_kind, names, number, numbers, vector
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.estimation import error_model
from sinssim.estimation.state_model import Block
from sinssim.experiments.studies.study_schema import Study
from sinssim.rotation import quaternions
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.laser_gyro import LaserGyro
from sinssim.sensors.single_sensors import cube, emulate_accelerometers, gyro_free_increments
from sinssim.strapdown.frames import level
from sinssim.truth.motions.parked_and_great_circle import Parked

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
STILL = Parked(0.8, 0.2, 100.0, LEVEL, 10.0)
SECTION = Imu(grade="tactical")
SIGMA = alignment.expected_errors(SECTION).sigma
PARKED = alignment.Attitude(0.5, 0.1, 0.1)
DETERMINED = alignment.determine(*alignment.ideal_readings(*PARKED, 0.8))
RING = LaserGyro(0.28, 3.5e-3, 633e-9, 1e-3, 7e-4, 400.0)
CUBE, TIME = cube(0.1), np.arange(8.0)
FORCE, EARTH = np.full((7, 6, 3), 9.8), np.array([1e-5, 0.0, 1e-5])
IMU, START = STILL.increments(10.0), STILL.state(0.0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (None, "x = None is not an array of numbers"),
        ("many", "x = 'many' is not an array of numbers: it holds text"),
        (["1", "2"], "it holds text"),
        ([[1.0, 2.0], [3.0]], "is not an array of numbers: setting an array element with a sequence"),
        ([1.0, None], "is not an array of numbers"),
        (1j * np.ones(3), "it holds complex numbers"),
        (np.array([True, False]), "it holds true and false"),
        (np.array(["2024-01-01"], "M8[D]"), "it holds dates or times"),
        (np.ma.masked_array([1.0, 2.0], [0, 1]), "x is a masked array with values masked out; fill them"),
        ([1.0, np.ma.masked], "a value is masked out"),
        (10**400, "is not an array of numbers"),
    ],
)
def test_what_is_no_array_of_numbers_is_said(given: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        numbers("x", given)


@pytest.mark.parametrize(
    "given",
    [[1, 2, 3], (1.0, 2.0, 3.0), range(1, 4), np.array([1, 2, 3], np.int8), np.ma.masked_array([1.0, 2.0, 3.0])],
)
def test_what_converts_cleanly_is_taken(given: Any) -> None:
    found = numbers("x", given)
    assert type(found) is np.ndarray
    assert found.dtype == np.float64
    assert found.tolist() == [1.0, 2.0, 3.0]


def test_one_number_and_a_vector() -> None:
    assert number("x", np.float32(2.0)) == 2.0
    assert number("x", np.array(3)) == 3.0
    for wrong, said in (
        ("2", "x = '2' must be one positive number, s."),
        ([2.0], "must be one"),
        (0.0, "x = 0.0 must"),
    ):
        with pytest.raises(InputError, match=said):
            number("x", wrong, "s", low=POSITIVE)
    with pytest.raises(InputError, match=r"x = 7 must be one finite number from 1 to 5, m"):
        number("x", 7, "m", low=1.0, high=5.0)
    with pytest.raises(InputError, match=r"x = \[1.0, nan, 2.0\] must be 3 finite numbers, m"):
        vector("x", [1.0, np.nan, 2.0], 3, "m")


def test_lists_are_taken_where_arrays_are_meant() -> None:
    lists = ImuData(IMU.time.tolist(), IMU.dtheta.tolist(), IMU.dvel.tolist())  # type: ignore[arg-type]
    expected = sinssim.navigate(IMU, START)
    found = sinssim.navigate(lists, replace(START, q_nb=START.q_nb.tolist()))
    np.testing.assert_array_equal(found.q_nb, expected.q_nb)
    np.testing.assert_array_equal(
        sinssim.emulate(lists, Imu(grade="tactical"), seed=1).dvel,
        sinssim.emulate(IMU, Imu(grade="tactical"), seed=1).dvel,
    )


def frozen(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    array = array.copy()
    array.flags.writeable = False
    return array


def test_read_only_arrays_compile_nothing_anew() -> None:
    """numba takes a read-only array for another type, and compiles a kernel for it: half a minute of waiting."""
    sinssim.navigate(IMU, START)
    rotation.multiply(np.tile(LEVEL, (3, 1)), np.tile(LEVEL, (3, 1)))
    kernels = (level.engine("quaternion"), quaternions._multiply_rows)
    before = [len(kernel.signatures) for kernel in kernels]
    sinssim.navigate(ImuData(frozen(IMU.time), frozen(IMU.dtheta), frozen(IMU.dvel)), START)
    sinssim.navigate(ImuData(IMU.time, np.asfortranarray(IMU.dtheta), IMU.dvel[::1]), START)
    rotation.multiply(frozen(np.tile(LEVEL, (3, 1))), LEVEL)
    rotation.multiply(LEVEL, LEVEL)
    assert [len(kernel.signatures) for kernel in kernels] == before


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: Parked(np.nan, 0.0, 0.0, LEVEL, 1.0), "latitude = nan must be one finite number, rad"),
        (lambda: Parked(0.8, None, 0.0, LEVEL, 1.0), "longitude = None must be one finite number"),
        (lambda: Parked(0.8, 0.0, np.inf, LEVEL, 1.0), "height = inf must be one finite number"),
        (lambda: Parked(0.8, 0.0, 0.0, [1.0, 0.0, np.nan, 0.0], 1.0), "q_nb = .* must be 4 finite numbers"),
        (lambda: Parked(0.8, 0.0, 0.0, np.zeros(4), 1.0), "must be a quaternion of unit norm"),
        (lambda: Parked(0.8, 0.0, 0.0, LEVEL, "long"), "duration = 'long' must be one positive number, s"),
        (lambda: STILL.increments(None), "rate_hz = None must be one positive number"),
        (lambda: STILL.increments(1e12), r"rate_hz = 1e\+12 gives 1e\+13 samples .* a rate of at most .* Hz"),
        (lambda: STILL.state("now"), "t = 'now' is not an array of numbers"),
        (lambda: sinssim.navigate(None, START), "imu must be ImuData"),
        (lambda: sinssim.navigate(IMU, None), "initial must be NavState"),
        (lambda: sinssim.navigate(IMU, START, algorithm=["quaternion"]), "unknown algorithm"),
        (lambda: sinssim.navigate(IMU, START, rates_hz=100.0), "rates_hz = 100.0 must be three finite numbers, Hz"),
        (lambda: sinssim.emulate(IMU, None), "does not describe a sensor block"),
        (lambda: sinssim.load_scenario("parked", 3), "overrides = 3 must be a list of settings"),
    ],
)
def test_wrong_arguments_are_named(call: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        call()


def test_sections_answer_as_a_scenario_does() -> None:
    with pytest.raises(InputError, match=r"Imu: rate_hz must be a number, not the text 'x'\."):
        Imu(rate_hz="x")
    with pytest.raises(InputError, match=r"unknown key 'grde'\. Did you mean 'grade'\?"):
        Imu(grde="tactical")
    with pytest.raises(InputError, match=r"laser_gyro\.area_mm2 is missing"):
        Imu(laser_gyro={"perimeter_mm": 280.0})
    with pytest.raises(InputError, match="takes its values by name"):
        Imu("tactical")
    with pytest.raises(InputError, match=r"Study: parts.1.motions is missing \(true motions\)"):
        Study(name="x", parts=[{"title": "a"}])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: alignment.expected_errors("tactical"), r"imu must be Imu, for example .* not 'tactical'"),
        (lambda: alignment.error_budget(None, 0.8, SIGMA, 300.0), "attitude = None must be Attitude"),
        (lambda: alignment.error_budget(PARKED, "0.8", SIGMA, 300.0), "latitude = '0.8' is not an array of numbers"),
        (lambda: alignment.error_budget(PARKED, 0.8, SECTION, 300.0), "sigma must be ImuErrors of standard"),
        (lambda: alignment.error_budget(PARKED, 0.8, SIGMA, np.array([1], "m8[s]")), "duration is not an array"),
        (lambda: alignment.error_budget(PARKED, 0.8, SIGMA, np.inf), "length must be positive and finite"),
        (
            lambda: alignment.error_budget(PARKED, [0.8, 0.7], SIGMA, [1.0, 2.0, 3.0]),
            r"latitude and gravity \(2,\), dura",
        ),
        (lambda: alignment.error_budget(PARKED, 0.8, SIGMA, 300.0, method="quite"), "Did you mean 'quiet'"),
        (
            lambda: alignment.error_budget(PARKED, 0.8, ImuErrors(TriadErrors(bias=[-1.0, 0, 0])), 9.0),
            "1σ of gyro bias",
        ),
        (lambda: TriadErrors(bias=None), "TriadErrors: bias = None is not an array of numbers"),
        (lambda: alignment.initial_covariance(None, SIGMA, 300.0), "determination must be a Determination"),
        (lambda: alignment.initial_covariance(DETERMINED, SIGMA, None), "duration = None must be one positive number"),
        (
            lambda: alignment.initial_covariance(DETERMINED, SIGMA, 300.0, position_sigma=5.0),
            "must be 3 finite numbers",
        ),
        (lambda: alignment.initial_covariance(DETERMINED, SIGMA, 300.0, states="roll"), "must be a list of names"),
        (lambda: alignment.initial_covariance(DETERMINED, SIGMA, 300.0, states=["rol"]), "unknown state 'rol'"),
        (lambda: alignment.initial_state(DETERMINED, None, 0.0), "longitude = None must be one finite number"),
        (lambda: error_model(None), "sigma must be ImuErrors of standard deviations"),
        (lambda: error_model(SIGMA, position=[[1.0], [1.0, 2.0]]), "'position': sigma is not an array of numbers"),
        (lambda: error_model(SIGMA, imu="gyro bias"), "imu = 'gyro bias' must be a list of names"),
        (lambda: error_model(SIGMA, duration="long"), "duration = 'long' must be one positive number"),
        (lambda: error_model(SIGMA, extra=["wind"]), "a block of an error model must be Block"),
        (lambda: error_model(SIGMA, extra=np.array(1.0)), r"extra = array\(1.\) must be a list of blocks"),
        (lambda: Block(None, 1.0), "unknown block of states None"),
        (lambda: turnarounds(RING, 2.5, np.random.default_rng(1)), "swings = 2.5 must be a whole number"),
        (lambda: turnarounds(RING, 5, 1), "rng must be a numpy.random.Generator"),
        (lambda: angle_error(None, 0.0, [0.0, 1.0]), "gyro must be LaserGyro, not None"),
        (lambda: angle_error(RING, 1j, [0.0, 1.0]), "rate = 1j must be one finite number, rad/s"),
        (lambda: angle_error(RING, 0.0, ["a", "b"]), "angles is not an array of numbers: it holds text"),
        (lambda: angle_error(RING, 1e9, [0.0, 1.0]), "needs more than .* steps over 1 swings; use a lower rate"),
        (
            lambda: emulate_accelerometers(TIME, None, CUBE.direction, SECTION),
            "force = None is not an array of numbers",
        ),
        (lambda: emulate_accelerometers(TIME, FORCE, 2.0 * CUBE.direction, SECTION), "must be unit vectors"),
        (lambda: emulate_accelerometers(TIME, FORCE, CUBE.direction, None), "imu must be Imu"),
        (lambda: emulate_accelerometers(TIME, FORCE, CUBE.direction, SECTION, errors=[None, None]), "each of errors"),
        (lambda: gyro_free_increments(TIME, FORCE[:, 0], CUBE, EARTH), r"got shapes \(8,\), \(7, 3\)"),
        (lambda: gyro_free_increments(TIME, CUBE.feel(FORCE) * np.nan, CUBE, EARTH), r"dvel\[0\] = .* not a finite"),
        (lambda: gyro_free_increments(TIME, CUBE.feel(FORCE), "cube", EARTH), "layout must be an AccelerometerSet"),
        (lambda: gyro_free_increments(TIME, CUBE.feel(FORCE), CUBE, 1e-5), "rate = .* must be 3 finite numbers, rad/s"),
    ],
)
def test_wrong_arguments_of_budgets_models_and_sensors_are_named(call: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        call()


def test_budgets_models_and_sensors_take_lists() -> None:
    listed = ImuErrors(
        TriadErrors(**{name: np.asarray(v).tolist() for name, v in vars(SIGMA.gyro).items()}), SIGMA.accel
    )
    expected = alignment.error_budget(PARKED, 0.8, replace(listed, gyro=SIGMA.gyro), 300.0)
    assert alignment.error_budget(list(PARKED), 0.8, listed, 300) == expected
    assert error_model(listed, velocity=[1, 1, 1]).gyro_noise == SIGMA.gyro.random_walk
    np.testing.assert_array_equal(
        angle_error(RING, np.float32(0.0), [-7e-4, 7e-4, -7e-4]), angle_error(RING, 0, np.array([-7e-4, 7e-4, -7e-4]))
    )
    np.testing.assert_array_equal(
        emulate_accelerometers(TIME.tolist(), FORCE.tolist(), CUBE.direction.tolist(), SECTION, np.int8(3)),
        emulate_accelerometers(TIME, FORCE, CUBE.direction, SECTION, 3),
    )
    felt = CUBE.feel(FORCE)
    found = gyro_free_increments(TIME.tolist(), felt.tolist(), CUBE, EARTH.tolist())
    np.testing.assert_array_equal(found.dvel, gyro_free_increments(TIME, felt, CUBE, EARTH).dvel)


def test_kinds_and_names() -> None:
    with pytest.raises(InputError, match=r"x must be float, not 'a'\."):
        check_kind("x", "a", float)
    assert names("x", "part", ("a", "b"), ["a", "b", "c"]) == ["a", "b"]
    for wrong, said in ((None, "x = None must be a list of names: a, b"), (["d"], "unknown part 'd'"), ([1], "part 1")):
        with pytest.raises(InputError, match=said):
            names("x", "part", wrong, ["a", "b"])
