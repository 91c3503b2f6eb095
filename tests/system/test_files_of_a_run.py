"""What a run says of own content, and what a changed file, a package or a mistake is told with."""

from __future__ import annotations

import hashlib
import json
import logging
from pathlib import Path

import pytest

from sinssim.content import named_paths
from sinssim.errors import InputError
from sinssim.scenario.load import load_scenario, resolved_use, warn_of_changes
from sinssim.scenario.plan_summary import OwnFile
from sinssim.system.extensions import (
    Item,
    failure,
    file_digest,
    items_of,
    load_module,
    outline,
    source_of,
    syntax_words,
)
from sinssim.system.registries import described, registered, sentence_of, use


def digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def test_the_entry_of_a_file_in_a_summary() -> None:
    sensor = OwnFile(Item("aiding", "radar", Path("/p/aiding/radar.py"), "theirs 1.2"), b"abc")
    assert sensor.place == "aiding/radar.py"
    assert sensor.to_json() == {
        "kind": "aiding",
        "name": "radar",
        "file": "/p/aiding/radar.py",
        "package": "theirs 1.2",
        "sha256": digest("abc"),
    }
    assert (
        OwnFile(Item("aircraft", "glider", Path("/p/aircraft/glider/aircraft.toml")), b"").place
        == "aircraft/glider/aircraft.toml"
    )
    assert Item("aircraft", "glider", Path()).words == "aircraft glider"
    assert Item("grades", "unit", Path()).words == "grade of sensors unit"


def test_the_items_of_a_project_are_named_by_their_files(tmp_path: Path) -> None:
    for name in ("algorithms/two.py", "algorithms/one.py", "algorithms/_hidden.py", "grades/unit.toml",
                 "aircraft/glider/aircraft.toml", "aircraft/.old/aircraft.toml", "views/v.txt"):  # fmt: skip
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    found = [(item.kind, item.name, item.file.relative_to(tmp_path).as_posix()) for item in items_of(tmp_path)]
    assert found == [
        ("algorithms", "one", "algorithms/one.py"), ("algorithms", "two", "algorithms/two.py"),
        ("grades", "unit", "grades/unit.toml"), ("aircraft", "glider", "aircraft/glider/aircraft.toml"),
    ]  # fmt: skip
    (plane,) = items_of(tmp_path / "aircraft/glider")
    assert (plane.kind, plane.name) == ("aircraft", "glider")
    (tmp_path / "b" / "algoritms").mkdir(parents=True)
    with pytest.raises(InputError, match=r"did you mean 'algoritms' as 'algorithms'\?"):
        items_of(tmp_path / "b")
    (tmp_path / "algorithms/2nd.py").touch()
    with pytest.raises(
        InputError, match="the attitude algorithm would have the name '2nd'; a name begins with a letter"
    ):
        items_of(tmp_path)


def test_paths_of_a_scenario(tmp_path: Path) -> None:
    """Relative paths begin at the scenario's file; names of a project's grade, aircraft and view become files."""
    for name in ("grades/unit.toml", "aircraft/glider/aircraft.toml", "views/v.py"):
        (tmp_path / "p" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "p" / name).touch()
    place = str(tmp_path / "p")
    data = {"use": ["p"], "imu": {"grade": "unit"}, "flight": {"aircraft": "glider"}, "views": ["other"],
            "aiding": {"master": {"grade": "unit"}}}  # fmt: skip
    resolved_use(data, tmp_path)
    assert data == {
        "use": [place],
        "imu": {"grade": f"{place}/grades/unit.toml"},
        "flight": {"aircraft": f"{place}/aircraft/glider"},
        "views": ["other", f"{place}/views/v.py"],
        "aiding": {"master": {"grade": f"{place}/grades/unit.toml"}},
    }
    study = {"use": ["p"], "imu": {"grade": "tactical"}}
    resolved_use(study, tmp_path, views=False)
    assert study == {"use": [place], "imu": {"grade": "tactical"}}
    bad = {"use": ["missing"], "imu": {"grade": "unit"}}
    resolved_use(bad, tmp_path)
    assert bad["imu"] == {"grade": "unit"}


@pytest.mark.parametrize(
    ("kind", "name", "file", "how"),
    [
        ("algorithms", "midpoint", "midpoint.py", "--set 'use=[\"{copies}\"]'"),
        ("grades", "unit", "unit.toml", "--grade {copies}/grades/unit.toml"),
        ("aircraft", "glider", "glider/aircraft.toml", "--set flight.aircraft={copies}/aircraft/glider"),
    ],
)
def test_content_that_has_changed_since_a_run(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, kind: str, name: str, file: str, how: str
) -> None:
    copies = tmp_path / "run" / "own_content"
    copies.mkdir(parents=True)
    there = tmp_path / file
    there.parent.mkdir(exist_ok=True)
    there.write_text("before")
    entry = {"kind": kind, "name": name, "file": str(there), "sha256": digest("before")}
    (tmp_path / "run/summary.json").write_text(json.dumps({"own_content": [entry]}))
    scenario = tmp_path / "run/scenario.toml"
    warn_of_changes(scenario, [])
    assert caplog.messages == []
    there.write_text("after")
    warn_of_changes(scenario, [])
    shown = how.format(copies=copies)
    what = f"{there} has changed since the run in {tmp_path}/run: the numbers will differ."
    told = f"{what} {shown} uses the copy of that run."
    assert caplog.messages == [told]
    assert caplog.records[0].levelno == logging.WARNING
    there.unlink()
    warn_of_changes(scenario, None)
    assert caplog.messages[1].startswith(f"{there} no longer exists since the run in {tmp_path}/run: the")
    for quiet, used in ((scenario, [str(copies)]), (tmp_path / "run/other.toml", []), (tmp_path / "scenario.toml", [])):
        warn_of_changes(quiet, used)
    assert len(caplog.messages) == 2


def test_mistakes_have_the_line_of_the_file(tmp_path: Path) -> None:
    """The last line of the file on the way to the mistake; a mistake of syntax has its own."""
    file = tmp_path / "algorithms" / "mine.py"
    file.parent.mkdir()
    file.write_text("def a():\n    return 1 / 0\n\n\nvalue = 3\nb = a()\n")
    item = Item("algorithms", "mine", file)
    with pytest.raises(InputError) as error:
        load_module(item)
    assert (
        str(error.value)
        == f"the attitude algorithm mine cannot be used: {file}, line 2: ZeroDivisionError: division by zero."
    )
    assert failure(file, ValueError("two\n  lines.")) == f"{file}: ValueError: two lines"
    file.write_text("x = = 2\n")
    with pytest.raises(InputError, match=r"mine\.py: syntax error in line 1: invalid syntax, in:  x = = 2\."):
        load_module(item)
    assert syntax_words(SyntaxError("odd")) == "syntax error: odd"
    assert outline(file).problem == "syntax error in line 1: invalid syntax, in:  x = = 2"
    assert sentence_of(item) == "(cannot be used: syntax error in line 1: invalid syntax, in:  x = = 2)"
    file.write_text("value = 5\n")
    assert file_digest(file) == digest("value = 5\n")
    assert load_module(item).value == 5
    file.write_text("value = 6\n")
    assert (load_module(item).value, source_of(item)) == (5, b"value = 5\n")  # as it was run


def test_what_a_file_says_of_itself(tmp_path: Path) -> None:
    file = tmp_path / "f.py"
    head = '"""First line.\n\nSecond."""\nfrom a import b as c\nimport d\n'
    file.write_text(f"{head}SAMPLES = 3\nclass E(F, g.H):\n    pass\ndef i(): ...\n")
    found = outline(file)
    assert found.sentence == "First line."
    assert found.names == {"c", "d", "SAMPLES", "E", "i"}
    assert found.bases == {"F", "H"}
    assert (found.constant("SAMPLES", 9), found.constant("NONE", 9), found.problem) == (3, 9, "")


def test_an_algorithm_and_a_frame_by_their_files(tmp_path: Path) -> None:
    from sinssim.strapdown.attitude import ALGORITHMS, REGISTRY
    from sinssim.strapdown.frames import FRAME_REGISTRY, FRAMES

    for name, text in (
        ("algorithms/plain.py", '"""A plain one."""\nSAMPLES = 3\nstart_k = dcm_k = step_k = quaternion_k = None\n'),
        ("algorithms/turns.py", '"""One of turns."""\nSAMPLES = 3\nPREVIOUS = 2\ndef turn_k(): ...\n'),
        ("algorithms/windows.py", "def engine(): ...\n"),
        (
            "frames/mine.py",
            '"""My frame."""\nHAS_RADII = False\nTAKES_ROUTE = True\ndef solve(): ...\ndef check(): ...\n'
            "def solve_three_rates(): ...\n",
        ),
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    assert use(tmp_path) == ["plain", "turns", "windows", "mine"]
    plain, turns, windows = (REGISTRY[name] for name in ("plain", "turns", "windows"))
    assert (plain.sentence, plain.variant, plain.windowed, plain.path) == (
        "A plain one.",
        {},
        False,
        str(tmp_path / "algorithms/plain.py"),
    )
    assert (turns.variant, turns.windowed) == ({"SAMPLES": 3, "PREVIOUS": 2}, False)
    assert (windows.windowed, ALGORITHMS["windows"]) == (True, "own, windows.py")
    frame = FRAME_REGISTRY["mine"]
    assert (FRAMES["mine"], frame.has_radii, frame.takes_route, frame.passes_poles) == ("My frame.", False, True, True)
    assert (frame.has_three_rates, frame.has_azimuth, frame.starts_anywhere) == (True, False, False)
    assert described("algorithms")["plain"] == f"A plain one. ({tmp_path}/algorithms/plain.py)"
    assert registered("frames", "mine").file == tmp_path / "frames/mine.py"
    assert registered("frames", "plain") is None
    names = ['navigation.algorithms=["quaternion", "plain"]', "navigation.frame=mine"]
    scenario = load_scenario("parked", names)
    assert scenario.as_written()["use"] == (f"{tmp_path}/algorithms/plain.py", f"{tmp_path}/frames/mine.py")
    scenario = load_scenario("parked", [*names, f'use=["{tmp_path}"]'])
    assert scenario.as_written()["use"] == (str(tmp_path),)


def test_paths_of_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("SINSSIM_CONTENT", f"{tmp_path}:relative:{tmp_path}/missing:")
    assert named_paths() == [tmp_path]
    assert caplog.messages == [
        "SINSSIM_CONTENT names relative, which is not an absolute path: it is ignored.",
        f"SINSSIM_CONTENT names {tmp_path}/missing, which does not exist: it is ignored.",
    ]
