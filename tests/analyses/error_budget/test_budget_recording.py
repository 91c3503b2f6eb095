"""The recording of a budget: its view shows what is recorded, with units and over the whole run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

import sinssim
from sinssim.analyses.error_budget.budget_exhibits import exhibits_of
from sinssim.recording.rerun_exhibits import record
from sinssim.recording.rerun_viewer import find_run_info
from sinssim.recording.rerun_views import all_views, load_view
from tests.analyses.error_budget.worlds import SHORT_TURN, scenario


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording of a short budget."""
    path = tmp_path_factory.mktemp("budget") / "recording.rrd"
    record(exhibits_of(sinssim.budget(scenario(motion=SHORT_TURN, imu={"grade": "tactical"}))), path)
    return path


def views(part: rrb.Container | rrb.View) -> list[rrb.View]:
    if isinstance(part, rrb.View):
        return [part]
    return [view for child in part.contents for view in views(child)]


def test_the_view_shows_what_is_recorded(recording: Path) -> None:
    info = find_run_info(recording)
    entities = {chunk.entity_path for chunk in RrdReader(recording).stream()}
    shown = views(load_view("budget", info).root_container)
    assert {type(view) for view in shown} == {rrb.TimeSeriesView, rrb.Spatial2DView, rrb.TextDocumentView}
    for view in shown:
        assert any(entity.startswith(str(view.origin)) for entity in entities), view.origin
        if isinstance(view, rrb.TimeSeriesView):
            assert re.search(r"\[(%|m|mm|nmi|m/s|mm/s|deg|arcmin|arcsec)\]", view.name), view.name
            span = view.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()[0]
            assert span["start"] == 0
            assert span["end"] >= info.end * 1e9


def test_other_views_are_left_out(recording: Path) -> None:
    assert [tab.name for tab in all_views(find_run_info(recording)).root_container.contents] == ["budget"]
