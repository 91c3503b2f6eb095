"""Imports point one way, and the heavy libraries stay where they belong."""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import sinssim

PACKAGE = Path(sinssim.__file__).parent

LAYERS = [
    # what stands under everything
    "errors", "lazy", "units", "formatting", "system", "result", "data", "arguments",
    "transverse", "checks", "mistakes", "section", "toml_file", "own_content", "algorithms", "frames", "content",
    "jit", "rotation", "progress", "earth", "mechanization",
    "statistics", "requirements",
    # the engine knows nothing of scenarios, truth or sensors
    "strapdown",
    # what a scenario is made of: tables of names, keys and limits beside what they describe
    "logs.streams", "logs.formats.registry", "logs.read", "truth", "sensors", "logs",
    "own_content.aiding", "own_content.new_project",
    "scenario",
    # data flows right, imports point left
    "logs.writers.navigators", "ensembles.batch", "platform",
    "noise_identification", "alignment", "inspection",
    "estimation",
    "simulation",  # the stages of a run
    "error_budget", "calibration",
    "simulation.parts",  # what only some runs have, which budgets explain
    "recording.scales", "ensembles",
    "studies", "trades", "recording",
    "studies.in_coordinates",  # compares what the streams of a run have
    "studies.compare",  # runs a study and writes its directory, as simulation does with a run
    "ensembles.running",  # the same for an ensemble
    "trades.running",  # the same for a trade study
    "simulation.finish", "simulation.execute_one_component", "simulation.execute", "running", "cli", "__main__",
]  # fmt: skip
"""Modules and packages, each of which may import those before it; the longest name that fits counts."""

HOMES = {
    "rerun": {"recording.rerun"},
    "rerun_cli": {"recording.rerun"},
    "jsbsim": {"truth.flight"},
    "filterpy": {"estimation"},
    "typer": {"cli"},
    "tomllib": {"toml_file", "scenario.load"},
    "rich": {"cli", "recording.tables", "progress"},
    "matplotlib": {"recording.figures"},
}
"""Libraries that only these parts may import."""

FILES = sorted(file for file in PACKAGE.rglob("*.py") if "_content" not in file.parts)


def name_of(file: Path) -> str:
    """Return a file's module without `sinssim.`: "truth.curve"."""
    return ".".join(file.relative_to(PACKAGE).with_suffix("").parts).removesuffix("__init__").rstrip(".")


def fits(module: str, part: str) -> bool:
    """Return whether a module is, or lies in, a part of the package."""
    return module == part or module.startswith(f"{part}.")


def layer(module: str) -> str:
    """Return the entry of `LAYERS` that a module belongs to: "truth.curve" → "truth"."""
    return max((part for part in LAYERS if fits(module, part)), key=len, default="")


def imports(file: Path) -> Iterator[tuple[int, str]]:
    """Yield line and full name of every import, wherever it stands in the file."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, name.name) for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}, line {node.lineno}: relative imports hide what is imported"
            module = node.module or ""
            # `from sinssim import rotation` imports a module, `from sinssim.data import ImuData` a name of one
            yield from ((node.lineno, f"{module}.{n.name}" if module == "sinssim" else module) for n in node.names)


MODULES = {f"sinssim.{name_of(file)}".rstrip("."): file for file in FILES}


def is_face(file: Path) -> bool:
    """Return whether a file only offers names of modules below it, loaded on first use."""
    return file.name == "__init__.py" and "on_first_use" in file.read_text(encoding="utf-8")


def used(file: Path) -> Iterator[tuple[int, str]]:
    """Yield line and module of every import of the package's own files."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module in MODULES:
            for name in node.names:
                full = f"{node.module}.{name.name}"
                yield node.lineno, full if full in MODULES else str(node.module)


def test_every_part_has_its_place() -> None:
    assert [name for name in map(name_of, FILES) if name and not layer(name)] == []


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(PACKAGE).as_posix())
def test_imports_point_left(file: Path) -> None:
    if is_face(file):
        return
    own = layer(name_of(file))
    for line, name in imports(file):
        library = name.split(".")[0]
        if library in HOMES:
            right = any(fits(name_of(file), home) for home in HOMES[library])
            assert right, f"{file.relative_to(PACKAGE)}, line {line}: {library} belongs to {sorted(HOMES[library])}"
    for line, name in used(file):
        other = layer(name.removeprefix("sinssim."))
        if name != "sinssim" and other != own:
            right = LAYERS.index(other) < LAYERS.index(own)
            assert right, f"{file.relative_to(PACKAGE)}, line {line}: {own} must not import {name}"


def test_no_circle_of_files() -> None:
    needs = {name: set() if is_face(file) else {other for _, other in used(file)} for name, file in MODULES.items()}
    order = graphlib.TopologicalSorter(needs)
    order.prepare()  # raises CycleError, which names the files of a circle


def test_what_a_run_loads_before_its_flight_begins() -> None:
    """The flight is the long part: what comes after it is loaded while another process flies."""
    later = ("rerun", "pyarrow", "matplotlib", "filterpy", "jsbsim")
    code = f"import sys, sinssim.simulation.execute; print([name for name in {later} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_a_filter_is_checked_without_loading_the_compiler() -> None:
    """`sinssim check` plans a filter; it computes nothing that kernels are needed for."""
    later = ("numba", "filterpy", "scipy.stats")
    code = (
        f"import sys, sinssim.estimation.from_scenario.memory; print([name for name in {later} if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
