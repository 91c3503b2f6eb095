"""A leg of a flight plan in a project folder, or of an installed package: checked, written out, flown, and wrong."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

import sinssim
from sinssim.errors import InputError, RunError
from sinssim.scenario import Scenario, load_scenario
from sinssim.system.registries import forget, registered
from sinssim.truth.flight.flight_cache import flight_key
from tests.extending.pages import read_page
from tests.system.test_installed import install

FIGURE = next(block.code for block in read_page("leg").files if block.path.endswith(".py"))
SCENARIO = next(block.code for block in read_page("leg").files if block.path.endswith(".toml"))
GLIDE = '''"""The leg "glide": the throttle is closed for some seconds."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sinssim.truth.flight.leg import LegBase, wait


class GlideLeg(LegBase):
    """Hold everything for some seconds."""

    type: Literal["glide"]
    duration_s: float = Field(gt=0.0, le=100.0, description="time to glide")

    def end_height(self, height):
        if height > 9000.0:
            raise ValueError("begins too high")
        return height

    def reckon(self, plan):
        return self.duration_s

    def fly(self, pilot, state, performance):
        yield from wait(state, state.time + self.duration_s)
'''
PLAN = SCENARIO[: SCENARIO.index("[[flight.legs]]")] + '[[flight.legs]]\ntype = "glide"\nduration_s = 3.0\n'


def lay_out(folder: Path, text: str = GLIDE, name: str = "glide") -> Path:
    """Write a project folder with a leg and a scenario that flies it."""
    (folder / "legs").mkdir(parents=True)
    (folder / "legs" / f"{name}.py").write_text(text, encoding="utf-8")
    (folder / "plan.toml").write_text(f'use = ["."]\n{PLAN}', encoding="utf-8")
    return folder / "plan.toml"


def test_the_leg_of_the_page_works_in_a_project(tmp_path: Path) -> None:
    lay_out(tmp_path, FIGURE, "figure_eight")
    (tmp_path / "plan.toml").write_text(f'use = ["."]\n{SCENARIO}', encoding="utf-8")
    scenario = load_scenario(tmp_path / "plan.toml")
    assert [item.words for item in scenario.own_items()] == ["leg figure_eight"]
    assert scenario.flight.leg_durations()[0] == pytest.approx(78.0, abs=1.0)
    (tmp_path / "again.toml").write_text(scenario.to_toml(), encoding="utf-8")
    assert load_scenario(tmp_path / "again.toml") == scenario


def test_a_flight_with_a_leg_of_a_project(tmp_path: Path) -> None:
    """The process that flies finds the leg; the file is copied beside the run, and determines the stored flight."""
    file = lay_out(tmp_path)
    scenario = load_scenario(file, "recording.keep=summary")
    result = sinssim.run(scenario, tmp_path / "run")
    assert result.truth.time[-1] == pytest.approx(3.0, abs=0.05)
    assert (tmp_path / "run" / "own_content" / "legs" / "glide.py").read_text() == GLIDE
    sent, key = pickle.dumps((scenario, scenario.flight)), flight_key(scenario.flight, 0)
    forget()
    again, flight = pickle.loads(sent)
    assert again.flight.legs[0].duration_s == flight.legs[0].duration_s == 3.0
    assert registered("legs", "glide") is not None
    (tmp_path / "legs" / "glide.py").write_text(f"{GLIDE}\n# another state of the file\n", encoding="utf-8")
    assert flight_key(load_scenario(file).flight, 0) != key


def test_a_leg_of_an_installed_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sinssim.content import _of_packages

    package = install(tmp_path, "gliding", "gliding_content")
    lay_out(package)
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    _of_packages.cache_clear()
    (item,) = load_scenario(tmp_path / "plan.toml").own_items()
    assert item.package == "gliding 1.2"


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("flight.legs.1.duration_s=-1.0", r"flight\.legs\.1\.duration_s = -1\.0 must be greater than 0"),
        ("flight.legs.1.duration_h=1.0", r"unknown key 'flight\.legs\.1\.duration_h': .* use 'duration_s'"),
        ("flight.start.altitude_m=9500.0", r"leg 1 \(glide\) begins too high"),
        ("flight.legs.1.type=glid", r"flight\.legs\.1\.type = 'glid' is not known"),
    ],
)
def test_mistakes_in_a_leg_of_a_project(tmp_path: Path, key: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_scenario(lay_out(tmp_path), key)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('Literal["glide"]', 'Literal["sail"]', r'GlideLeg needs type: Literal\["glide"\], the name of the file'),
        ("(LegBase)", "", "must have one class that derives from LegBase; there is none"),
        ("def fly", "def flee", "GlideLeg needs the method fly"),
        ("gt=0.0,", "gt=1 / 0,", "glide.py, line 16: ZeroDivisionError"),
        ("return height", "return height / 0.0", "glide.py, line 21: ZeroDivisionError"),
    ],
)
def test_legs_that_cannot_be_used(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_scenario(lay_out(tmp_path, GLIDE.replace(old, new)))


def test_a_leg_that_fails_in_the_air(tmp_path: Path) -> None:
    file = lay_out(tmp_path, GLIDE.replace("state.time + self", "state.nothing + self"))
    with pytest.raises(RunError, match=r"the leg glide failed: .*glide.py, line 27: AttributeError"):
        sinssim.run(load_scenario(file))


def test_the_name_of_a_leg_of_sinssim_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="sinssim itself has the leg turn"):
        load_scenario(lay_out(tmp_path, GLIDE, "turn"))


def test_a_leg_is_given_as_an_object(tmp_path: Path) -> None:
    scenario = load_scenario(lay_out(tmp_path))
    again = Scenario(name="x", flight={**scenario.flight.model_dump(), "legs": scenario.flight.legs})
    assert again.flight.legs == scenario.flight.legs
