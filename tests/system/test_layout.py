"""What a project folder brings, found without running a file of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from sinssim.errors import InputError
from sinssim.system.extensions import SINGULAR, items_of, outline
from sinssim.units import listed


def test_a_project_brings_what_its_folders_hold(project: Path) -> None:
    (project / "algorithms" / "_notes.py").write_text("")
    (project / "aircraft" / "glider").mkdir(parents=True)
    (project / "aircraft" / "glider" / "aircraft.toml").write_text("")
    found = {(item.kind, item.name, item.file.name) for item in items_of(project)}
    assert found == {
        ("algorithms", "cayley", "cayley.py"),
        ("filters", "complementary", "complementary.py"),
        ("views", "attitude", "attitude.py"),
        ("grades", "my_unit", "my_unit.toml"),
        ("aircraft", "glider", "aircraft.toml"),
    }


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("from a import start_k\ndef step_k(): ...", "algorithms"),
        ("def solve(problem, frame): ...", "frames"),
        ("def blueprint(run): ...", "views"),
        ("class Mine(AidingSensor): ...", "aiding"),
        ("def recognises(path, head): ...\ndef check(row): ...", "formats"),
        ('SUFFIX, HOLDS = ".mine", "solution"\nHOLDS = "solution"', "writers"),
        ("class Mine(base.AidingSensor): ...", "aiding"),
    ],
)
def test_a_single_file_is_recognised_by_what_stands_in_it(tmp_path: Path, text: str, kind: str) -> None:
    file = tmp_path / "mine.py"
    file.write_text(f"raise SystemExit\n{text}\n")  # it would end the test if it ran
    (item,) = items_of(file)
    assert (item.kind, item.name) == (kind, "mine")


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("mine.py", "x = 1", "is nothing that sinssim can use: an attitude algorithm has functions start_k"),
        ("mine.py", "x = = 1", "cannot be read: syntax error in line 1"),
        ("mine.txt", "", "is not a Python file"),
        ("algorithms/1st.py", "", "the attitude algorithm would have the name '1st'"),
    ],
)
def test_files_that_bring_nothing(tmp_path: Path, name: str, text: str, said: str) -> None:
    (tmp_path / "algorithms").mkdir()
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=said):
        items_of(tmp_path / name)


def test_folders_that_bring_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"has none of the folders {listed(SINGULAR, 'or')}"):
        items_of(tmp_path)
    with pytest.raises(InputError, match="there is no file or folder"):
        items_of(tmp_path / "nothing")
    (tmp_path / "Algorithm").mkdir()
    (tmp_path / "data").mkdir()
    with pytest.raises(InputError, match=r"did you mean 'Algorithm' as 'algorithms'\?"):
        items_of(tmp_path)


def test_outline_of_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text('"""First line.\n\nMore."""\nSAMPLES = 2\nHAS_RADII: bool = False\n')
    found = outline(file)
    assert (found.sentence, found.constant("SAMPLES", 1), found.constant("HAS_RADII", True)) == (
        "First line.",
        2,
        False,
    )
    assert found.constant("OTHER", 7) == 7
