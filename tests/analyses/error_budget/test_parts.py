"""The parts of a budget: steps, noises, the vertical loop and its readings, the aligned start, each by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from sinssim.analyses.error_budget.aligned_start import by_mean_readings
from sinssim.analyses.error_budget.covariance_budget import _instants
from sinssim.analyses.error_budget.covariance_propagation import (
    STATES,
    HeightErrors,
    Vertical,
    _boundaries,
    _height_reading,
    _readings_at,
    _with_loop,
)
from sinssim.analyses.error_budget.error_dynamics import (
    TrueMotion,
    exponential,
    gravity_input,
    noise_inputs,
    white_covariance,
)
from sinssim.analyses.error_budget.error_sources import (
    Column,
    Constants,
    InertialNoise,
    InitialErrors,
    SensorConstant,
    SensorGiven,
    SensorNoise,
    SensorProcess,
    Source,
)
from sinssim.analyses.error_budget.source_effects import Marks, Shares, add_rounding, remainder_noise
from sinssim.analyses.error_budget.source_propagation import Propagation
from sinssim.errors import InputError
from sinssim.estimation.error_dynamics import NominalMotion
from sinssim.sensors.imu.error_term_table import FIELDS
from tests.analyses.error_budget.worlds import scenario

OMEGA = 7.292115e-5


def source(name: str, kind: Any = "random") -> Source:
    return Source(name, name, "baro", kind, 1.0, "m")


def fake(**values: Any) -> Any:
    return SimpleNamespace(**values)


def test_exponentials_and_covariances_over_steps() -> None:
    """Against scipy's matrix exponential, of F T itself and of Van Loan's matrix."""
    rng = np.random.default_rng(2)
    f, interval = 0.05 * rng.normal(size=(3, 5, 5)), np.array([0.7, 1.3, 2.0])
    g = rng.normal(size=(3, 5, 3))
    moved, noise = exponential(f, interval), white_covariance(f, g, interval)
    for k, t in enumerate(interval.tolist()):
        assert moved[k] == pytest.approx(expm(f[k] * t), abs=1e-10)  # ‖FT‖⁹/9!
        van_loan = np.zeros((10, 10))
        van_loan[:5, :5], van_loan[:5, 5:], van_loan[5:, 5:] = -f[k], g[k] @ g[k].T, f[k].T
        big = expm(van_loan * t)
        assert noise[k] == pytest.approx(big[5:, 5:].T @ big[:5, 5:], rel=1e-6, abs=1e-8)


def test_gravity_over_a_step() -> None:
    """½ T (Φ + 1) of the columns of velocity: with δr = ∫δv it moves by ½ g T² and gains g T."""
    phi = np.eye(9)
    phi[0, 3] = phi[1, 4] = phi[2, 5] = 4.0
    found = gravity_input(phi, 4.0)
    assert found.shape == (9, 3)
    assert found[0:6] == pytest.approx(np.vstack([8.0 * np.eye(3), 4.0 * np.eye(3)]))
    assert not found[6:].any()


def nominal() -> NominalMotion:
    """Return a body that is yawed to the east and turns about its right axis at 2 rad/s under (3, 5, −9) m/s²."""
    c_nb = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    force = np.array([[3.0, 5.0, -9.0]])
    return NominalMotion(
        np.array([0.5]), np.array([700.0]), np.zeros((1, 3)), c_nb, force, np.array([[0.0, 2.0, 0.0]]),
        np.einsum("kji,kj->ki", c_nb, force),
    )  # fmt: skip


def test_noises_drive_the_errors() -> None:
    """φ̇ = −C w and δv̇ = C w; of sums ε: φ + C ε by C [ω×] ε, δv − C ε by −C [ω×] ε and f × φ, δr by C ε."""
    found = noise_inputs(nominal())
    c = nominal().c_nb[0]
    turning = c @ np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 0.0], [-2.0, 0.0, 0.0]])
    force = np.array([[0.0, 9.0, 5.0], [-9.0, 0.0, -3.0], [-5.0, 3.0, 0.0]])
    wanted = {key: np.zeros((9, 3)) for key in found}
    wanted[0, "white"][6:], wanted[1, "white"][3:6] = -c, c
    wanted[0, "quantum"][6:], wanted[0, "quantum"][3:6] = turning, -force @ c
    wanted[1, "quantum"][3:6], wanted[1, "quantum"][:3] = -turning, c
    assert set(found) == {(0, "white"), (1, "white"), (0, "quantum"), (1, "quantum")}
    for key, matrix in wanted.items():
        np.testing.assert_allclose(found[key][0], matrix, atol=1e-15, err_msg=str(key))


def test_distance_along_a_motion() -> None:
    """Speeds 5, 13, 5 and 10 m/s at 0, 2, 3 and 6 s: 18, 9 and 22.5 m by trapezoids."""
    velocity = np.array([[3.0, -4.0, 50.0], [5.0, 12.0, 0.0], [-4.0, 3.0, 9.0], [6.0, 8.0, 0.0]])
    motion = TrueMotion(
        fake(), fake(time=np.array([0.0, 2.0, 3.0, 6.0])), fake(velocity_ned=velocity), fake(), "normal"
    )  # fmt: skip
    assert motion.distance(np.array([0.0, 1.0, 3.0, 4.0])) == pytest.approx([9.0, 18.0, 7.5])


def test_instants_of_the_results() -> None:
    """Five even ones and those that are asked for, at the next edge from half a sample before; 10 s from 3 s on."""
    edges = 3.0 + 0.5 * np.arange(21)
    found = _instants(edges, [0.6, 10.0], 5)
    assert found.tolist() == [3.0, 3.5, 5.5, 8.0, 10.5, 13.0]
    with pytest.raises(InputError, match=r"t = 10\.5 s lies outside the run, which lasts 10 s"):
        _instants(edges, [2.0, 10.5], 5)


def test_boundaries_of_the_steps() -> None:
    """Each second; in a loop of 4 s each 0.2 s; where readings arrive, and 1.5 intervals later."""
    motion = fake(ideal=fake(time=7.0 + 0.1 * np.arange(41)))
    plain = _boundaries(motion, Vertical("free", 50.0, None), np.array([7.5, 11.0]))
    assert plain == pytest.approx([7.0, 7.5, 8.0, 9.0, 10.0, 11.0])
    loop = _boundaries(motion, Vertical("baro-loop", 4.0, None), np.array([11.0]))
    assert loop == pytest.approx(7.0 + 0.2 * np.arange(21))
    read = HeightErrors(np.array([7.32, 9.32]), np.zeros(2), np.zeros(2), 0.9, "baro")
    slow = _boundaries(motion, Vertical("baro-loop", 50.0, read), np.array([11.0]))
    assert slow == pytest.approx([7.0, 7.4, 8.0, 8.7, 9.0, 9.4, 10.0, 10.7, 11.0])


def test_readings_of_the_vertical_loop_at_the_boundaries() -> None:
    """New ones by their number; the loop is open before the first, and 1.5 intervals after the last."""
    read = HeightErrors(np.array([1.0, 3.0, 3.4]), np.zeros(3), np.zeros(3), 1.0, "baro")
    time = np.array([0.0, 1.0, 2.0, 2.5, 2.6, 3.0, 4.0, 4.8, 5.0])
    new, is_open = _readings_at(time, read)
    assert new.tolist() == [-1, 0, -1, -1, -1, 1, 2, -1, -1]
    assert is_open.tolist() == [True, False, False, False, True, False, False, False, True]
    none, closed = _readings_at(time, None)
    assert (set(none.tolist()), closed.any()) == ({-1}, np.False_)


def shares() -> Shares:
    sensors = [
        SensorConstant(source("baro_scale"), "baro scale", np.array([3e-4])),
        SensorProcess(source("baro_bias"), "baro bias", np.array([8.0]), 900.0),
        SensorNoise(source("baro_noise"), "baro", np.array([1.5])),
        SensorGiven(source("baro_given", "given"), "baro"),
    ]
    return Shares(Constants([], [], {}), [], [], InitialErrors(), sensors)


def test_a_reading_replaces_the_error_that_the_loop_holds() -> None:
    """e ← −δr_D − δh_ref: with the scale factor times the height, the given error, and the noise's variance."""
    read = HeightErrors(np.array([1.0, 2.0]), np.array([500.0, 700.0]), np.array([4.0, -6.0]), 1.0, "baro")
    found = _height_reading(shares(), read, 1)
    assert found.gain.ravel().tolist() == [0.0] * 10 + [1.0]
    assert found.core.ravel().tolist() == [0.0, 0.0, -1.0] + [0.0] * 7 + [-1.0]
    assert found.constants.ravel().tolist() == [-700.0, 6.0]
    assert {name: values.tolist() for name, values in found.processes.items()} == {"baro_bias": [[-1.0]]}
    assert {name: values.tolist() for name, values in found.noise.items()} == {"baro_noise": [2.25]}


def test_columns_of_the_sources() -> None:
    """Of a bias of three axes, a series, two initial errors and a sensor's scale factor, in this order."""
    columns = [Column(0, axis, axis, axis, FIELDS["bias"]) for axis in np.eye(3)]
    constants = Constants([source("bias")], columns, {"bias": ([0, 1, 2], np.array([2.0, 3.0, 5.0]))})
    start = np.zeros((9, 2))
    start[3, 0], start[7, 1] = 0.25, 0.5
    noise = InertialNoise(source("walk"), 0, "white", 3.0, 3.0)
    found = Shares(
        constants, [noise], [source("range", "one run")], InitialErrors([source("tilt")], {"tilt": start}),
        [SensorConstant(source("baro_scale"), "baro scale", np.array([3e-4]))],
    )  # fmt: skip
    assert [one.name for one in found.sources] == ["bias", "walk", "range", "tilt", "baro_scale"]
    assert (found.inertial, found.count) == (4, 7)
    assert {name: columns for name, (columns, _) in found.parts.items()} == {
        "bias": [0, 1, 2], "range": [3], "tilt": [4, 5], "baro_scale": [6],
    }  # fmt: skip
    assert len(found.kernel_columns) == 4 + 6
    begun = found.begin(11)
    assert begun.sensitivity.shape == (11, 7)
    assert begun.sensitivity[3].tolist() == [0.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0]
    assert begun.sensitivity[7].tolist() == [0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0]
    assert np.count_nonzero(begun.sensitivity) == 2


@pytest.mark.parametrize("sampled", [False, True])
def test_gains_of_the_vertical_loop(sampled: bool) -> None:
    """1/τ = 0.25: k₁ = 0.75, k₂ = 3/16 + 2g/R, k₃ = 1/64; at once on −δr_D, or on the error that is held."""
    read = HeightErrors(np.zeros(1), np.zeros(1), np.zeros(1), 1.0, "baro") if sampled else None
    motion = fake(trajectory=fake(ellipsoid=scenario_ellipsoid()), gravity="normal")
    f = np.arange(162.0).reshape(2, 9, 9)
    one = nominal()
    twice = NominalMotion(*(np.repeat(value, 2, axis=0) for value in vars(one).values()))
    found = _with_loop(f, twice, Vertical("baro-loop", 4.0, read), motion, np.array([False, True]))
    added = found.copy()
    added[:, :9, :9] -= f
    second = 3.0 / 16.0 + 2.0 * 9.80 / 6.389e6
    gains = {(2, 10): 0.75, (5, 10): second, (9, 10): 1.0 / 64.0} if sampled else {
        (2, 2): -0.75, (5, 2): -second, (9, 2): -1.0 / 64.0}  # fmt: skip
    wanted = np.zeros((2, STATES, STATES))
    wanted[:, 5, 9] = 1.0
    for place, gain in gains.items():
        wanted[(slice(None), *place)] = gain
    if sampled:
        wanted[1, :, 10] = 0.0  # the loop is open
    np.testing.assert_allclose(added, wanted, rtol=1e-4, atol=1e-9)
    free = _with_loop(f, twice, Vertical("free", 4.0, None), motion, np.zeros(2, bool))
    assert not free[:, 9:].any()
    assert free[:, :9, :9].tolist() == f.tolist()


def scenario_ellipsoid() -> Any:
    from sinssim.earth.ellipsoids import ELLIPSOIDS

    return ELLIPSOIDS["wgs84"]


def test_rounding_of_the_last_pulse() -> None:
    """Q²/12 = 3 of the gyros on the attitude, and 12 of the accelerometers on the velocity, through the mix."""
    none = Constants([], [], {})
    mix = np.diag([1.0, 2.0, 3.0])
    noises = [InertialNoise(source("g"), 0, "quantum", 6.0), InertialNoise(source("a"), 1, "quantum", 12.0, mix=mix),
              InertialNoise(source("w"), 0, "white", 9.0)]  # fmt: skip
    covariances = {name: np.ones((9, 9)) for name in "gaw"}
    add_rounding(covariances, Shares(none, noises, [], InitialErrors(), []))
    assert (covariances["g"] - 1.0).tolist() == np.diag([0.0] * 6 + [3.0] * 3).tolist()
    assert (covariances["a"] - 1.0).tolist() == np.diag([0.0] * 3 + [12.0, 48.0, 108.0] + [0.0] * 3).tolist()
    assert (covariances["w"] == 1.0).all()


def test_intervals_between_marks() -> None:
    """Marks at 3, 5 and 9 s, of which those before the navigation begins at 4 s do not count."""
    marks, one = Marks(np.array([3.0, 5.0, 9.0])), Propagation.start(9, 1, [])
    marks.start([one], 4.0)
    for now, value in ((4.0, 1.0), (5.0, 10.0), (6.0, 100.0), (9.0, 1000.0)):
        one.sensitivity[2, 0] = value
        marks.pass_by(one, [one], now)
    assert (marks.begin, marks.reached) == (4.0, [5.0, 9.0])
    assert [change.sensitivity[2, 0] for change in marks.changes] == [10.0, 990.0]


def test_the_attitude_by_mean_readings_of_a_level_vehicle() -> None:
    """Level and heading north: (I − [φ×]) C_true ω has no east component, and φ_N, φ_E cancel the horizontal force.

    φ_E = −δf_N/g, φ_N = δf_E/g, φ_D = δω_E/(Ω cos B) − φ_N tan B.
    """
    latitude, g = math.radians(40.0), 9.802
    rate = OMEGA * np.array([math.cos(latitude), 0.0, -math.sin(latitude)])
    count, step = 50, 0.1
    ideal = fake(
        time=5.0 + step * np.arange(count + 1), dtheta=np.tile(rate * step, (count, 1)),
        dvel=np.tile([0.0, 0.0, -g * step], (count, 1)),
    )  # fmt: skip
    found = by_mean_readings(fake(ideal=ideal), 30)
    wanted = np.zeros((3, 6))
    wanted[0, 4], wanted[1, 3] = 1.0 / g, -1.0 / g
    wanted[2, 1] = 1.0 / rate[0]
    wanted[2, 4] = -math.tan(latitude) / g
    np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=1e-6)


def test_size_of_the_remainder_of_gravity() -> None:
    """Deflections of 3″ and 5″ of 9.78 m/s² on the equator, and 20 mGal = 2e-4 m/s²."""
    remainder = {"xi_sigma_arcsec": 3.0, "eta_sigma_arcsec": 5.0, "anomaly_sigma_mgal": 20.0, "correlation_km": 7.0}
    plan = scenario(parked={"latitude_deg": 0.0, "duration_s": 20.0}, gravity={"remainder": remainder})
    state = fake(latitude=np.zeros(3), height=np.zeros(3))
    (noise,) = remainder_noise(plan, state)
    arcsec = math.radians(1.0 / 3600.0)
    assert noise.sizes == pytest.approx([9.7803253359 * 3.0 * arcsec, 9.7803253359 * 5.0 * arcsec, 2e-4], rel=1e-6)
    assert (noise.triad, noise.what, noise.source.value, noise.source.unit) == (2, "process", 5.0, "arcsec")
    assert noise.process is not None
    assert noise.process.start[0, 0] == pytest.approx(1.0)
