"""A real drive with a MEMS unit and RTK; see tests/data/drive/drive.toml for where it comes from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sinssim
from sinssim.logs.log_files import fix_stream, solution_stream
from sinssim.logs.recorded_log import recorded_log

DRIVE = Path(__file__).parents[1] / "data" / "drive" / "drive.toml"


def test_what_is_known_of_the_recording() -> None:
    """Rate, span, mounting and clock as the description of the data has them."""
    plan = sinssim.load_scenario(DRIVE)
    assert plan.log is not None
    log = recorded_log(plan.log)
    assert log.rate_hz == pytest.approx(100.0, rel=1e-6)
    assert log.imu.time[-1] == pytest.approx(181.0, abs=0.05)
    assert log.rates["gnss-position"] == pytest.approx(4.0, rel=0.01)
    # it stands for 3 s, tilted by 6.7° in pitch: the specific force is gravity, up
    still = log.imu.time[1:] < 2.5
    force = log.imu.dvel[still].sum(axis=0) / (log.imu.time[1:][still][-1] - log.imu.time[0])
    assert np.linalg.norm(force) == pytest.approx(9.80, rel=0.02)
    assert force[2] < 0.0
    assert np.degrees(np.arctan2(-force[0], -force[2])) == pytest.approx(6.7, abs=1.5)


def test_the_filter_follows_rtk_to_a_centimetre() -> None:
    """The bars: at most 2.5 % of the positions refused, 10 mm from RTK, innovations of at most 13 mm (rms)."""
    run = sinssim.run(sinssim.load_scenario(DRIVE, ["log.to_s=20.0", "filter.smooth=false"]))
    place = next(s for name, s in run.summary["filter"]["sensors"].items() if name == "gnss-position")
    assert run.summary["filter"]["divergence"] is None
    assert place["refused"] <= 0.025 * place["readings"]
    assert run.summary["filter"]["aided"]["rms_horizontal_error_m"] <= 0.010
    assert run.aided is not None
    innovations = run.aided.estimate.innovations[0]
    taken = innovations.value[innovations.accepted]
    assert np.sqrt(np.mean(np.sum(taken[:, :2] ** 2, axis=1))) <= 0.013


@pytest.mark.slow
def test_outages_of_fifteen_seconds_in_three_phases() -> None:
    """The bars of inertial navigation alone: 5.3 m in the median and 13 m in 90 % at the end of 15 s.

    The slice has the worst stretch of the whole drive, on which the figures were taken: four of its outages a phase.
    """
    ends, smoothed = [], []
    for first in (30.0, 45.0, 60.0):
        settings = [f"log.outages.{key}={value}" for key, value in (("length_s", 15.0), ("every_s", 45.0))]
        run = sinssim.run(sinssim.load_scenario(DRIVE, [*settings, f"log.outages.first_s={first}"]))
        ends += [one["horizontal_error_m"] for one in run.summary["outages"]["each"]]
        smoothed += [one["smoothed_max_horizontal_error_m"] for one in run.summary["outages"]["each"]]
    assert len(ends) >= 10
    assert np.median(ends) <= 7.0
    assert np.percentile(ends, 90.0) <= 20.0
    assert np.median(smoothed) <= 0.3
    assert np.percentile(smoothed, 90.0) <= 0.8


def test_a_written_scenario_describes_a_named_format_again(tmp_path: Path) -> None:
    """A run writes every default out, columns of text included, which a named format does not use."""
    named = ['log.gnss.format="rtklib-pos"', 'log.reference.format="rtklib-pos"']
    (tmp_path / "again.toml").write_text(sinssim.load_scenario(DRIVE, named).to_toml())
    log = sinssim.load_scenario(tmp_path / "again.toml").log
    assert log is not None
    assert log.gnss is not None
    assert log.reference is not None
    assert "delimiter" in log.gnss.model_fields_set
    assert len(fix_stream(log.gnss)[0]) == len(solution_stream(log.reference)[0]) > 100
