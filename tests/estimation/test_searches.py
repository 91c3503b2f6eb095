"""The searches of a diagnosis on filters whose gain is a known function of the size, and the advice on vibration."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from sinssim.data import NavSolution
from sinssim.errors import SinssimError
from sinssim.estimation import Block, estimate
from sinssim.estimation.filter_diagnosis import _inertial_noise, _Search, _spread, _state, _with_size
from sinssim.estimation.filter_result import ALIKE, Diagnosis, Estimate, Hypothesis
from sinssim.estimation.state_model import ErrorModel
from tests.estimation.made import MODEL, readings

TIME = np.arange(10.0)


def explained(better: float) -> Estimate:
    """Return an estimate whose innovations are better by a gain: the NIS of its first reading is smaller by it."""
    nis = np.full(10, 2.0)
    nis[0] = 1e6 - better
    of = readings("s", TIME, np.ones(10), nis=nis, bound=np.inf)
    return cast("Estimate", SimpleNamespace(innovations=(of,), time=3.0 + 2.0 * TIME))


OWN = explained(0.0)


def run_of(gain_of: Callable[[ErrorModel, Mapping[str, float]], float | None]) -> Any:
    def run(model: ErrorModel, factors: Mapping[str, float], *, smooth: bool = False) -> Estimate:
        found = gain_of(model, factors)
        if found is None:
            raise SinssimError("the filter fails")
        return explained(found)

    return run


def test_the_size_of_an_inertial_noise() -> None:
    """A parabola in ln f about f = 40 with 50 at its top: the vertex is found, from √10 on."""
    seen: list[tuple[float, float]] = []

    def gain_of(model: ErrorModel, _: Mapping[str, float]) -> float:
        if len(model.blocks) > 3:
            return -1.0
        seen.append((model.gyro_noise, model.accel_noise))
        return 50.0 - 3.0 * math.log(model.gyro_noise / 1e-4 / 40.0) ** 2

    found = {one.name: one for one in _inertial_noise(run_of(gain_of), MODEL, OWN, 0.01)}
    one = found["inertial noise"]
    assert (one.kind, one.value, one.gain, one.sigma) == (
        "inertial noise", (pytest.approx(40.0, rel=1e-6),), pytest.approx(50.0, abs=1e-6), (),
    )  # fmt: skip
    assert seen[0] == pytest.approx((1e-4 * math.sqrt(10.0), 1e-3 * math.sqrt(10.0)))
    assert seen[1][0] == pytest.approx(1e-3 * math.sqrt(10.0))
    assert (found["gyro"].kind, found["accelerometer"].kind) == ("bias walk", "bias walk")


def test_the_density_of_a_walk() -> None:
    """From √3 N/T on, where the walk is as large as the white noise at the end of 18 s."""
    densities: list[float] = []

    def gain_of(model: ErrorModel, _: Mapping[str, float]) -> float | None:
        blocks = {block.name: block for block in model.blocks}
        if "accelerometer bias" not in blocks:
            return None if "gyro bias" in blocks else -3.0
        densities.append(float(np.max(blocks["accelerometer bias"].density)))
        return 20.0 - math.log(densities[-1] / 0.02) ** 2

    found = {one.name: one for one in _inertial_noise(run_of(gain_of), MODEL, OWN, 0.01)}
    assert densities[:3] == pytest.approx(math.sqrt(3.0) * 1e-3 / 18.0 * np.array([1.0, 10.0, 100.0]))
    assert found["accelerometer"].value == (pytest.approx(0.02, rel=1e-6),)
    assert set(found) == {"inertial noise", "accelerometer"}  # the gyros' walk always failed


def test_decades_end_where_the_gain_has_been_and_falls() -> None:
    def search(gains: list[float]) -> _Search:
        left = iter(gains)
        return _Search(run_of(lambda model, factors: next(left)), OWN, "gyro", "bias walk", lambda size: MODEL, 0.3)

    one = search([-5.0, 4.0, 3.0, 2.0, 99.0, 99.0])
    one.by_decades()
    assert one.tried == {
        0.3: pytest.approx(-5.0),
        3.0: pytest.approx(4.0),
        30.0: pytest.approx(3.0),
        300.0: pytest.approx(2.0),
    }
    assert one.hypothesis == Hypothesis("gyro", "bias walk", (3.0,), (), pytest.approx(4.0), math.inf)
    one = search([-1.0, -2.0, -3.0, -4.0, 5.0, 6.0])
    one.by_decades()
    assert len(one.tried) == 6
    assert one.best == (pytest.approx(3e4), pytest.approx(6.0))


@pytest.mark.parametrize(("closer", "sigma"), [
    (24.0, math.log(2.0) / 4.0),  # the gain falls by 16 = (½ ln 4)²/σ²
    (None, 0.0), (40.0, math.inf), (41.0, math.inf),
])  # fmt: skip
def test_the_spread_of_a_factor(closer: float | None, sigma: float) -> None:
    """Factors of 4 and 2 are halved in the logarithm, and the larger step counts."""
    seen: list[Mapping[str, float]] = []

    def gain_of(model: ErrorModel, factors: Mapping[str, float]) -> float | None:
        seen.append(factors)
        return closer

    found = _spread(run_of(gain_of), MODEL, {"a": 4.0, "b": 2.0}, 40.0, OWN)
    assert found == pytest.approx(sigma, rel=1e-6)
    assert seen == [{"a": pytest.approx(2.0), "b": pytest.approx(math.sqrt(2.0))}]


def test_a_state_has_its_last_value_and_sigma() -> None:
    block = Block("gnss lever arm", 10.0)
    sigma = np.vstack([np.ones(12), np.arange(1.0, 13.0)])

    def run(model: ErrorModel, factors: Mapping[str, float], *, smooth: bool = False) -> Any:
        values = {"gnss lever arm": np.array([[9.0, 9.0, 9.0], [1.5, -2.5, 0.5]])}
        return SimpleNamespace(
            innovations=explained(7.0).innovations, time=TIME, model=model, parameters=values, sigma=sigma
        )

    found = _state(run, MODEL, OWN, block)
    assert found == Hypothesis(
        "gnss lever arm", "state", (1.5, -2.5, 0.5), (10.0, 11.0, 12.0), pytest.approx(7.0), math.inf
    )


@pytest.mark.parametrize(("name", "value", "sigma"), [
    ("initial position", (30.0, -20.0, -5.0), (1.0, 2.0, 3.0)),
    ("initial velocity", (0.3, -0.2, 0.5), (4.0, 5.0, 6.0)),
    ("initial tilt", (0.01, -0.02), (7.0, 8.0)),
    ("initial heading", (0.4,), (9.0,)),
])  # fmt: skip
def test_the_error_of_a_start_is_that_against_the_smoothed_one(name: str, value: tuple, sigma: tuple) -> None:
    """A start that is 30 m too far north, 20 m west and 5 m high; whose heading is 0.4 rad too large."""
    from scipy.spatial.transform import Rotation

    from sinssim import earth

    true = Rotation.from_euler("ZYX", [0.7, 0.2, -0.1])
    phi = {"initial tilt": [0.01, -0.02, 0.0], "initial heading": [0.0, 0.0, -0.4]}.get(name, [0.0, 0.0, 0.0])
    given = Rotation.from_rotvec(phi).inv() * true  # C_given = (I − [φ×]) C_true
    r1, r2 = earth.radii(0.8)

    def solution(north: float, east: float, up: float, velocity: list[float], attitude: Rotation) -> NavSolution:
        two = np.ones(2)
        return NavSolution(
            np.array([0.0, 1.0]), two * (0.8 + north / (r1 + 100.0)),
            two * (0.3 + east / ((r2 + 100.0) * np.cos(0.8))), two * (100.0 + up), np.tile(velocity, (2, 1)),
            np.tile(attitude.as_quat(scalar_first=True), (2, 1)), np.zeros(2),
        )  # fmt: skip

    own: Any = SimpleNamespace(solution=solution(30.0, -20.0, 5.0, [1.3, 1.8, 3.5], given))
    smoothed = SimpleNamespace(
        solution=solution(0.0, 0.0, 0.0, [1.0, 2.0, 3.0], true), sigma=np.arange(1.0, 10.0)[None]
    )
    told: list[bool] = []

    def run(model: ErrorModel, factors: Mapping[str, float], *, smooth: bool = False) -> Any:
        told.append(smooth)
        return SimpleNamespace(smoothed=smoothed)

    found = _with_size(run, MODEL, own, Hypothesis(name, "initial state", (), (), 9.0, 1.0))
    assert told == [True]
    assert found.value == pytest.approx(value, rel=1e-3)
    assert found.sigma == sigma


def test_cause_and_what_is_alike() -> None:
    """2 ln 100 = 9.21 below the best, and above what it needs."""
    assert pytest.approx(9.2103, abs=1e-4) == ALIKE
    gains = {"a": (30.0, 40.0), "b": (29.0, 5.0), "c": (19.9, 5.0), "d": (19.7, 5.0), "e": (25.0, 26.0)}
    of = {name: Hypothesis(name, "state", (), (), better, needed) for name, (better, needed) in gains.items()}
    found = Diagnosis(60.0, (), {}, tuple(of.values()))
    assert found.cause == of["b"]
    assert found.alike == (of["c"],)
    assert Diagnosis(60.0, (), {}, (of["a"],)).cause is None


@pytest.mark.parametrize(("refused", "said"), [(20, False), (21, True)])
def test_vibration_that_the_filter_was_not_told_of(monkeypatch: pytest.MonkeyPatch, refused: int, said: bool) -> None:
    """More than 2 % refused; levels in rms over the windows, of the worst axis, three times the noise of a sample."""
    level = SimpleNamespace(
        gyro=np.array([[0.01, 0.03, 0.02], [0.01, 0.04, 0.02]]), accel=np.array([[0.29, 0.1, 0.2], [0.2, 0.1, 0.29]]),
        interval=0.01,
    )  # fmt: skip
    monkeypatch.setattr(estimate, "vibration", lambda imu: level)
    time = np.arange(1010.0)
    nis = np.where(time < 10, np.nan, 1.0)
    sensors = [readings("s", time, (time < 5) | (time >= 10 + refused), nis=nis)]
    imu: Any = None
    rms = np.degrees(np.sqrt((0.03**2 + 0.04**2) / 2.0))
    expected = [
        f"The gate rejected 2 % of all measurements, and the inertial data contain vibration: the gyros by {rms:.3g} "
        "°/s (rms, right), 35 times the assumed noise of a sample. Vibration adds noise that the filter does not model"
        ": set filter.vibration_noise (about 0.4), or increase filter.inertial_noise_factor."
    ]
    loud = ErrorModel(MODEL.blocks, 1e-4, 0.01)  # of a sample 1e-3 rad/s, and 0.1 m/s²
    assert estimate.vibration_untold(sensors, imu, loud, None) == (expected if said else [])
    assert estimate.vibration_untold(sensors, imu, loud, cast("Any", 1)) == []
    quiet = ErrorModel(MODEL.blocks, 0.0, 0.008)
    found = "".join(estimate.vibration_untold(sensors, imu, quiet, None))
    rms = math.sqrt((0.29**2 + 0.2**2) / 2.0)
    words = (
        f"none is assumed; the accelerometers by {rms:.3g} m/s² (rms, forward), 3 times the assumed noise of a sample."
    )
    assert (words in found) == said
