"""`sinssim aircraft`: a model that cannot be flown is a sentence and leaves nothing behind; one that can, a folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from sinssim.truth.aircraft_design.acceptance_flight import LegErrors
from sinssim.truth.aircraft_design.aircraft_file import aircraft_text
from sinssim.truth.flight.aircraft import load_aircraft
from tests.cli.commands.conftest import Put, Sinssim

BROKEN = "<fdm_config><metrics></fdm_config>"
EMPTY = '<fdm_config name="kite" version="2.0"><propulsion><engine file="nothing"/></propulsion></fdm_config>'


def test_the_models_of_the_package_are_listed(sinssim: Sinssim) -> None:
    names = json.loads(sinssim("aircraft", "list", "--json"))
    lines = sinssim("aircraft", "list").splitlines()
    assert len(lines) == len(names)
    assert "J3Cub            J3Cub, 1 engine" in lines


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["aircraft", "add", "ball"], "the model ball cannot be flown: its wings do not lift it:"),
        (["aircraft", "add", "j3cub"], "unknown MODEL 'j3cub'. Did you mean 'J3Cub'?"),
        (["aircraft", "add", "kite", "--from", "models"], "the model kite cannot be flown: kite.xml is not XML: mis"),
        (["aircraft", "add", "kit", "--from", "models"], "--from models: there is neither kit/kit.xml nor kit.xml."),
        (["aircraft", "add", "empty", "--from", "models"], "the model empty cannot be flown: JSBSim cannot load it: "),
        (["aircraft", "add"], "write `aircraft add MODEL`"),
        (["aircraft", "check"], "write `aircraft check NAME`"),
        (["aircraft", "list", "737"], "write `aircraft list` without a name"),
        (["aircraft", "add", "737", "-o", "models"], "models exists. Name another folder with --out, or remove it."),
        (["aircraft", "add", "ball", "-o", "a.b/c d"], "--out a.b/c d: "),
    ],
)
def test_bad_input_is_one_sentence_and_nothing_is_written(
    sinssim: Sinssim, tmp_path: Path, arguments: list[str], words: str
) -> None:
    for name, text in (("kite", BROKEN), ("empty", EMPTY)):
        (tmp_path / "models" / name).mkdir(parents=True)
        (tmp_path / "models" / name / f"{name}.xml").write_text(text)
    before = sorted(tmp_path.rglob("*"))
    out = sinssim(*arguments, code=2)
    assert words in " ".join(out.split())
    assert sorted(tmp_path.rglob("*")) == before


class Made:
    """What a design returns, as far as the command reads it."""

    height = 1500.0
    errors = (LegErrors("climb", "climb", None, 1.234, 0.5, None),)
    on_ground = "It does not take off: the engines do not start within 90 s."
    text = aircraft_text(load_aircraft("c172x"))


def test_an_aircraft_is_written_with_a_copy_of_its_model(sinssim: Sinssim, put: Put, tmp_path: Path) -> None:
    """A model of the package is named, not copied; a model of a folder is copied beside aircraft.toml."""
    put("truth.aircraft_design.design_process.design_apart", Made())
    (tmp_path / "mine" / "kite").mkdir(parents=True)
    (tmp_path / "mine" / "kite" / "kite.xml").write_text("<fdm_config/>")
    out = sinssim("aircraft", "add", "c172x")
    assert "c172x flies the acceptance plan at 1500 m: every leg is within its limits." in out
    assert "It does not take off: the engines do not start within 90 s." in " ".join(out.split())
    assert 'Aircraft: aircraft/c172x/aircraft.toml    (flight.aircraft = "c172x")' in out
    assert [path.name for path in (tmp_path / "aircraft" / "c172x").iterdir()] == ["aircraft.toml"]
    assert load_aircraft("c172x") == load_aircraft(str(tmp_path / "aircraft" / "c172x"))
    numbers = json.loads(sinssim("aircraft", "add", "kite", "--from", "mine", "-o", "planes/kite", "--json"))
    assert (numbers["accepted"], numbers["directory"], numbers["legs"][0]["airspeed_kt"]) == (
        True,
        "planes/kite",
        1.234,
    )
    assert (tmp_path / "planes" / "kite" / "kite" / "kite.xml").read_text() == "<fdm_config/>"


def test_the_check_shows_the_errors_of_an_aircraft(sinssim: Sinssim, put: Put) -> None:
    put("truth.aircraft_design.design_process.acceptance_apart", (1500.0, Made.errors))
    assert "1.23 (10)" in sinssim("aircraft", "check", "c172x")
    assert json.loads(sinssim("aircraft", "check", "c172x", "--json"))["accepted"] is True


@pytest.mark.slow
@pytest.mark.parametrize("model", ["737", "T37", "B747"])
def test_a_model_of_the_package_becomes_an_aircraft(sinssim: Sinssim, tmp_path: Path, model: str) -> None:
    """The folder is found by its name, and its aircraft flies its plan again in another process."""
    sinssim("aircraft", "add", model, "-o", "aircraft/mine", "-q")
    aircraft: Any = load_aircraft(str(tmp_path / "aircraft" / "mine"))
    assert aircraft.jsbsim_model == model
    assert aircraft.envelope is not None
    assert aircraft.envelope.max_kt[0] > aircraft.performance.cruise_kt > aircraft.envelope.min_kt[0]
    assert json.loads(sinssim("aircraft", "check", "mine", "--json"))["accepted"] is True
