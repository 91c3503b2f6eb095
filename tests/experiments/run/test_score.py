"""The recording of scored solutions: its lines are the errors against the truth, and the view shows what is there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

from sinssim.data import Array
from sinssim.experiments.run.run_scores import Scored, record_scores
from sinssim.logs.formats import DEFAULT_START
from sinssim.logs.gps_time import parse_date
from sinssim.logs.solution_score import Judge, common_span
from sinssim.logs.stored_run import RecordedRun
from sinssim.recording.rerun_viewer import find_run_info
from sinssim.recording.rerun_views import all_views, load_view
from tests.analyses.error_budget.test_budget_recording import views
from tests.logs.short_run import short_run

OFFSET, SIGMA = 3.0, 0.25
"""Error of the scored heights, and the σ that the file claims, m."""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The truth with heights that are off by a constant, and a little north, without attitude, scored as a solution."""
    folder = tmp_path_factory.mktemp("score")
    judge = Judge(RecordedRun(short_run()), parse_date(DEFAULT_START, "start"))
    t = judge.run.solution("truth")
    sigma = np.full((len(t), 3), SIGMA)
    north = t.latitude + 1e-7  # 0.6 m: the errors of the filter are not far larger, and are drawn
    rows = np.column_stack((t.time, north, t.longitude, t.height + OFFSET, t.velocity_ned, sigma))[::5]
    names = "time_s,latitude_rad,longitude_rad,height_m,velocity_n_mps,velocity_e_mps,velocity_d_mps"
    text = "\n".join(",".join(map(repr, row)) for row in rows.tolist())
    (folder / "high.csv").write_text(f"{names},sigma_n_m,sigma_e_m,sigma_d_m\n{text}\n")
    scores = [judge.score(folder / "high.csv", name="too high")]
    span = common_span(scores)
    errors = {**judge.run_errors(span), "too high": scores[0].error}
    record_scores(Scored(judge, scores, errors, span), folder / "recording.rrd")
    return folder / "recording.rrd"


def line_of(recording: Path, key: str, name: str) -> Array:
    """Return the recorded numbers of a line of a plot, in the plot's unit."""
    names: dict[str, list[str]] = {}
    rows: dict[str, list[Any]] = {}
    for chunk in RrdReader(recording).stream().filter(content=f"/score/{key}/**"):
        batch = chunk.to_record_batch()
        for column in batch.schema.names:
            if column.endswith("SeriesLines:names"):
                names[chunk.entity_path] = batch.column(column).to_pylist()[0]
            if column.endswith("Scalars:scalars"):
                rows.setdefault(chunk.entity_path, []).extend(batch.column(column).to_pylist())
    for entity, several in names.items():
        if name in several:
            return np.array(rows[entity])[:, several.index(name)]
    return np.empty(0)


def test_the_lines_are_the_errors_and_the_given_sigma(recording: Path) -> None:
    info = find_run_info(recording)
    assert info.label("score/height") == "m"
    np.testing.assert_allclose(line_of(recording, "height", "too high"), OFFSET, atol=1e-8)
    bound = line_of(recording, "height", "too high, ±3σ")
    np.testing.assert_allclose(bound, [3 * SIGMA] * 201, rtol=1e-12)
    assert not len(line_of(recording, "velocity_north", "too high, ±3σ")), "the file has no σ of the velocity"
    assert not len(line_of(recording, "azimuth", "too high")), "it has no attitude"
    own = RecordedRun(short_run())
    unit = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}[info.label("score/position_east")]
    aided = line_of(recording, "position_east", "aided")
    np.testing.assert_allclose(aided[-1] * unit, own.errors("aided")[2, -1])
    bound = line_of(recording, "position_east", "aided, ±3σ")
    np.testing.assert_allclose(bound[-1] * unit, 3.0 * own.table("filter")["sigma_position_e_m"][-1])


def test_the_view_shows_what_is_recorded(recording: Path) -> None:
    info = find_run_info(recording)
    assert [tab.name for tab in all_views(info).root_container.contents] == ["score"]
    entities = {chunk.entity_path for chunk in RrdReader(recording).stream()}
    shown = views(load_view("score", info).root_container)
    for view in shown:
        assert any(entity.startswith(str(view.origin)) for entity in entities), view.origin
    plots = [str(view.name) for view in shown if isinstance(view, rrb.TimeSeriesView)]
    assert len(plots) == 10
    assert "Height error [m]" in plots
    assert sum(isinstance(view, rrb.MapView) for view in shown) == 1


def test_what_no_solution_has_has_no_plot(recording: Path) -> None:
    info = find_run_info(recording)
    without = {entity: both for entity, both in info.ranges.items() if "tilt" not in entity}
    shown = views(load_view("score", type(info)(**{**vars(info), "ranges": without})).root_container)
    assert not [view for view in shown if "Tilt" in str(view.name)]
