"""The searches of a diagnosis on filters whose gain is a known function of the size, and the advice on vibration."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from sinssim.data import Array, NavSolution
from sinssim.errors import SinssimError
from sinssim.estimation import Block, estimate
from sinssim.estimation.filter_diagnosis import _as_run, _confirmed, _Search, _Tried, _with_size, with_block
from sinssim.estimation.filter_result import ALIKE, Diagnosis, Estimate, Hypothesis
from sinssim.estimation.linear_replay import Assumptions, LinearPass, Series
from sinssim.estimation.state_model import ErrorModel
from sinssim.progress import silent
from tests.estimation.made import MODEL, readings

COUNT = 400


def search_for(spread: float, of_sources: Array, of_readings: float) -> _Search:
    """Return the search about a pass whose innovations have a known S.

    White innovations of 1σ `spread`, of which a filter assumes S = Σ s_j a_j + f² b: with the factors s of the sources
    (gyros, accelerometers, walk of the gyros) by `of_sources`, and the factor f of σ by `of_readings`.
    """
    value = spread * np.random.default_rng(4).standard_normal((COUNT, 1))

    def replay_whole(assumptions: Sequence[Assumptions], dropped: Any, **_: Any) -> tuple[list[Series], Any, Any]:
        s = [of.process @ of_sources + of_readings * float(of.sigma["s"][0, 0] if "s" in of.sigma else 1.0) ** 2
             for of in assumptions]  # fmt: skip
        covariance = np.tile(np.array(s)[:, None, None, None], (1, COUNT, 1, 1))
        time = np.linspace(0.0, 18.0, COUNT)
        return [Series("s", time, np.arange(COUNT), np.tile(value, (len(s), 1, 1)), covariance)], None, None

    search = object.__new__(_Search)
    search._model, search._progress = MODEL, silent
    search._walks = [("gyro", Block("gyro bias", 1e-3), 1e-4)]
    wide = replace(MODEL, blocks=(*MODEL.blocks, Block("gyro bias", 0.0)))
    search.line = cast("LinearPass", SimpleNamespace(
        replay_whole=replay_whole, replay=lambda *given: replay_whole(*given)[0], sources=3, model=wide,
        events=[SimpleNamespace(time=0.0), SimpleNamespace(time=18.0)],
    ))  # fmt: skip
    search._bounds, search._process = {"s": np.inf}, np.array([1.0, 1.0, 0.0])
    search._base = cast("Estimate", SimpleNamespace(innovations=(SimpleNamespace(sensor="s", nis=np.ones(COUNT)),)))
    search._least = float(search._gated([search._assumed()])[0][0])
    return search


def mean_square(spread: float) -> float:
    return float(np.mean((spread * np.random.default_rng(4).standard_normal(COUNT)) ** 2))


def gain_of(before: float, after: float, spread: float) -> float:
    """Σ (ν²/S + ln S) before, less that after."""
    squares = mean_square(spread)
    return COUNT * (squares / before + np.log(before) - squares / after - np.log(after))


def test_the_size_of_an_inertial_noise() -> None:
    """S = 2 f² + 1: f² = (mean ν² − 1)/2, and the gain is that of S = mean ν² against S = 3."""
    search = search_for(40.0, np.array([1.0, 1.0, 0.0]), 1.0)
    found = {of.hypothesis.name: of for of in search.noises([])}
    one, size = found["inertial noise"].hypothesis, np.sqrt((mean_square(40.0) - 1.0) / 2.0)
    assert (one.kind, one.value, one.sigma) == ("inertial noise", (pytest.approx(size, rel=5e-3),), ())
    assert one.gain == pytest.approx(gain_of(3.0, mean_square(40.0), 40.0), abs=0.1)
    assert found["inertial noise"].model.gyro_noise == pytest.approx(one.value[0] * 1e-4)
    assert found["inertial noise"].model.accel_noise == pytest.approx(one.value[0] * 1e-3)
    assert "gyro" not in found  # S does not depend on it


def test_the_density_of_a_walk() -> None:
    """S = 3 + K² 1e10: K² = (mean ν² − 3) 1e-10; the model has it, with the block's σ."""
    search = search_for(5.0, np.array([1.0, 1.0, 1e10]), 1.0)
    (found,) = [of for of in search.noises([]) if of.hypothesis.kind == "bias walk"]
    size = 1e-5 * np.sqrt(mean_square(5.0) - 3.0)
    assert found.hypothesis.value == (pytest.approx(size, rel=5e-3),)
    block = found.model.blocks[-1]
    assert (block.name, block.sigma) == ("gyro bias", 1e-3)
    assert block.random_walk == found.hypothesis.value[0]


def test_a_noise_that_is_none_is_not_suggested() -> None:
    """Innovations as assumed, or smaller: no larger noise of any source explains them."""
    for spread in (np.sqrt(3.0), 1.0):
        assert list(search_for(spread, np.array([1.0, 1.0, 1e10]), 1.0).noises([])) == []


@pytest.mark.parametrize(
    ("true", "predicted", "factor"), [(2.0, 0.1, 2.0), (0.5, 0.1, 0.49), (3.0, 10.0, None), (1.01, 0.1, None)]
)
def test_a_factor_is_advised_only_where_the_readings_determine_it(
    true: float, predicted: float, factor: float | None
) -> None:
    """A prediction that is less certain than the readings hides their noise; an interval about 1 is no advice."""
    search = search_for(true, np.array([0.5, 0.5, 0.0]) * predicted**2, 1.0)
    found = [of for of in search.noises(["s"]) if of.hypothesis.kind == "measurement noise"]
    if factor is None:
        assert found == []
        return
    (one,) = found
    assert one.hypothesis.value[0] == pytest.approx(np.sqrt(mean_square(true) - predicted**2), rel=5e-3)
    assert one.hypothesis.sigma[0] == pytest.approx(factor / np.sqrt(2.0 * COUNT), rel=0.1)  # σ/√(2N)
    assert one.factors == {"s": one.hypothesis.value[0]}


TIME = np.arange(10.0)


def explained(better: float) -> Estimate:
    """Return an estimate whose innovations are better by a gain: the NIS of its first reading is smaller by it."""
    nis = np.full(10, 2.0)
    nis[0] = 1e6 - better
    of = readings("s", TIME, np.ones(10), nis=nis, bound=np.inf)
    return cast("Estimate", SimpleNamespace(innovations=(of,), time=3.0 + 2.0 * TIME))


OWN = explained(0.0)


def tried(name: str, kind: Any, better: float, needed: float = 10.0) -> _Tried:
    return _Tried(Hypothesis(name, kind, (1.0,), (0.1,), better, needed), with_block(MODEL, Block("gyro bias", better)),
                  {})  # fmt: skip


def test_the_filter_itself_decides_among_the_best() -> None:
    """Those of a quarter of the largest gain run, and where that is large every start; what fails explains nothing.

    The others are never above the best."""
    ran: list[float] = []

    def run(model: ErrorModel, factors: Mapping[str, float], **_: Any) -> Estimate:
        ran.append(float(np.max(model.blocks[-1].sigma)))
        if ran[-1] == 900.0:
            raise SinssimError("the filter fails")
        return explained({1000.0: 50.0, 600.0: 420.0, 5.0: 400.0}[ran[-1]])

    given = [tried("a", "inertial noise", 1000.0), tried("b", "bias walk", 600.0), tried("c", "bias walk", 900.0),
             tried("d", "bias walk", 240.0), tried("e", "initial state", 5.0)]  # fmt: skip
    found = _confirmed(run, OWN, given, silent)
    assert ran == [1000.0, 900.0, 600.0, 5.0]
    gains = [("b", 420.0), ("e", 400.0), ("d", 240.0), ("a", 50.0), ("c", -np.inf)]
    assert [(of.name, of.gain) for of in found] == [(name, pytest.approx(better)) for name, better in gains]
    ran.clear()
    few = [tried("a", "bias walk", 5.0), tried("b", "initial state", 4.0)]
    assert [of.name for of in _confirmed(run, OWN, few, silent)] == ["a", "b"]
    assert ran == []


def test_a_state_has_its_last_value_and_sigma() -> None:
    block = Block("gnss lever arm", 10.0)
    sigma = np.vstack([np.ones(12), np.arange(1.0, 13.0)])

    def run(model: ErrorModel, factors: Mapping[str, float], *, smooth: bool = False) -> Any:
        values = {"gnss lever arm": np.array([[9.0, 9.0, 9.0], [1.5, -2.5, 0.5]])}
        return SimpleNamespace(
            innovations=explained(7.0).innovations, time=TIME, model=model, parameters=values, sigma=sigma
        )

    given = Hypothesis("gnss lever arm", "state", (1.0,), (0.1,), 99.0, 12.0)
    found = _as_run(run, OWN, _Tried(given, with_block(MODEL, block), {}))
    assert found == Hypothesis(
        "gnss lever arm", "state", (1.5, -2.5, 0.5), (10.0, 11.0, 12.0), pytest.approx(7.0), 12.0
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
