"""The recording of an ensemble: positions over time, CEP and R95, and its view."""

from __future__ import annotations

import json

import numpy as np
import pytest
from rerun.chunk import RrdReader

import sinssim
from sinssim.experiments.ensembles.ensemble_verdicts import judge
from sinssim.recording.rerun_exhibits import record
from sinssim.recording.rerun_views import RunInfo, all_views
from sinssim.statistics.requirements import parse_requirements
from tests.experiments.ensembles.examples import AIDED, scenario


def test_recording_and_view(tmp_path) -> None:
    result = sinssim.ensemble(scenario(AIDED), 4, threads=1)
    record(result.exhibits, tmp_path / "recording.rrd")
    chunks = list(RrdReader(tmp_path / "recording.rrd").stream())
    entities = {chunk.entity_path for chunk in chunks}
    for wanted in ("growth", "cloud/runs", "cloud/cep", "cloud/r95", "sigma_position", "sigma_attitude", "nees", "nis"):
        assert f"/ensemble/{wanted}" in entities
    rows = [
        value
        for chunk in chunks
        if chunk.entity_path == "/ensemble/growth" and not chunk.is_static
        for value in chunk.to_record_batch().column("Scalars:scalars").to_pylist()
    ]
    assert len(rows) == len(result.time)
    cep = np.array([row[-1] for row in rows])
    size = np.nanmax(result.cep.value) / np.nanmax(cep)  # metres, or a unit that suits them
    np.testing.assert_allclose(cep * size, result.cep.value, rtol=1e-12)
    run = RunInfo("x", 0.0, 1.0, ("aided",), labels={"kind": "ensemble", "filter": "yes"})
    layout = all_views(run)
    assert [tab.name for tab in layout.root_container.contents] == ["ensemble"]
    assert json.loads(run.to_json())["labels"]["kind"] == "ensemble"


def test_limits_of_requirements_are_below_their_plots(tmp_path) -> None:
    result = sinssim.ensemble(scenario(), 8, threads=1)
    near = 1.1 * float(np.nanmax(result.r95.value))
    texts = [
        f"r95(run) <= {near} m",
        f"cep(20 s) <= {near} m",
        "heading(end) <= 90 deg",
        "velocity_down(run) <= 9 km/h",
    ]
    result.verdicts = tuple(judge(result, one) for one in parse_requirements(texts))
    record(result.exhibits, tmp_path / "recording.rrd")
    chunks = list(RrdReader(tmp_path / "recording.rrd").stream())
    found = {}
    for chunk in chunks:
        if "/limit_" in chunk.entity_path and not chunk.is_static:
            batch = chunk.to_record_batch()
            values = [value[0] for value in batch.column("Scalars:scalars").to_pylist()]
            found[chunk.entity_path] = (batch.column("sim_time").to_numpy().astype("int64") / 1e9, values)
    assert set(found) == {"/ensemble/growth/limit_1", "/ensemble/growth/limit_2"}  # the others are far away
    line, mark = found["/ensemble/growth/limit_1"], found["/ensemble/growth/limit_2"]
    assert line[0].tolist() == [0.0, 30.0]
    assert mark[0].tolist() == [20.0]
    assert line[1] == [mark[1][0]] * 2
    assert line[1][0] == pytest.approx(near) or line[1][0] * 1000.0 == pytest.approx(near)
