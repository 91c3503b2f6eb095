"""The what-if of a trade study's page: the parts of the sources by hand, and in a browser what the budgets compute."""

from __future__ import annotations

import json
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.experiments.studies import trade_cells
from sinssim.experiments.studies.trade_result import TradeResult, what_if
from sinssim.experiments.studies.trade_run import _contents, _numbers, trade
from sinssim.recording.page import page_of
from sinssim.scenario.load import load_scenario
from sinssim.statistics.requirements import parse_quantity
from tests.browser import CHROMIUM, Page, file_address
from tests.experiments.studies.trade_examples import AXES, study

REQUIRE = ("r95(40 s) <= 8 m", "heading(run) <= 1 deg", "rate(end) <= 500 nmi/h")


def test_the_parts_of_a_source_by_hand() -> None:
    """Of a covariance with 9 i + j at row 0, and a hundred more at row 1; of a mean from 1 to 9, and ten more."""
    covariance = np.add.outer([0.0, 100.0], np.add.outer(9.0 * np.arange(9), np.arange(9)))
    mean = np.add.outer([0.0, 10.0], np.arange(1.0, 10.0))
    sources = [SimpleNamespace(name=name, label=name, group="of_it", unit="m", key="k", value=2.0, kind=kind)
               for name, kind in (("random", "drawn"), ("given", "given"), ("once", "one run"))]  # fmt: skip
    result: Any = SimpleNamespace(
        time=np.array([5.0, 6.0]), sources=sources, covariance={"random": covariance}, mean={"given": mean}
    )
    rows = {parse_quantity("r95(end)"): [1], parse_quantity("heading(run)"): [0, 1]}
    random, given, once = trade_cells.parts_of(result, rows)
    assert (random.group, random.value, random.random, given.random) == ("of it", 2.0, True, False)
    assert random.parts == {"r95(end)": [[100.0, 101.0, 110.0]], "heading(run)": [[80.0], [180.0]]}
    assert given.parts == {"r95(end)": [[11.0, 12.0]], "heading(run)": [[9.0], [19.0]]}
    assert np.isnan(once.value)
    assert once.parts["r95(end)"] == [[0.0, 0.0]]


def test_which_rows_a_quantity_needs() -> None:
    result: Any = SimpleNamespace(time=np.arange(1000.0), row=lambda time: int(time) + 7)
    course = -np.abs(np.arange(1000.0) - 330.0)
    rows = trade_cells._rows(result, parse_quantity("r95(run)"), course)
    assert (rows[0], rows[-1], len(rows)) == (0, 999, 41)
    assert 330 in rows
    assert trade_cells._rows(result, parse_quantity("r95(end)"), course) == [999]
    assert trade_cells._rows(result, parse_quantity("r95(20 s)"), course) == [27]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> TradeResult:
    folder = tmp_path_factory.mktemp("trade")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("figures.figure_of", "figures.save", "rerun_exhibits.record"):
            patch.setattr(f"sinssim.recording.{name}", lambda *_, **__: None)
        return trade(study(folder, axes=AXES[:1], require=REQUIRE))


def test_a_cell_is_read_as_it_was_written(result: TradeResult) -> None:
    numbers = result.cells[0].numbers
    assert numbers is not None
    back = _numbers(json.loads(json.dumps(_contents(numbers))))
    assert [vars(source) for source in back.sources] == [vars(source) for source in numbers.sources]
    assert back.instants == numbers.instants
    old = {key: value for key, value in _contents(numbers).items() if key not in ("sources", "instants")}
    assert _numbers(old).sources == ()  # a directory of an older version
    plain, _ = what_if(result)
    assert [cell["name"] for cell in plain["cells"]] == ["laser-navigation", "laser-standard"]
    assert plain["filter"] is False


@pytest.fixture(scope="module")
def page(result: TradeResult, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    if CHROMIUM is None:
        pytest.skip("there is no Chromium on this machine")
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(page_of(result.exhibits), encoding="utf-8")
    with Page(size=(1250, 1000)) as page:
        page.open(file_address(path), "live.tradeWhatIf")
        yield page
        assert page.problems == []


def enter(page: Page, field: str, factor: float) -> None:
    page.value(f"(f => {{f.value = {factor}; f.dispatchEvent(new Event('change'))}})({field})")


def test_a_setting_is_the_budgets_of_its_cells(page: Page, result: TradeResult) -> None:
    """Of all cells with half the gyros' noise and thrice another source; the quantities to 1e-6."""
    computed = page.value("live.tradeWhatIf.view.given.cells.map(cell => cell.computed)")
    np.testing.assert_allclose(page.value("live.tradeWhatIf.values()"), computed, rtol=1e-6)
    sources = page.value(
        "live.tradeWhatIf.view.given.sources.filter(s => s.name in live.tradeWhatIf.view.rows && s.key)"
    )
    cell = result.cells[0]
    assert cell.scenario is not None
    assert cell.numbers is not None
    values = {source.name: source.value for source in cell.numbers.sources}
    factors = {sources[0]["name"]: 0.5, sources[1]["name"]: 3.0}
    for name, factor in factors.items():
        enter(page, f"live.tradeWhatIf.view.rows['{name}'].field", factor)
    assert page.value("location.hash.slice(1)") == "&".join(f"{name}=x{factor:g}" for name, factor in factors.items())
    sets = [f"{source['key']}={values[source['name']] * factors[source['name']]!r}" for source in sources[:2]]
    again = budget(
        load_scenario(result.study.scenario, (*result.study.set, *cell.settings, *sets)), times=result.study.instants
    )
    r95, heading, rate = page.value("live.tradeWhatIf.values()")[0]
    assert r95 == pytest.approx(again.r95[again.row(40.0)], rel=1e-6)
    assert heading == pytest.approx(again.root_mean_square()[:, 8].max(), rel=1e-6)
    assert rate == pytest.approx(again.r95[-1] / 1852.0 / (again.time[-1] / 3600.0), rel=1e-6)
    words = page.value("live.tradeWhatIf.view.lines[0].verdicts.map(field => field.textContent)")
    limits = {r95: 8.0, heading: np.pi / 180.0, rate: 500.0}
    assert words == ["met" if value <= limit else "not met" for value, limit in limits.items()]
    page.value("[...document.querySelectorAll('.trade_what_if button')][0].click()")
    np.testing.assert_allclose(page.value("live.tradeWhatIf.values()"), computed, rtol=1e-6)


def test_the_command_names_what_has_a_single_key(page: Page, result: TradeResult) -> None:
    enter(page, "Object.values(live.tradeWhatIf.view.rows).at(-1).field", 2.0)
    name = page.value("Object.keys(live.tradeWhatIf.view.rows).at(-1)")
    command = page.value("live.tradeWhatIf.command()")
    source = next(source for source in result.cells[0].numbers.sources if source.name == name)  # type: ignore[union-attr]
    values = {source.value for cell in result.cells for source in cell.numbers.sources if source.name == name}  # type: ignore[union-attr]
    expected = f"--set '{source.key}=" if len(values) == 1 and source.key else f"# {name}: not the same"
    assert expected in command
    assert command.startswith("sinssim compare study.toml -o again")
