"""Readings that are stamped too late: H of the delay and of the errors before, against differences of the engine."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError
from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.error_dynamics import driving_noise
from sinssim.estimation.estimate import estimate
from sinssim.estimation.filter_result import corrected
from sinssim.estimation.linearisation import Linearisation, Surroundings, linearise, near
from sinssim.estimation.measurement_epochs import take_in
from sinssim.sensors.imu.compensation import MeanGyroRates
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.strapdown.navigate import navigate
from tests.estimation.drives import drive
from tests.estimation.worlds import positions, velocities

MODEL = ErrorModel(
    (
        *(Block(name, 1.0) for name in ("position", "velocity", "attitude", "gyro bias", "accelerometer bias")),
        Block("gnss lever arm", 1.0),
        Block("gnss time offset", 1.0),
        Block("gnss-velocity delay", 1.0),
    ),
    1e-4,
    1e-3,
)
ARM = np.array([0.4, -0.3, -1.0])
TIME = np.arange(18.0, 45.0, 1.3)


def world() -> tuple[ImuData, NavState, list[Measurements]]:
    trajectory, ideal = drive(50.0, 50.0, False)
    rng = np.random.default_rng(1)
    given = [positions(trajectory, TIME, rng), velocities(trajectory, TIME, rng)]
    for m in given:
        m.lever_arm[:] = ARM
    return ideal, trajectory.state(0.0), given


def line(initial: NavState, offset: float, delay: float) -> Linearisation:
    """Return the linearisation about navigation from a state, with these compensated delays."""
    imu, _, given = world()
    readings, epochs = take_in(given, MODEL, imu.time, 10.0)
    around = Surroundings(MODEL, driving_noise(MODEL), epochs, readings, MeanGyroRates(imu), "normal", WGS84, False)
    known = {block.name: np.zeros(block.size) for block in MODEL.blocks[3:]}
    known |= {"gnss time offset": np.array([offset]), "gnss-velocity delay": np.array([delay])}
    nominal = navigate(imu, initial)
    return linearise(around, 0, len(epochs.time) - 1, nominal, ImuErrors(), known)


def stacked(found: Linearisation, sensor: int) -> tuple[Array, Array, list[int]]:
    """Return residuals and H of a sensor, and the epochs."""
    rows = [(epoch, one) for epoch, many in found.observed.items() for one in many if one.sensor == sensor]
    rows.sort(key=lambda row: row[0])
    return np.array([o.residual for _, o in rows]), np.array([o.h for _, o in rows]), [e for e, _ in rows]


@pytest.mark.parametrize(
    ("sensor", "block"), [(0, "gnss time offset"), (1, "gnss time offset"), (1, "gnss-velocity delay")]
)
@pytest.mark.parametrize("offset", [0.0, 0.26, -0.11])
def test_h_of_a_delay_is_the_derivative(sensor: int, block: str, offset: float) -> None:
    """The state is the true delay less the compensated one. The slope over ±0.05 s is that over ±0.1 s to a thousandth
    of the largest."""
    _, initial, _ = world()
    step = 0.05
    own = {"gnss time offset": (1.0, 0.0), "gnss-velocity delay": (0.0, 1.0)}[block]
    more, less = (line(initial, offset + s * own[0], s * own[1]) for s in (step, -step))
    slope = -(stacked(more, sensor)[0] - stacked(less, sensor)[0]) / (2.0 * step)
    h = stacked(line(initial, offset, 0.0), sensor)[1][:, :, MODEL.slices[block]][:, :, 0]
    np.testing.assert_allclose(h, slope, atol=1e-6 * np.abs(slope).max())
    exact, _ = drive(50.0, 50.0, False)
    if sensor == 0:  # it is the antenna's velocity, seen at the arm
        speed = exact.state(TIME - offset).velocity_ned
        assert np.abs(np.linalg.norm(h, axis=1) - np.linalg.norm(speed, axis=1)).max() < 1.5


@pytest.mark.parametrize("delay", [0.2, -0.15])
def test_h_refers_to_the_errors_at_the_stamp(delay: float) -> None:
    """Errors at the start change the residuals by H Φ x, with H of the stamped instant and Φ up to it.

    To one percent, since the specific force turns within the delay; without the step back it would be up to 15 %.
    """
    _, initial, _ = world()
    nominal = line(initial, delay, 0.0)
    phi = np.eye(MODEL.size)
    transition = []
    for k in range(len(nominal.interval)):
        phi = nominal.phi[k] @ phi
        transition.append(phi)
    for state, size in ((0, 1.0), (3, 0.1), (4, 0.1), (6, 1e-3), (7, 1e-3), (8, 1e-3)):
        x = np.zeros(MODEL.size)
        x[state] = size
        one = NavState(*(np.asarray(part)[None] for part in vars(initial).values()))
        ends = []
        for sign in (1.0, -1.0):
            # `corrected` takes errors off
            moved = corrected(one, -sign * x[None], WGS84)
            ends.append(line(NavState(*(part[0] for part in vars(moved).values())), delay, 0.0))
        for sensor in (0, 1):
            _, h, epochs = stacked(nominal, sensor)
            change = 0.5 * (stacked(ends[0], sensor)[0] - stacked(ends[1], sensor)[0])
            expected = np.array([hk @ transition[e] @ x for hk, e in zip(h, epochs, strict=True)])
            np.testing.assert_allclose(change, expected, atol=1e-2 * np.abs(expected).max() + 1e-9)


def test_a_little_beyond_its_ends_a_solution_goes_on() -> None:
    """With constant acceleration: after 0.1 s within 2 mm and 5 cm/s, which a jerk of 5 m/s³ explains."""
    imu, initial, _ = world()
    trajectory, _ = drive(50.0, 50.0, False)
    part = ImuData(imu.time[:1501], imu.dtheta[:1500], imu.dvel[:1500])
    solution = navigate(part, initial)
    for time in (30.1, 29.99, -0.1):
        found = near(solution, np.array([time]), MeanGyroRates(part), ImuErrors(), WGS84)
        truth = trajectory.state(np.array([time]))
        inside = trajectory.state(np.array([min(max(time, 0.0), 30.0)]))
        navigated = near(solution, np.array([min(max(time, 0.0), 30.0)]), MeanGyroRates(part), ImuErrors(), WGS84)
        drift = (navigated.latitude - inside.latitude) * 6.4e6
        assert abs((found.latitude - truth.latitude)[0] * 6.4e6 - drift[0]) < 2e-3
        off = found.velocity_ned - truth.velocity_ned - navigated.velocity_ned + inside.velocity_ned
        assert np.abs(off).max() < 0.05


def test_a_delay_belongs_to_a_sensor_that_can_have_one() -> None:
    imu, initial, given = world()
    model = ErrorModel((*MODEL.blocks[:3], Block("zero-rate delay", 0.1)), 1e-4, 1e-3)
    zero = Measurements("zero-rate", TIME, TIME, np.zeros((len(TIME), 3)), np.ones((len(TIME), 3)))
    with pytest.raises(InputError, match="block 'zero-rate delay' has 1 states"):
        estimate(imu, initial, [zero], model)
    model = ErrorModel((*MODEL.blocks[:3], Block("gnss-position delay", (0.1, 0.1))), 1e-4, 1e-3)
    with pytest.raises(InputError, match=r"gnss-position delay \(1\)"):
        estimate(imu, initial, given, model)


@pytest.mark.parametrize("by", [-1.0, -0.05, -0.04, 0.0, 0.04, 0.05, 1.0])
@pytest.mark.parametrize("interval", [0.0, 0.02, 1.0])
def test_the_mean_rate_beyond_the_data_is_that_at_their_end(by: float, interval: float) -> None:
    """A constant rate is its own mean over any interval, also over one that ends before the data begin."""
    rate = np.array([0.1, -0.2, 0.3])
    time = np.arange(201) / 20.0
    gyros = MeanGyroRates(ImuData(time, np.tile(rate / 20.0, (200, 1)), np.zeros((200, 3))))
    instant = np.array([max(by, 0.0) + 10.0 if by >= 0.0 else by])
    if interval:
        found = gyros.mean(instant - interval, instant, ImuErrors())
    else:
        found = gyros.at(instant, ImuErrors())
    np.testing.assert_allclose(found[0], rate, rtol=1e-12)


@pytest.mark.parametrize("rate_hz", [5.0, 20.0])
def test_every_reading_from_the_first_instant_to_the_last_is_used(rate_hz: float) -> None:
    """The slope of a delay is taken over ±0.05 s, which is one interval of 20 Hz: at the ends of the data it has none.

    All readings are used, and the offset is found; the fixes are right to 1.5 m and 0.05 m/s.
    """
    trajectory, ideal = drive(50.0, rate_hz, False)
    sigma = (0.5, 1e-3, 1e-3)
    blocks = [Block(name, s) for name, s in zip(("position", "velocity", "attitude"), sigma, strict=True)]
    model = ErrorModel((*blocks, Block("gnss lever arm", 1e-3), Block("gnss time offset", 0.3)), 1e-5, 1e-3)
    time, late = np.arange(0.0, 50.5), 0.2
    shifted = np.clip(time - late, 0.0, 50.0)
    rng = np.random.default_rng(5)
    given = [positions(trajectory, shifted, rng), velocities(trajectory, shifted, rng)]
    given = [Measurements(m.kind, time, time, m.value, m.sigma, np.zeros(3)) for m in given]
    given = [Measurements(m.kind, m.time[1:], m.time[1:], m.value[1:], m.sigma[1:]) for m in given[:1]] + given[1:]
    found = estimate(ideal, trajectory.state(0.0), given, model, rate_hz=5.0, gate=None)
    assert found.divergence is None
    assert all(np.isfinite(i.nis).all() and i.accepted.all() for i in found.innovations)
    off = found.parameters["gnss time offset"][-1, 0] - late
    assert abs(off) < 4.0 * found.sigma[-1, -1] < 0.1


def test_a_zero_rate_at_the_time_of_one_that_is_not_used() -> None:
    """The mean rate is taken over the usual interval, not over none."""
    imu, initial, _ = world()
    time = np.array([1.0, 2.0, 3.0, 3.0, 4.0])
    value = np.zeros((5, 3))
    value[2] = np.nan
    model = ErrorModel(MODEL.blocks[:4], 1e-4, 1e-3)
    zero = Measurements("zero-rate", time, time, value, np.ones((5, 3)))
    found = estimate(imu, initial, [zero], model, gate=None).innovations[0]
    assert found.accepted.tolist() == [True, True, False, True, True]
    assert np.isfinite(found.nis[[0, 1, 3, 4]]).all()
