"""The filter of a project: what it gets, in which order, and what is said of one that fails."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.content import package_content
from sinssim.errors import InputError
from sinssim.estimation import SHIPPED
from sinssim.scenario import Scenario
from sinssim.scenario.ensemble_section import EnsembleSection
from sinssim.simulation.truth_comparison import FilterSolution
from sinssim.system.registries import forget
from tests.slow import slow

INERTIAL = '''"""Inertial navigation that notes what arrives, and states 1σ."""
import numpy as np
import sinssim

class Filter:
    seen = []
    def __init__(self, start):
        self.state, self.now, self.sigma = start, 0.0, np.arange(9.0)
        Filter.seen = []
    def predict(self, increments):
        assert len(increments) <= 10
        self.state, self.now = sinssim.navigate(increments, self.state).state(), float(increments.time[-1])
    def update(self, reading):
        Filter.seen.append((self.now, *reading))
    def solution(self):
        return self.state
'''


@pytest.fixture
def project(tmp_path: Path) -> Any:
    """Return a function that writes a filter and returns a run of it beside the filter of the scenario."""

    def run(text: str, name: str = "mine", **changes: Any) -> sinssim.Run:
        folder = tmp_path / "filters"
        folder.mkdir(exist_ok=True)
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
        base: dict[str, Any] = {
            "name": "project", "seed": 2, "use": [str(tmp_path)],
            "great_circle": {"latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 3000.0, "course_deg": 30.0,
                             "speed_mps": 100.0, "duration_s": 20.0},
            "imu": {"grade": "laser-standard", "rate_hz": 20.0}, "aiding": {"gnss": {"latency_s": 0.33}},
            "navigation": {"algorithms": ["quaternion"], "vertical": "free"},
            "filter": {"states": [], "rate_hz": 2.0}, "filters": [{"name": "tried", "kind": name}],
        }  # fmt: skip
        result = sinssim.run(Scenario(**{**base, **changes}))
        assert isinstance(result, sinssim.Run)
        return result

    yield run
    forget()


def test_it_gets_increments_and_late_readings_in_the_order_of_their_arrival(project: Any) -> None:
    """Every increment once: its solution is the inertial one. Fixes of whole seconds arrive at the next sample."""
    run = project(INERTIAL)
    of, inertial = run.solutions["tried"], run.solutions["quaternion"]
    assert isinstance(of, FilterSolution)
    rows = np.searchsorted(inertial.time, of.time - 1e-6)
    np.testing.assert_allclose(of.time, inertial.time[rows])
    np.testing.assert_allclose(of.latitude, inertial.latitude[rows], rtol=0, atol=1e-10)
    np.testing.assert_allclose(of.velocity_ned, inertial.velocity_ned[rows], rtol=0, atol=1e-4)
    assert set(np.arange(0.0, 20.25, 0.5)) <= set(of.time.round(6))  # filter.rate_hz
    np.testing.assert_array_equal(of.sigma, np.tile(np.arange(9.0), (len(of.time), 1)))
    seen = __import__("sys").modules["sinssim_own.filters.mine"].Filter.seen
    times = sorted({(now, at) for now, _, _, at, *_ in seen})
    np.testing.assert_allclose([now for now, _ in times], np.arange(1.0, 20.0) + 0.35, atol=1e-9)
    np.testing.assert_allclose([at for _, at in times], np.arange(1.0, 20.0), atol=1e-9)
    assert {(sensor, kind) for _, sensor, kind, *_ in seen} == {
        ("gnss-position", "gnss-position"), ("gnss-velocity", "gnss-velocity"),
    }  # fmt: skip
    _, _, _, _, value, sigma, arm = next(one for one in seen if one[2] == "gnss-velocity" and one[3] > 0.5)
    assert np.hypot(*value[:2]) == pytest.approx(100.0, abs=0.5)
    assert sigma.shape == arm.shape == (3,)
    numbers = run.summary["filters"]["tried"]
    assert numbers["kind"] == "mine"
    assert numbers["rms_horizontal_sigma_m"] == pytest.approx(1.0)  # 0 and 1 m
    assert numbers["rms_heading_sigma_arcmin"] == pytest.approx(8.0 * 3437.746771)
    assert [numbers[key] for key in ("states", "nees_per_state", "consistent", "diverged_s")] == [None] * 4


def test_the_filter_of_a_new_project_follows_the_fixes(project: Any) -> None:
    text = (package_content("scenarios") / "new_project" / "filters" / "complementary.py").read_text(encoding="utf-8")
    start = {"velocity_north_mps": 5.0}
    navigation = {"algorithms": ["quaternion"], "vertical": "free", "initial_error": start}
    run = project(text, "complementary", aiding={"gnss": {}}, navigation=navigation)
    horizontal = run.errors["tried"].horizontal
    assert horizontal[-1] < 6.0 < run.errors["quaternion"].horizontal[-1]
    assert np.abs(run.errors["tried"].velocity_ned[-1]).max() < 0.2


def test_an_ensemble_of_it_has_its_errors(project: Any) -> None:
    """Those of its solution in a run with the seed of the ensemble's run; it has no covariance to test."""
    run = project(INERTIAL)
    runs = sinssim.ensemble(run.scenario.model_copy(update={"ensemble": EnsembleSection(solution="tried")}), runs=2)
    assert runs.summary["solution"] == "tried"
    assert not runs.summary.get("nees")
    again = sinssim.run(runs.member(0).scenario)
    assert isinstance(again, sinssim.Run)
    final = again.errors["tried"].horizontal[-1]
    assert runs.final_horizontal[0] == pytest.approx(final, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("        return self.state", "        return 1.0"), "solution() at 0 s returns a float instead of a sinssim"),
        (("        return self.state", "        return sinssim.NavState(**{**vars(self.state), "
          "'height': np.nan if self.now > 3 else 0.0})"), "solution() at 3.35 s has height = nan."),
        (("np.arange(9.0)", "-np.arange(9.0)"), "it is nine standard deviations, of position, velocity and attitude"),
        (("        assert len(increments) <= 10", "        1 / 0"), "predict() at 0.5 s: the filter mine failed: "),
    ],
)  # fmt: skip
def test_a_filter_that_fails_has_no_result_and_the_run_keeps_the_rest(
    project: Any, change: tuple[str, str], message: str
) -> None:
    assert change[0] in INERTIAL
    run = project(INERTIAL.replace(*change))
    assert "tried" not in run.solutions
    assert message in str(run.navigated.failures["tried"])
    assert run.aided is not None
    assert list(run.summary["filters"]) == ["aided"]


def test_what_is_no_filter_is_refused(project: Any) -> None:
    with pytest.raises(
        InputError, match=r"the filter mine cannot be used: .*mine\.py: the class Filter has no update\("
    ):
        project(INERTIAL.replace("def update", "def take"))
    forget()
    with pytest.raises(InputError, match=r"mine\.py defines no Filter"):
        project(INERTIAL.replace("class Filter", "class Other").replace("Filter.seen", "Other.seen"))
    with pytest.raises(InputError, match=r"filters\.1: a filter of a project has no keys but name, kind, rate_hz and"):
        project(INERTIAL, filters=[{"name": "a", "kind": "mine", "gate": 0.0}])
    with pytest.raises(InputError, match=r'kind = "mine" is the filter of a project; it stands in \[\[filters\]\]'):
        project(INERTIAL, filter={"kind": "mine"}, filters=[])


DEMANDS: dict[str, dict[str, Any]] = {
    "late readings": {"aiding": {"gnss": {"latency_s": 1.3}, "baro": {}}},
    "an outage": {"aiding": {"gnss": {"outages_s": [[6.0, 16.0]]}, "baro": {}}},
    "an outage and a delay that is unknown": {
        "aiding": {"gnss": {"latency_s": 0.33, "outages_s": [[6.0, 16.0]], "time_offset_sigma_s": 0.02}}},
    "flicker": {"imu": {"grade": "laser-standard", "rate_hz": 20.0, "gyro_flicker_deg_h": 1.0},
                "filter": {"states": ["gyro bias", "gyro flicker"], "rate_hz": 2.0}},
    "redundant sensors": {"imu": {"grade": "laser-standard", "rate_hz": 20.0, "sensor_set": {"type": "redundant"}}},
    "known gravity": {"gravity": {"model": "egm2008", "degree": 20}, "navigation": {
        "algorithms": ["quaternion"], "vertical": "free", "gravity_degree": 20}},
    "a smoother of the first": {"filter": {"states": [], "rate_hz": 2.0, "smooth": True, "backward": True}},
    "a diagnosis of the first": {"filter": {"states": [], "rate_hz": 2.0, "diagnose": True}},
}  # fmt: skip

QUICK = "an outage and a delay that is unknown"

REFUSED: dict[str, tuple[tuple[str, ...], dict[str, Any], str]] = {
    "smooth": (("unscented", "cubature", "ensemble"), {"smooth": True}, "has no smoother"),
    "backward": (("invariant", "unscented", "cubature", "ensemble"), {"backward": True}, "no filter in reverse time"),
    "open": (("invariant",), {"loop": "open"}, "it needs loop"),
}


@pytest.mark.parametrize("demand", [QUICK, *slow(*(demand for demand in DEMANDS if demand != QUICK))])
def test_every_kind_takes_what_the_error_state_filter_takes(project: Any, demand: str) -> None:
    """Small errors: each kind has its solution within a tenth of its 1σ; the filter of a project runs to the end."""
    filters = [{"name": f"by-{kind}", "kind": kind} for kind in SHIPPED]
    small = {"tilt_sigma_arcmin": 0.2, "heading_sigma_arcmin": 1.0}
    of_demand = {"navigation": {"algorithms": ["quaternion"], "vertical": "free"}, **DEMANDS[demand]}
    of_demand["navigation"] = of_demand["navigation"] | {"initial_error": small}
    run = project(INERTIAL, filters=[{"name": "tried", "kind": "mine"}, *filters], **of_demand)
    first = run.aided.estimate
    assert first.divergence is None
    for name in (f"by-{kind}" for kind in SHIPPED):
        of = run.solutions[name].aided
        assert of.estimate.divergence is None
        apart = np.hstack([of.error.position_ned - run.aided.error.position_ned,
                           of.error.attitude - run.aided.error.attitude])  # fmt: skip
        assert np.max(np.abs(apart) / first.sigma[:, [0, 1, 2, 6, 7, 8]]) < 0.1, name
        assert of.estimate.smoothed is of.estimate.backward is None
    assert run.solutions["tried"].time[-1] == pytest.approx(20.0)


@pytest.mark.parametrize(("what", "kind"), [(what, kind) for what in REFUSED for kind in REFUSED[what][0]])
def test_what_a_kind_cannot_do_is_refused_by_name(project: Any, what: str, kind: str) -> None:
    _, keys, message = REFUSED[what]
    with pytest.raises(ValueError, match=f'kind = "{kind}" .*{message}'):
        project(INERTIAL, filters=[], filter={"kind": kind, **keys})


def test_every_kind_that_is_not_refused_does_it() -> None:
    """A smoother, a filter in reverse time and an open loop of all kinds but those that are refused."""
    done = {what: [kind for kind in SHIPPED if kind not in kinds] for what, (kinds, _, _) in REFUSED.items()}
    assert done["smooth"] == ["error-state", "invariant"]
    base = {
        "name": "c", "great_circle": {"latitude_deg": 48.0, "altitude_m": 3000.0, "course_deg": 30.0,
                                      "speed_mps": 100.0, "duration_s": 8.0},
        "imu": {"grade": "laser-standard", "rate_hz": 10.0}, "aiding": {"gnss": {}},
    }  # fmt: skip
    for what, kinds in done.items():
        for kind in kinds:
            run = sinssim.run(Scenario(**base, filter={"kind": kind, "states": [], "rate_hz": 1.0, **REFUSED[what][1]}))
            assert isinstance(run, sinssim.Run)
            assert run.aided is not None
            estimate = run.aided.estimate
            assert estimate.divergence is None
            assert (estimate.smoothed is not None, estimate.backward is not None) == (
                what == "smooth",
                what == "backward",
            )
