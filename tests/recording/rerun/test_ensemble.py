"""The recording of an ensemble: positions over time, CEP and R95, and its view."""

from __future__ import annotations

import json

import numpy as np
from rerun.chunk import RrdReader

import sinssim
from sinssim.ensembles.summary import ensemble_numbers
from sinssim.recording.rerun.ensemble import record
from sinssim.recording.rerun.views import RunInfo, all_views
from tests.ensembles.examples import AIDED, scenario


def test_recording_and_view(tmp_path) -> None:
    result = sinssim.ensemble(scenario(AIDED), 4, threads=1)
    record(result, ensemble_numbers(result), tmp_path / "recording.rrd")
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
    cep = np.array([row[0] for row in rows])
    size = np.nanmax(result.cep.value) / np.nanmax(cep)  # metres, or a unit that suits them
    np.testing.assert_allclose(cep * size, result.cep.value, rtol=1e-12)
    run = RunInfo("x", 0.0, 1.0, ("aided",), labels={"kind": "ensemble", "filter": "yes"})
    layout = all_views(run)
    assert [tab.name for tab in layout.root_container.contents] == ["ensemble"]
    assert json.loads(run.to_json())["labels"]["kind"] == "ensemble"
