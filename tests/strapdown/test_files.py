"""A file of an algorithm or a frame that cannot be used is named with its path and what is wrong; the rest works."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import sinssim.strapdown.attitude
import sinssim.strapdown.frames
from sinssim import InputError
from sinssim.strapdown import engine_assembly
from sinssim.strapdown.attitude import REGISTRY, Algorithm, by_name
from sinssim.strapdown.engine_assembly import algorithm_file, frame_file
from sinssim.strapdown.frames import FRAME_REGISTRY, Frame

GOOD = "from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder whose files are found beside those of the package."""
    for package in (sinssim.strapdown.attitude, sinssim.strapdown.frames):
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(tmp_path)])
    yield tmp_path
    algorithm_file.cache_clear()
    frame_file.cache_clear()


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("wrong_syntax", "def start_k(:\n", "SyntaxError: invalid syntax"),
        ("no_import", "import nothing_of_that_name\n", "ModuleNotFoundError: No module named 'nothing_of_that_name'"),
        ("no_step", GOOD + "del step_k\n", r"there is no function step_k\(attitude, body, frame\)"),
        ("plain_step", GOOD + "def step_k(attitude, body, frame): return attitude\n", "step_k is not compiled"),
        (
            "short_step",
            GOOD + "from sinssim.jit import inline\nstep_k = inline(lambda attitude, body: attitude)\n",
            r"step_k takes \(attitude, body\), but must take \(attitude, body, frame\)",
        ),
    ],
)
def test_a_broken_algorithm(name: str, text: str, words: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / f"{name}.py").write_text(text)
    monkeypatch.setitem(REGISTRY.shipped, "new", Algorithm("new", "a new one", f"attitude.{name}"))
    with pytest.raises(InputError, match=rf"the algorithm new cannot be used: .*{name}\.py: .*{words}"):
        algorithm_file("new")
    assert algorithm_file("quaternion").step_k is not None  # type: ignore[union-attr]


def test_a_file_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(REGISTRY.shipped, "new", Algorithm("new", "a new one", "attitude.absent"))
    with pytest.raises(InputError, match=r"the algorithm new .* no sinssim/strapdown/attitude/absent\.py"):
        algorithm_file("new")


def test_a_variant_of_a_constant_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(REGISTRY.shipped, "new", Algorithm("new", "a new one", "attitude.poisson", {"ORDRE": 2}))
    with pytest.raises(InputError, match=r"its variant sets ORDRE, which .*poisson\.py does not define"):
        algorithm_file("new")


def test_a_name_that_stands_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    pair = by_name(Algorithm("new", "one", "attitude.euler"), Algorithm("new", "another", "attitude.poisson"))
    monkeypatch.setitem(REGISTRY.shipped, "new", pair["new"])
    with pytest.raises(InputError, match=r"attitude/__init__\.py has the name twice, for .* attitude\.euler"):
        algorithm_file("new")


def test_a_broken_frame(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "askew.py").write_text("def solve(problem): pass\n")
    monkeypatch.setitem(FRAME_REGISTRY.shipped, "askew", Frame("a new one", "askew"))
    with pytest.raises(
        InputError,
        match=r"the frame askew cannot be used: .*askew\.py: solve takes \(problem\), but must take "
        r"\(problem, frame\); there is no function check\(problem, frame\)",
    ):
        frame_file("askew")


@pytest.mark.parametrize("algorithm", REGISTRY)
def test_every_shipped_algorithm_has_its_file(algorithm: str) -> None:
    assert not REGISTRY[algorithm].problem
    assert engine_assembly.algorithm_file(algorithm)


@pytest.mark.parametrize("folder_name", ["attitude", "frames"])
def test_every_file_is_in_its_registry(folder_name: str) -> None:
    """Files that hold neither an algorithm nor a frame are listed; a forgotten line is named by its file."""
    package = Path(sinssim.strapdown.attitude.__file__ or "").parents[1] / folder_name
    others = {"navigation_problem", "three_rate_schedule", "route_pole", "vertical_channel"}
    shared = others if folder_name == "frames" else set()
    known = {entry.module for entry in REGISTRY.values()} | {f"frames.{e.file}" for e in FRAME_REGISTRY.values()}
    for file in sorted(package.glob("*.py")):
        if file.stem not in shared | {"__init__"}:
            assert f"{folder_name}.{file.stem}" in known, f"{file} has no line in its registry"
