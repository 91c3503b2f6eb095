"""The recording of a trade study: its view shows what is recorded, and the lines are those of the cells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

import sinssim
from sinssim.experiments.studies.trade_cells import CellNumbers
from sinssim.experiments.studies.trade_exhibits import shown_cells
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_run import TradeMedia
from sinssim.recording.rerun_exhibits import record
from sinssim.recording.rerun_viewer import find_run_info
from sinssim.recording.rerun_views import all_views, load_view
from tests.analyses.error_budget.test_budget_recording import views
from tests.experiments.studies.trade_examples import AXES, BIAS, study


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> TradeResult:
    """A small study of budgets, 2 × 2 cells."""
    folder = tmp_path_factory.mktemp("trade")
    axes = (AXES[0], {"key": BIAS, "values": (0.001, 0.1)})
    return sinssim.compare(study(folder, axes=axes, require=("r95(end) <= 4 m",)), folder / "study")


def values_of(recording: Path, entity: str) -> list[list[float]]:
    """Return the recorded rows of an entity, in order."""
    found: list[list[float]] = []
    for chunk in RrdReader(recording).stream().filter(content=f"/{entity}"):
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name.endswith("Scalars:scalars"):
                found += batch.column(name).to_pylist()
    return found


def test_the_view_shows_what_is_recorded(result: TradeResult) -> None:
    assert result.directory is not None
    recording = result.directory / "recording.rrd"
    info = find_run_info(recording)
    assert [tab.name for tab in all_views(info).root_container.contents] == ["trade"]
    entities = {chunk.entity_path for chunk in RrdReader(recording).stream()}
    shown = views(load_view("trade", info).root_container)
    assert {type(view) for view in shown} == {rrb.TimeSeriesView, rrb.Spatial2DView, rrb.TextDocumentView}
    for view in shown:
        assert any(entity.startswith(str(view.origin)) for entity in entities), view.origin
    plots = [view.name for view in shown if isinstance(view, rrb.TimeSeriesView)]
    assert plots == ["R95 [m] of each cell", "CEP [m] of each cell"]
    assert {"/trade/r95", "/trade/cep"} <= entities


def test_the_lines_are_those_of_the_cells(result: TradeResult) -> None:
    """The last recorded value is the R95 of the cell's own budget, in metres."""
    assert result.directory is not None
    ends = values_of(result.directory / "recording.rrd", "trade/r95")[-1]
    np.testing.assert_allclose(ends, result.values("r95(end)").ravel(), rtol=1e-12)


def test_of_many_cells_some_are_recorded(result: TradeResult, tmp_path: Path) -> None:
    """At most ten lines, the least and the largest R95 among them; a study without a finished cell has a view, too."""
    ends = [float((7 * n) % 23) for n in range(1, 23)]
    of: Any = [CellNumbers({}, (), np.arange(2.0), np.zeros(2), np.array([0.0, end]), ()) for end in ends]
    many = TradeResult(result.study, tuple(replace(result.cells[0], numbers=one) for one in of), media=TradeMedia())
    chosen = [numbers.r95[-1] for _, numbers in shown_cells(many)]
    assert len(chosen) == 10
    assert {1.0, 22.0} <= set(chosen)
    assert chosen == [end for end in ends if end in chosen]
    cells = tuple(replace(one, numbers=None, failure="it fell.") for one in result.cells)
    failed = TradeResult(result.study, cells, "failed", media=TradeMedia())
    record(failed.exhibits, tmp_path / "recording.rrd")
    shown = views(load_view("trade", find_run_info(tmp_path / "recording.rrd")).root_container)
    assert "0 of 4 cells" in next(view.name for view in shown if isinstance(view, rrb.TimeSeriesView))
