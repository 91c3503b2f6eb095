"""The numbers of `summary.json` and of a score, from errors that are chosen."""

from __future__ import annotations

from math import inf, isnan, nan, pi, sqrt
from pathlib import Path

import numpy as np
import pytest

from sinssim.data import ImuData, NavSolution, SingularityEvent
from sinssim.errors import InputError, RunError
from sinssim.experiments.run import error_exhibits
from sinssim.experiments.run import run_scores as score
from sinssim.logs.solution_score import Score
from sinssim.recording import result
from sinssim.strapdown import navigation_error
from sinssim.strapdown.navigation_error import NavError

SECOND = pi / 648_000.0
ERROR = NavError(
    np.array([5.0, 6.0, 8.0, 9.0]),
    np.array([[3.0, -4.0, 2.0], [5.0, 12.0, -7.0], [8.0, -15.0, 1.0], [-0.6, 0.8, 4.0]]),
    np.array([[2.0, 3.0, 6.0], [1.0, -4.0, 8.0], [2.0, 2.0, 1.0], [-4.0, 4.0, 7.0]]),
    np.array([[1.0, 2.0, -2.0], [4.0, -6.0, 12.0], [6.0, 2.0, 3.0], [0.0, 3.0, 4.0]]) * SECOND,
)
"""Horizontal 5, 13, 17, 1 m; height −2, 7, −1, −4 m; velocity 7, 9, 3, 9 m/s; attitude 3, 14, 7, 5 arcsec."""
NUMBERS = {
    "final_horizontal_error_m": 1.0, "rms_horizontal_error_m": sqrt(484.0 / 4.0), "max_horizontal_error_m": 17.0,
    "final_height_error_m": -4.0, "rms_height_error_m": sqrt(70.0 / 4.0), "max_height_error_m": 7.0,
    "final_velocity_error_mps": 9.0, "rms_velocity_error_mps": sqrt(220.0 / 4.0), "max_velocity_error_mps": 9.0,
    "final_attitude_error_arcsec": 5.0, "rms_attitude_error_arcsec": sqrt(279.0 / 4.0),
    "max_attitude_error_arcsec": 14.0,
}  # fmt: skip


def partly() -> NavError:
    """Return the errors without the last position, the second velocity and any attitude."""
    position, velocity = ERROR.position_ned.copy(), ERROR.velocity_ned.copy()
    position[3], velocity[1] = nan, nan
    return NavError(ERROR.time, position, velocity, np.full((4, 3), nan))


KNOWN = {
    "final_horizontal_error_m": 17.0, "rms_horizontal_error_m": sqrt(483.0 / 3.0), "max_horizontal_error_m": 17.0,
    "final_height_error_m": -1.0, "rms_height_error_m": sqrt(54.0 / 3.0), "max_height_error_m": 7.0,
    "final_velocity_error_mps": 9.0, "rms_velocity_error_mps": sqrt(139.0 / 3.0), "max_velocity_error_mps": 9.0,
}  # fmt: skip


def test_statistics_of_errors() -> None:
    assert navigation_error.error_numbers(ERROR) == pytest.approx(NUMBERS, rel=1e-12)
    parts = [ERROR.at(slice(0, 1)), ERROR.at(slice(1, 4))]
    assert navigation_error.error_numbers_of(lambda: iter(parts)) == pytest.approx(NUMBERS, rel=1e-12)
    assert navigation_error.known_error_numbers_of(lambda: iter(parts)) == pytest.approx(NUMBERS, rel=1e-12)
    assert ERROR.height.tolist() == [-2.0, 7.0, -1.0, -4.0]  # as before
    found = navigation_error.known_error_numbers_of(lambda: [partly()])
    assert {name: found[name] for name in KNOWN} == pytest.approx(KNOWN, rel=1e-12)
    assert all(isnan(found[f"{kind}_attitude_error_arcsec"]) for kind in ("final", "rms", "max"))
    assert set(navigation_error.NO_NUMBERS) == set(NUMBERS)
    assert all(map(isnan, navigation_error.NO_NUMBERS.values()))


def test_statistics_within_a_span() -> None:
    """Rows within a microsecond of the ends of the span belong to it."""
    found = score.known_numbers(ERROR, (6.0 + 9e-7, 8.0 - 9e-7))
    assert found == pytest.approx(
        {
            "final_horizontal_error_m": 17.0, "rms_horizontal_error_m": sqrt(458.0 / 2.0),
            "max_horizontal_error_m": 17.0, "final_height_error_m": -1.0, "rms_height_error_m": 5.0,
            "max_height_error_m": 7.0, "final_velocity_error_mps": 3.0, "rms_velocity_error_mps": sqrt(45.0),
            "max_velocity_error_mps": 9.0, "final_attitude_error_arcsec": 7.0,
            "rms_attitude_error_arcsec": sqrt(122.5), "max_attitude_error_arcsec": 14.0,
        },
        rel=1e-12,
    )  # fmt: skip
    assert score.known_numbers(ERROR, (6.0 + 2e-6, 8.0 - 2e-6))["max_height_error_m"] is None
    known = score.known_numbers(partly(), (0.0, 100.0))
    assert {name: known[name] for name in KNOWN} == pytest.approx(KNOWN, rel=1e-12)
    assert known["final_attitude_error_arcsec"] is None


def test_a_score_as_numbers() -> None:
    one = Score("theirs", Path("a/b.csv"), "csv", None, partly(), 2.5, ("So it is.",))
    found = score.to_json(one, (6.0, 8.0))
    assert {k: found[k] for k in ("name", "file", "format", "start_s", "end_s", "rows", "compute_s", "notes")} == {
        "name": "theirs", "file": "a/b.csv", "format": "csv", "start_s": 5.0, "end_s": 9.0, "rows": 4,
        "compute_s": 2.5, "notes": ["So it is."],
    }  # fmt: skip
    assert (found["compared_from_s"], found["compared_to_s"]) == (6.0, 8.0)
    assert found["errors"]["rms_horizontal_error_m"] == pytest.approx(sqrt(483.0 / 3.0))
    assert found["errors_compared"]["rms_horizontal_error_m"] == pytest.approx(sqrt(458.0 / 2.0))
    assert found["errors_compared"]["final_velocity_error_mps"] == 3.0
    sizes = {"a": 3.0, "b": None, "c": 2.0, "d": 7.0}
    assert score.ranking({n: {"rms_horizontal_error_m": v} for n, v in sizes.items()}) == ["c", "a", "d", "b"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("a/b", "at most 80"),
        (".x", "at most 80"),
        (" x", "at most 80"),
        ("x" * 81, "at most 80"),
        ("quaternion", "already"),
        ("two", "two solutions"),
    ],
)
def test_names_of_scores(name: str, said: str) -> None:
    from types import SimpleNamespace

    judge = SimpleNamespace(run=SimpleNamespace(solutions={"quaternion": None}))
    score.check_names(judge, ["My filter", "x" * 80, "a.b+c-d_e"])
    with pytest.raises(InputError, match=said):
        score.check_names(judge, ["two", name])


def test_flags_and_singular_passages() -> None:
    """Flags: 1 saturated, 2 dropped, 4 frozen; a sample counts once, whichever sensors set it."""
    flags = np.array(
        [[1, 1, 0, 0, 0, 1], [0, 3, 0, 0, 0, 0], [0, 0, 0, 0, 4, 0], [0, 0, 0, 0, 0, 0], [5, 0, 4, 0, 0, 0]]
    )
    imu = ImuData(np.arange(6.0), np.zeros((5, 3)), np.zeros((5, 3)), flags.astype(np.uint8))
    found = result.flagged(imu)
    assert found == {"saturated": 3, "dropped": 1, "frozen": 2}
    assert result.flagged(ImuData(imu.time, imu.dtheta, imu.dvel)) == {}
    said = result.flagged_words({"saturated": 3000, "dropped": 0, "frozen": 2}, 50_000)
    assert said == "Flagged by the sensors, of 50,000 samples: 3,000 saturated, 2 frozen."
    assert result.flagged_words({"saturated": 0}, 5) == ""
    events = (SingularityEvent(3.0, 3.5, 7.0 * SECOND, "near 90°"), SingularityEvent(5.0, 6.0, 9.0 * SECOND, "again"))
    bare = np.zeros(1)
    solutions = {
        name: NavSolution(bare, bare, bare, bare, bare, bare, bare, name, own)
        for name, own in (("euler", events), ("quaternion", ()))
    }
    assert error_exhibits.passage_numbers(solutions) == {
        "euler": [
            {"start_s": 3.0, "end_s": 3.5, "damage_arcsec": pytest.approx(7.0), "text": "near 90°"},
            {"start_s": 5.0, "end_s": 6.0, "damage_arcsec": pytest.approx(9.0), "text": "again"},
        ]
    }


def test_failures() -> None:
    """The second of four rows is not finite, and the last one again: it diverged at 6 s."""
    wrong = ERROR.velocity_ned.copy()
    wrong[1, 2], wrong[3] = inf, nan
    found = navigation_error.diverged(
        {"good": ERROR, "bad": NavError(ERROR.time, ERROR.position_ned, wrong, ERROR.attitude)}
    )
    assert list(found) == ["bad"]
    assert found["bad"].time == 6.0
    assert error_exhibits.failure_numbers({**found, "other": RunError("because.")}) == {
        "bad": {"time_s": 6.0, "text": "its errors are not finite from t = 6.00 s on: it diverged."},
        "other": {"time_s": None, "text": "because."},
    }


def test_numbers_that_json_can_hold() -> None:
    given = {"a": nan, "b": [1.5, -inf, (inf, "x")], "c": {"d": None, "e": 3, "f": True}}
    assert result.plain(given) == {"a": None, "b": [1.5, None, [None, "x"]], "c": {"d": None, "e": 3, "f": True}}


def test_versions_are_those_of_the_packages() -> None:
    import numba
    import pyarrow
    import scipy

    import sinssim

    found = result.versions()
    assert list(found) == ["sinssim", "jsbsim", "numpy", "scipy", "numba", "filterpy", "rerun-sdk", "pyarrow"]
    for name, module in (("sinssim", sinssim), ("numpy", np), ("scipy", scipy), ("numba", numba), ("pyarrow", pyarrow)):
        assert found[name] == module.__version__
