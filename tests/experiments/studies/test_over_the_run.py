"""Requirements over the whole run: value, its time, and since when they are exceeded, in every output of every kind."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import sinssim
from sinssim.analyses.error_budget.budget_exhibits import exhibits_of, lines_of, to_json
from sinssim.experiments.studies.trade_cells import cells_of
from sinssim.recording.console import show
from sinssim.recording.page import page_of
from tests.experiments.studies.trade_examples import AIDED, study
from tests.recording.by_hand import plain_text

OUTAGE = AIDED
for _before, _after in (
    ("zero_velocity = { rate_hz = 1.0, sigma_mps = 0.01 }\n", ""), ("laser-navigation", "tactical"),
    ("position_sigma_m = 2.0", "position_sigma_m = 0.5"),
    ("gnss = { rate_hz = 1.0 }", "gnss = { rate_hz = 1.0, outages_s = [[12.0, 38.0]] }"),
):  # fmt: skip
    OUTAGE = OUTAGE.replace(_before, _after)
LIMIT = "position_north(run) <= 1 m"
AXIS = ({"key": "imu.gyro_bias_sigma_deg_h", "values": (0.1, 0.2)},)


def test_the_budget_crosses_the_limit_at_that_time(tmp_path: Path) -> None:
    """Another budget has the limit at that time; before it, the error is smaller at every epoch of the outage."""
    (cell, _) = cells_of(study(tmp_path, OUTAGE, AXIS))
    assert cell.scenario is not None
    found = sinssim.budget(cell.scenario)
    (answer,) = found.answers([LIMIT])
    assert answer.exceeded is not None
    assert 12.0 < answer.exceeded.time < answer.time < 39.0
    assert answer.exceeded.fixes_end == 12.0
    moment = round(answer.exceeded.time, 1)  # of a sample
    (there,) = sinssim.budget(cell.scenario, times=(moment,)).answers([f"position_north({moment} s) <= 1 m"])
    assert there.value == pytest.approx(1.0, rel=0.01)
    sentence = f"It is {answer.exceeded.text}."
    assert re.fullmatch(r"It is exceeded from [\d.]+ s, [\d.]+ s after the fixes end\.", sentence)
    assert sentence in list(lines_of(answer))
    assert sentence in page_of(exhibits_of(found, [answer]))
    (stored,) = to_json(found, [answer])["requirements"]
    assert stored["exceeded_from_s"] == answer.exceeded.time
    assert stored["after_fixes_end_s"] == answer.exceeded.time - 12.0
    assert re.match(r"The largest value is [\d.]+ m at ", list(lines_of(answer))[1])
    (start,) = found.answers([f"position_north(0 s) <= {found.root_mean_square()[0, 0]} m"])
    assert list(lines_of(start))[1].endswith(" at 0 s, which is the limit.")
    (inertial,) = sinssim.budget(cell.scenario, solution="inertial").answers(["position_north(run) <= 0.001 m"])
    assert inertial.exceeded is not None
    assert inertial.exceeded.fixes_end is None  # no filter, no fixes


@pytest.mark.parametrize("kind", ["budget", "ensemble"])
def test_the_cells_of_a_trade_study(tmp_path: Path, kind: str) -> None:
    ask = (LIMIT, "position_north(run) <= 1 km")
    plan = study(tmp_path, OUTAGE, AXIS, require=ask, cell=kind, **({"runs": 4} if kind == "ensemble" else {}))
    result = sinssim.compare(plan, tmp_path / "made", threads=1)
    text = plain_text(lambda console: show(result.exhibits, console))
    for number in (1, 2):
        found = result.cells[number - 1].verdict(LIMIT)
        assert found is not None
        assert found.exceeded_from_s is not None
        assert found.exceeded_from_s < found.time_s
        assert found.after_fixes_end_s == pytest.approx(found.exceeded_from_s - 12.0)
        line = f"{found.value:.3g} m at {found.time_s:g} s, exceeded from {found.exceeded_from_s:.3g} s, "
        assert line in text.replace("\n", " ")
        assert 3.0 < found.after_fixes_end_s < 26.0
    stored = json.loads((tmp_path / "made" / "results.json").read_text(encoding="utf-8"))
    first = stored["cells"][0]["requirements"]
    assert [one["exceeded_from_s"] is None for one in first] == [False, True]
    page = (tmp_path / "made" / "report.html").read_text(encoding="utf-8")
    assert page.count("s after the fixes end") == 2
    assert "s after the fixes end" in (tmp_path / "made" / "summary.md").read_text(encoding="utf-8")
