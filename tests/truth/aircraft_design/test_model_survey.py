"""What a model says, worked out by hand from its files, and why a model cannot be flown."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import pytest

from sinssim.errors import InputError
from sinssim.truth.aircraft_design.model_survey import _feeds, described_models, find_model, package_models, survey


def test_the_facts_of_the_airliner() -> None:
    """Wing, tanks and empty weight of 737.xml; its lift has its maximum 1.2 at 0.23 rad; V = √(2 W/(ρ S C))."""
    facts = survey(find_model("737"))
    assert (facts.name, facts.engines, facts.retractable) == ("737", ("turbine_engine", "turbine_engine"), True)
    assert facts.wing_m2 == pytest.approx(1171.0 * 0.3048**2, rel=1e-6)
    assert facts.mass_kg == pytest.approx((83000.0 + 24000.0) * 0.45359237, rel=1e-3)
    assert facts.lift_max == pytest.approx(1.2, abs=0.02)
    assert facts.stall_alpha_deg == pytest.approx(0.9 * 13.0)
    weight, area = 107000.0 * 0.45359237 * 9.80665, 1171.0 * 0.3048**2
    stall = math.sqrt(2.0 * weight / (1.225 * area * facts.lift_max)) / (1852.0 / 3600.0)
    assert facts.stall_kt == pytest.approx(stall, rel=1e-3)


def test_the_models_of_the_package() -> None:
    models = described_models()
    assert len(models) == len(package_models()) >= 55
    assert models["DHC6"] == "DHC-6, 2 engines"
    assert models["F450"].endswith(", 4 engines")
    assert models["sgs233"].endswith("no engine")


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("ball", "its wings do not lift it: the greatest lift coefficient is 0.00"),
        ("L17", "it needs a simulator around it: the property fcs/flaps-pos-deg does not exist"),
        ("F450", "its wings do not lift it"),
        ("ZLT-NT", "gas carries it"),
        ("ah1s", "a rotor carries it"),
    ],
)
def test_models_of_the_package_that_cannot_fly(model: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        survey(find_model(model))


def folder_with(tmp_path: Path, text: str) -> Path:
    place = tmp_path / "kite"
    place.mkdir()
    (place / "kite.xml").write_text(text)
    return place


def test_faulty_files(tmp_path: Path) -> None:
    place = folder_with(tmp_path, "<fdm_config><metrics></fdm_config>")
    with pytest.raises(InputError, match=r"^kite\.xml is not XML: mismatched tag: line 1, column 23"):
        survey(find_model("kite", tmp_path))
    (place / "kite.xml").write_text('<fdm_config name="k"><propulsion file="engines"/></fdm_config>')
    with pytest.raises(InputError, match="it needs the file engines, which is not there"):
        survey(find_model("kite", place))
    (place / "kite.xml").write_text(
        '<fdm_config name="k" version="2.0"><metrics/><propulsion><engine file="none"/></propulsion></fdm_config>'
    )
    with pytest.raises(InputError, match="JSBSim cannot load it: "):
        survey(place)


def test_models_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"unknown MODEL 'j3cub'\. Did you mean 'J3Cub'\?"):
        find_model("j3cub")
    with pytest.raises(InputError, match=r"there is neither kite/kite\.xml nor kite\.xml"):
        find_model("kite", tmp_path)
    (tmp_path / "kite.xml").write_text("")
    with pytest.raises(InputError, match="the folder of the model kite must have the name kite"):
        find_model("kite", tmp_path)


def test_engines_burn_the_fuller_tanks_if_their_own_hold_seconds() -> None:
    """Of 1000 + 900 + 3 lb, the 3 lb are 0.16 %: the first engine burns tank 0, the second keeps its tank 1."""
    tanks = "".join(f'<tank type="FUEL"><contents>{fuel}</contents></tank>' for fuel in (1000.0, 900.0, 3.0))
    root = ElementTree.fromstring(
        f"<f><propulsion><engine><feed>2</feed></engine><engine><feed>1</feed></engine>{tanks}</propulsion></f>"
    )
    assert _feeds(root) == {"propulsion/engine[1]/feed": "0"}
