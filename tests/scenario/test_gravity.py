"""The [gravity] table: what it takes, and what it refuses by key and value."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import sinssim
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.true_motion import known_field
from sinssim.truth.motion import GravityRemainder, TrueGravity
from sinssim.units import ARCSEC, MGAL

BASE: dict[str, Any] = {"name": "g", "parked": {"latitude_deg": 40.0, "duration_s": 30.0}}


def scenario(**tables: Any) -> Scenario:
    return Scenario(**BASE, **tables)


def test_defaults_are_normal_gravity_and_written_out_ones_are_accepted() -> None:
    assert scenario().gravity is None
    plain = TrueGravity()
    assert plain.model == "normal"
    assert TrueGravity(**plain.model_dump()) == plain
    rest = GravityRemainder()
    assert GravityRemainder(**rest.model_dump()) == rest
    assert plain.field(WGS84) is None
    whole = TrueGravity(model="egm2008")
    assert TrueGravity(**whole.model_dump()) == whole
    field = whole.field(WGS84)
    assert field is not None
    assert field.degree == 120


def test_sizes_that_are_left_out_follow_from_the_degree() -> None:
    given = GravityRemainder(order=3, xi_sigma_arcsec=2.0, correlation_km=50.0)
    model = TrueGravity(model="egm2008", remainder=given).remainder_model()
    assert model is not None
    assert model.sigma[0] == pytest.approx(2.0 * ARCSEC)
    assert model.sigma[1] == pytest.approx(4.77 * ARCSEC, rel=0.01)
    assert model.sigma[2] == pytest.approx(31.9 * MGAL, rel=0.01)
    assert (model.order, model.distance) == (3, 50e3)
    normal = TrueGravity(remainder=GravityRemainder()).remainder_model()
    assert normal is not None
    assert normal.sigma[2] == pytest.approx(42.3 * MGAL, rel=0.01)


def test_the_navigator_knows_a_lower_degree() -> None:
    found = known_field(scenario(gravity={"model": "egm2008"}, navigation={"gravity_degree": 36}))
    assert found is not None
    assert found.degree == 36
    assert known_field(scenario(gravity={"model": "egm2008"})) is None


@pytest.mark.parametrize(
    ("tables", "wanted"),
    [
        ({"gravity": {"model": "egm2008", "degree": 121}}, "degree = 121: egm2008 has coefficients to degree 120"),
        ({"gravity": {"model": "egm2008", "degree": 1}}, "gravity.degree"),
        ({"gravity": {"degree": 20}}, "degree = 20 would have no effect"),
        ({"gravity": {"model": "icgem"}}, 'model = "icgem" needs file'),
        ({"gravity": {"model": "egm2008", "file": "a.gfc"}}, "no other model takes one"),
        ({"gravity": {"file": "/nowhere/a.gfc"}}, "/nowhere/a.gfc: the coefficients of gravity cannot be read"),
        ({"gravity": {"remainder": {"order": 4}}}, "gravity.remainder.order"),
        ({"navigation": {"gravity_degree": 20}}, "navigation.gravity_degree = 20 needs the model"),
        (
            {"gravity": {"model": "egm2008", "degree": 20}, "navigation": {"gravity_degree": 30}},
            "gravity_degree = 30 is above gravity.degree = 20",
        ),
        (
            {"gravity": {"model": "egm2008"}, "navigation": {"gravity_degree": 30, "gravity": "j2"}},
            'navigation.gravity = "j2" is another model',
        ),
        ({"gravity": {"model": "egm2008"}, "truth": {"gravity": "j2"}}, 'truth.gravity = "j2" is another model'),
        (
            {"gravity": {"model": "egm2008"}, "truth": {"ellipsoid": "krasovsky-1940"}},
            "needs an ellipsoid about the centre of mass, wgs84 or pz-90.11",
        ),
        (
            {
                "gravity": {"model": "egm2008"},
                "imu": {"grade": "ideal", "sensor_set": {"type": "platform"}},
                "navigation": {"gravity_degree": 30, "algorithms": ("platform",)},
            },
            "needs strapdown gyros",
        ),
    ],
)
def test_what_cannot_be(tables: dict[str, Any], wanted: str) -> None:
    with pytest.raises(InputError) as caught:
        scenario(**tables)
    assert wanted in str(caught.value)


def test_a_file_lies_beside_the_scenario_and_a_bad_one_leaves_nothing(tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    file.write_text(
        '[parked]\nlatitude_deg = 40.0\nduration_s = 30.0\n[gravity]\nfile = "short.gfc"\n', encoding="utf-8"
    )
    head = "earth_gravity_constant 3.986004415e14\nradius 6378136.3\nmax_degree 3\nend_of_head\n"
    lines = "gfc 2 0 -0.484165143790815e-03 0.0\ngfc 2 1 0 0\ngfc 2 2 0.24e-5 -0.14e-5\n"
    (tmp_path / "short.gfc").write_text(head + lines, encoding="utf-8")
    with pytest.raises(InputError, match="degree 3 and order 0 is missing"):
        sinssim.run(load_scenario(file), directory=tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["s.toml", "short.gfc"]
    loaded = load_scenario(file, ["gravity.degree=2"])
    assert loaded.gravity is not None
    assert loaded.gravity.model == "icgem"
