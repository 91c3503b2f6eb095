"""Errors of a study in further coordinates, against those in the local level."""

from __future__ import annotations

import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from pydantic import ValidationError

from sinssim.experiments.studies.algorithm_comparison import compare
from sinssim.experiments.studies.study_schema import Study

pytestmark = pytest.mark.usefixtures("hardly_counted")

EAST = {"latitude_deg": 40.0, "course_deg": 90.0, "speed_mps": 250.0, "altitude_m": 9000.0, "duration_s": 300.0}


def study(**part) -> Study:
    blocks = {"biased": {"grade": "ideal", "gyro_bias_deg_h": [1.0, -2.0, 3.0], "accel_bias_ug": [500.0, 300.0, 100.0]}}
    whole = {
        "title": "p", "sensors": ("biased",), "rates_hz": (10.0,), "motions": ({"name": "east", "great_circle": EAST},),
        **part,
    }  # fmt: skip
    return Study.model_validate({"name": "s", "blocks": blocks, "parts": (whole,)})


@pytest.fixture(scope="module")
def compared(tmp_path_factory, hardly_counted):
    kinds = ("earth-fixed", "inertial", "frame", "conditional", "krasovsky-1940")
    folder = tmp_path_factory.mktemp("study") / "run"
    return compare(study(frames=("wander", "transverse"), coordinates=kinds), folder), folder


def of(found, frame, kind, which="final_error"):
    return {
        error.column: getattr(error, which)
        for error in found.coordinate_errors
        if (error.case.frame, error.coordinates) == (frame, kind)
    }


@pytest.mark.parametrize("frame", ["wander", "transverse"])
def test_the_same_error_in_all_coordinates(compared, frame):
    """A distance has the same length in Earth-fixed, inertial and geodetic coordinates, an attitude error its angle."""
    found, _ = compared
    (row,) = [row for row in found.rows if row.frame == frame]
    level = np.hypot(row.final_horizontal_error_m, row.final_height_error_m)
    assert level > 30.0
    for kind, axes in (("earth-fixed", "e"), ("inertial", "i")):
        own = of(found, frame, kind)
        distance = np.linalg.norm([own[f"{axis}_{axes}_m"] for axis in "xyz"])
        assert distance == pytest.approx(level, rel=1e-4)  # the height is along the vertical, not the chord
        angle = np.degrees(own["attitude_rad"]) * 3600.0
        # the local level of the computed position is turned by the position error: 200 m are 6″ of about 700″
        assert angle == pytest.approx(row.final_attitude_error_arcsec, abs=np.degrees(level / 6.3e6) * 3600.0 * 1.5)
    # latitude along the meridian of another ellipsoid, longitude along the parallel
    geodetic = of(found, frame, "krasovsky-1940")
    east, north = 6.38e6 * np.cos(np.radians(40.0)) * geodetic["longitude_rad"], 6.36e6 * geodetic["latitude_rad"]
    assert np.hypot(east, north) == pytest.approx(row.final_horizontal_error_m, rel=0.01)


@pytest.mark.parametrize("frame", ["wander", "transverse"])
def test_velocity_along_axes_has_the_same_length(compared, frame):
    found, _ = compared
    (row,) = [row for row in found.rows if row.frame == frame]
    for kind in ("frame", "conditional"):
        own = of(found, frame, kind)
        length = np.linalg.norm([own[f"velocity_{axis}_mps"] for axis in "xyd"])
        assert length == pytest.approx(row.final_velocity_error_mps, rel=0.02)
        assert len(of(found, frame, kind, "max_error")) == len(own)


def test_conditional_coordinates_turn_with_the_route(compared):
    """Along the route to the east conditional longitude is distance along it; its latitude error is across."""
    found, _ = compared
    (row,) = [row for row in found.rows if row.frame == "transverse"]
    own = of(found, "transverse", "conditional")
    both = np.hypot(own["conditional_latitude_rad"], own["conditional_longitude_rad"]) * 6.38e6
    assert both == pytest.approx(row.final_horizontal_error_m, rel=0.01)


def test_they_are_written(compared):
    found, folder = compared
    table = pq.read_table(folder / "coordinates.parquet").to_pylist()
    assert len(table) == len(found.coordinate_errors) > 40
    assert table[0]["max_error"] == found.coordinate_errors[0].max_error
    written = json.loads((folder / "results.json").read_text())["coordinate_errors"]
    assert written[0]["column"] == "x_e_m"
    report = (folder / "report.html").read_text(encoding="utf-8")
    assert "Largest errors in the coordinates conditional" in report
    assert "azimuth of x" in report


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(ValidationError, match=r'coordinates = \["frame"\] needs .*wander.*frames = \["level"\]'):
        study(coordinates=("frame",))
    with pytest.raises(ValidationError, match="earth-fixed"):
        study(coordinates=("earth-fixd",))
    with pytest.raises(ValidationError, match="2 times"):
        study(coordinates=("inertial", "inertial"))


def test_nothing_is_compared_unless_asked_for():
    assert compare(study()).coordinate_errors == []
