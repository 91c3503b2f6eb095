"""The what-if of a budget's page, in a real browser: what it computes is what the program computes."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.error_budget.budget_result import BudgetResult
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.cli import app as cli
from sinssim.scenario import Scenario
from sinssim.sensors.imu.grades import find_grade, read_grade
from sinssim.statistics.circular_error import radius_about_mean
from sinssim.units import DEG_SQRT_H
from tests.analyses.error_budget.worlds import PLACE, scenario
from tests.browser import CHROMIUM, Page, file_address
from tests.slow import slow

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")

TURN: dict[str, Any] = {
    "type": "rotation-table", **PLACE,
    "steps": [{"type": "dwell", "duration_s": 3.0},
              {"type": "turn", "axis": [0.0, 0.0, 1.0], "angle_deg": 90.0, "rate_deg_s": 20.0},
              {"type": "dwell", "duration_s": 2.5}],
}  # fmt: skip
"""Ten seconds: all epochs of a short motion are the page's."""
REQUIRED = ("r95(run) <= 7 m", "cep(6 s) <= 5 m", "heading(end) <= 25 arcmin", "velocity_north(run) <= 0.2 m/s")
START = {"position_sigma_m": 2.0, "velocity_sigma_mps": 0.05, "tilt_sigma_arcmin": 1.0, "heading_sigma_arcmin": 20.0}
IMU = {
    "grade": "tactical", "rate_hz": 20.0, "gyro_bias_deg_h": (0.5, -1.0, 0.0),
    "accel_misalignment_arcsec": (10.0, 20.0, 30.0, 40.0, 50.0, -60.0),
}  # fmt: skip
SETTINGS: list[dict[str, float]] = [
    {"gyro_misalignment": 30.0, "accel_bias": 0.5},
    {"gyro_bias_given": 3.0, "accel_misalignment_given": 0.1, "accel_scale": 20.0},
    *({name: 0.2} for name in ("accel_bias", "accel_misalignment_given", "initial_tilt")),
    *({name: 50.0} for name in ("gyro_scale", "initial_velocity", "accel_vrw", "gyro_arw")),
    dict.fromkeys(("gyro_misalignment", "accel_bias", "accel_scale", "initial_heading", "initial_position"), 0.01),
]
AIDED: dict[str, Any] = {
    "aiding": {"gnss": {"velocity": False}},
    "filter": {"states": ["gyro bias"], "initial_sigma": {"position_m": 2.0, "height_m": 2.0, "velocity_mps": 0.1,
                                                          "tilt_arcmin": 2.0, "heading_arcmin": 30.0}},
}  # fmt: skip
"""A filter that knows neither scale factors nor misalignments nor the accelerometers' biases, and states its start."""
UNKNOWN = ("gyro_scale", "accel_scale", "gyro_misalignment", "accel_misalignment", "accel_bias", "initial_tilt",
           "initial_heading", "initial_velocity")  # fmt: skip


def plan(*, aided: bool = False) -> Scenario:
    more = {
        "vertical": "free" if aided else "truth",
        "initial_error": {**START, **({"height_sigma_m": 2.0} if aided else {})},
    }
    imu = {key: value for key, value in IMU.items() if not (aided and key.startswith(("gyro_", "accel_")))}
    return scenario(motion=TURN, imu=imu, navigation=more, **(AIDED if aided else {}))


@pytest.fixture(scope="module")
def browser() -> Iterator[Page]:
    with Page(size=(1250, 1000)) as page:
        yield page


@pytest.fixture(scope="module", params=["inertial", *slow("filter")])
def world(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Scenario, BudgetResult]:
    one = plan(aided=request.param == "filter")
    return one, budget(one, tmp_path_factory.mktemp("budget") / "of", require=REQUIRED)


def opened(page: Page, result: BudgetResult, state: str = "") -> Page:
    page.problems.clear()
    page.open("about:blank")
    assert result.directory is not None
    page.open(file_address(Path(result.directory) / "report.html") + state, "live.whatIf && live.whatIf.view.result")
    return page


def set_to(page: Page, factors: dict[str, float]) -> dict[str, Any]:
    """Give sources other sizes by their fields, and return what the page then has."""
    page.value(
        f"(factors => {{const {{view}} = live.whatIf; view.budget.sources.forEach((source, k) => {{"
        "view.factors[k] = 1; const field = view.rows[k].value; if (!field) return;"
        "field.value = Math.abs(source.value) * (factors[source.name] ?? 1); field.dispatchEvent(new Event('change'))"
        f"}})}})({json.dumps(factors)})"
    )
    page.drawn()
    return dict(page.value("live.whatIf.view.result"))


def overrides(command: str) -> list[str]:
    words = shlex.split(command)
    return [words[k + 1] for k, word in enumerate(words) if word == "--set"]


def check(seen: dict[str, Any], result: BudgetResult) -> None:
    """Compare all that a page has with a budget, to 1e-6."""
    close = {"rtol": 1e-6, "atol": 1e-9}
    np.testing.assert_allclose(seen["cep"], result.cep, **close)
    np.testing.assert_allclose(seen["r95"], result.r95, **close)
    np.testing.assert_allclose(seen["table"], result.root_mean_square()[result.table_rows()], **close)
    for verdict, answer in zip(seen["verdicts"], result.answers(REQUIRED), strict=True):
        assert verdict["met"] == answer.met
        assert verdict["value"] == pytest.approx(answer.value, rel=1e-6)
    names = [source.name for source in result.sources]
    ranked = {names[item["k"]]: item for item in seen["ranked"][0]}
    for item in result.improvements():
        one = ranked[item.source.name]
        assert one["share"] == pytest.approx(item.share, rel=2e-6, abs=1e-9)
        assert one["alone"] == pytest.approx(item.alone, rel=1e-6, abs=1e-9)
        assert one["gain"] == pytest.approx(item.gain, rel=1e-5, abs=1e-6 * result.r95[-1])


@pytest.mark.parametrize("number", [1, *slow(0, *range(2, len(SETTINGS)))])
def test_a_setting_is_the_budget_of_its_command(
    world: tuple[Scenario, BudgetResult], browser: Page, number: int
) -> None:
    """With a filter, of sources that its model does not contain, so that its gains stay."""
    one, result = world
    factors = SETTINGS[number]
    if result.solution == "filter":
        names = [UNKNOWN[(3 * number + k) % len(UNKNOWN)] for k in range(1 + number % 3)]
        factors = dict.fromkeys(names, 0.05 * 2.0**number)
    seen = set_to(opened(browser, result), factors)
    settings = overrides(browser.value("live.whatIf.command()"))
    assert len(settings) == len(factors)
    check(seen, budget(one, overrides=settings, require=REQUIRED))
    assert browser.problems == []


@pytest.mark.slow
def test_its_command_can_be_given(world: tuple[Scenario, BudgetResult], browser: Page, tmp_path: Path) -> None:
    _, result = world
    page = opened(browser, result)
    set_to(page, {"accel_bias": 0.3, "accel_misalignment": 2.0})
    _, kind, file, *words = shlex.split(page.value("live.whatIf.command()"))
    assert result.directory is not None
    with pytest.raises(SystemExit) as stopped:
        cli.main([kind, str(result.directory / file), *words, "-o", str(tmp_path / "again"), "-q"])
    assert not stopped.value.code or stopped.value.code == 1  # 1: a requirement is not met
    found = json.loads((tmp_path / "again" / "budget.json").read_text(encoding="utf-8"))
    assert page.value("live.whatIf.view.result.r95.at(-1)") == pytest.approx(found["r95_m"], rel=1e-6)
    assert [item["requirement"] for item in found["requirements"]] == list(REQUIRED)


def test_the_gains_of_a_filter_stay(world: tuple[Scenario, BudgetResult], browser: Page) -> None:
    _, result = world
    factors = {source.name: 0.3 + 0.7 * k for k, source in enumerate(result.sources) if np.isfinite(source.value)}
    seen = set_to(opened(browser, result), factors)
    covariance, mean = result.scaled(factors)
    horizontal = (covariance[:, :2, :2], mean[:, :2])
    np.testing.assert_allclose(seen["r95"], radius_about_mean(*horizontal, 0.95), rtol=1e-6, atol=1e-9)
    assert ("gains" in browser.value("document.querySelector('.what_if').textContent")) == (result.solution == "filter")


@pytest.mark.slow
def test_the_largest_values_are_those_of_the_budget(world: tuple[Scenario, BudgetResult], browser: Page) -> None:
    _, result = world
    page = opened(browser, result)
    names = [source.name for source in result.sources]
    for number, answer in enumerate(result.answers(REQUIRED)):
        for allowance in answer.allowances:
            k = names.index(allowance.sources[0].name)
            ones = [1.0] * len(names)
            factor = page.value(f"(f => Number.isNaN(f) ? 'none' : f > 1e5 ? 'any' : f)(live.whatIf.allowed("
                                f"live.whatIf.budget, {number}, {ones}, {k}))")  # fmt: skip
            if not allowance.possible:
                assert factor == "none"
            elif allowance.factor > 1e5:
                assert factor == "any"
            else:
                assert factor == pytest.approx(allowance.factor, rel=3e-6)


def test_circles_of_all_shapes_are_those_of_the_program(world: tuple[Scenario, BudgetResult], browser: Page) -> None:
    page, generator = opened(browser, world[1]), np.random.default_rng(3)
    count = 60
    sides = np.column_stack((np.ones(count), 10.0 ** -generator.uniform(0.0, 6.0, count)))
    sides[:3, 1] = 0.0
    turn = generator.uniform(0.0, np.pi, count)
    ways = np.stack((np.cos(turn), np.sin(turn), -np.sin(turn), np.cos(turn)), axis=1).reshape(-1, 2, 2)
    covariance = np.einsum("kai,ka,kaj->kij", ways, sides**2, ways)
    far = np.where(np.arange(count) % 2, 10.0 ** -generator.uniform(-2.0, 2.0, count), 0.0)
    mean = generator.normal(0.0, 1.0, (count, 2)) * far[:, None]
    for share in (0.5, 0.95):
        rows = [
            [*(float(v) for v in (p[0, 0], p[0, 1], p[1, 1])), *m.tolist()]
            for p, m in zip(covariance, mean, strict=True)
        ]
        seen = page.value(f"{rows}.map(([nn, ne, ee, n, e]) => live.whatIf.radius({{nn, ne, ee, n, e}}, {share}))")
        np.testing.assert_allclose(seen, radius_about_mean(covariance, mean, share), rtol=1e-8)


def choose(page: Page, grade: str) -> str:
    """Choose a grade, and return what the page says to it."""
    chosen = f"(e => {{e.value = '{grade}'; e.dispatchEvent(new Event('change'))}})"
    page.value(f"{chosen}(document.querySelector('.what_if select'))")
    page.drawn()
    return str(page.value("document.querySelector('.said-here').textContent"))


def test_grades_the_address_and_the_keyboard(
    browser: Page, world: tuple[Scenario, BudgetResult], tmp_path: Path
) -> None:
    _, result = world
    page = opened(browser, result, "#gyro_arw=0.5&accel_bias=oops&nothing=1")
    names = [source.name for source in result.sources]
    arw = names.index("gyro_arw")
    assert page.value(f"live.whatIf.view.rows[{arw}].value.value") == "0.5"
    assert page.value("live.whatIf.view.factors.filter(f => f !== 1).length") == 1
    given = [name.removesuffix("_given") for name in names if name.endswith("_given")]
    assert ", ".join(given) in choose(page, "laser-standard")
    said = choose(page, "stim300")
    assert "gyro_flicker" in said
    assert "accel_flicker, which this budget does not have" in said
    wanted = find_grade("stim300")
    assert float(page.value(f"live.whatIf.view.rows[{arw}].value.value")) == pytest.approx(
        wanted.gyro.random_walk / DEG_SQRT_H, rel=1e-9
    )
    file = tmp_path / "mine.toml"
    file.write_text(page.value("live.whatIf.grade()"), encoding="utf-8")
    assert read_grade(file).gyro.random_walk == pytest.approx(wanted.gyro.random_walk, rel=1e-9)
    assert read_grade(file).accel.random_walk == pytest.approx(wanted.accel.random_walk, rel=1e-9)
    hash_ = page.value("location.hash")
    page.value("document.querySelector('.what_if button').click()")
    page.drawn()
    assert page.value("live.whatIf.view.factors.every(f => f === 1)")
    again = opened(browser, result, hash_)
    ratio = wanted.gyro.random_walk / find_grade("tactical").gyro.random_walk
    assert again.value(f"live.whatIf.view.factors[{arw}]") == pytest.approx(ratio)
    again.value("document.querySelectorAll('.what_if button')[0].click()")
    again.drawn()
    again.value(f"live.whatIf.view.rows[{arw}].range.focus()")
    again.key("ArrowRight")
    again.drawn()
    assert again.value(f"live.whatIf.view.factors[{arw}]") == pytest.approx(10.0**0.01, rel=5e-3)
    assert again.problems == []
