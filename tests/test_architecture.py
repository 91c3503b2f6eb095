"""Imports point down the floors, and the heavy libraries stay where they belong."""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import sinssim
from tests.sources import nodes

PACKAGE = Path(sinssim.__file__).parent

LAYERS = [
    "system",       # with the files of the top level: errors, units, data, tables of scenario files, compiled kernels
    "rotation",     # quaternions, matrices, angles
    "earth",        # ellipsoids, gravity, coordinates
    "statistics",   # circles, rates, requirements, random numbers
    "truth",        # the motion of the vehicle and of its sensors
    "sensors",      # inertial and aiding sensors with their errors
    "strapdown",    # navigation on increments, strapdown and on a platform
    "logs",         # files of recorded sensors and solutions
    "alignment",    # heading, roll, pitch and latitude at rest, and their theory
    "estimation",   # error model, Kalman filter, smoother
    "scenario",     # reads and checks a scenario, and builds what the floors below work with
    "recording",    # the media: tables, pages, figures, Rerun, Parquet, run directories
    "simulation",   # the stages of a run: truth, sensed, navigated, aided
    "analyses",     # covariance budget, alignment sessions, calibration, noise, inspection
    "experiments",  # runs, ensembles, comparisons, trade studies, and what they have to show
    "cli",          # the command line
]  # fmt: skip
"""The top-level folders, each of which may import those before it. The files of the top level belong to the first."""

HOMES = {
    "rerun": {
        *(f"recording.rerun_{part}" for part in ("exhibits", "file", "viewer", "views")),
        "*_scores",
        "*_recording",
    }
    | {"experiments.run.one_component_exhibits"},
    "rerun_cli": {"recording.rerun_viewer"},
    "jsbsim": {"truth.flight", "truth.aircraft_design"},
    "filterpy": {"estimation"},
    "typer": {"cli"},
    "tomllib": {"toml_mistakes", "scenario.load", "scenario.overrides"},
    "rich": {"cli", "recording.console", "progress", "*_table"},
    "matplotlib": {"recording.figures"},
    "pymavlink": {"experiments.run.stream_packets"},
    "starlette": {"cli.workbench_server"},
    "uvicorn": {"cli.workbench_server"},
}
"""Libraries that only these parts may import; "*" stands for any beginning of a module's name."""

FILES = sorted(file for file in PACKAGE.rglob("*.py") if "_content" not in file.parts)


def name_of(file: Path) -> str:
    """Return a file's module without `sinssim.`: "truth.curve"."""
    return ".".join(file.relative_to(PACKAGE).with_suffix("").parts).removesuffix("__init__").rstrip(".")


def fits(module: str, part: str) -> bool:
    """Return whether a module is, or lies in, a part of the package."""
    if part.startswith("*"):
        return module.endswith(part[1:])
    return module == part or module.startswith(f"{part}.")


def layer(module: str) -> str:
    """Return the floor of a module: "truth.curve" → "truth"; the files of the top level belong to the first."""
    top = module.split(".")[0]
    return "cli" if top == "__main__" else top if (PACKAGE / top).is_dir() else LAYERS[0]


def imports(file: Path) -> Iterator[tuple[int, str]]:
    """Yield line and full name of every import, wherever it stands in the file."""
    for node in nodes(file):
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
    for node in nodes(file):
        if isinstance(node, ast.ImportFrom) and node.module in MODULES:
            for name in node.names:
                full = f"{node.module}.{name.name}"
                yield node.lineno, full if full in MODULES else str(node.module)
        elif isinstance(node, ast.Import):
            yield from ((node.lineno, name.name) for name in node.names if name.name in MODULES)


def test_every_folder_is_a_floor() -> None:
    folders = {file.relative_to(PACKAGE).parts[0] for file in FILES if file.parent != PACKAGE}
    assert folders == set(LAYERS)
    assert len(LAYERS) <= 16


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(PACKAGE).as_posix())
def test_no_import_hides_its_arrow(file: Path) -> None:
    """A module is imported by a statement, which this test sees; by a name only where the name is looked up."""
    for node in nodes(file):
        if isinstance(node, ast.Call):
            function = getattr(node.func, "attr", getattr(node.func, "id", ""))
            first = node.args[0] if node.args else None
            by_name = function in ("import_module", "__import__") and isinstance(first, ast.Constant)
            assert not by_name, f"{file.relative_to(PACKAGE)}, line {node.lineno}"


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(PACKAGE).as_posix())
def test_imports_point_down(file: Path) -> None:
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
    code = (
        f"import sys, sinssim.experiments.run.run_execution; print([name for name in {later} if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_a_filter_is_checked_without_loading_the_compiler() -> None:
    """`sinssim check` plans a filter; it computes nothing that kernels are needed for."""
    later = ("numba", "filterpy", "scipy.stats")
    code = f"import sys, sinssim.scenario.true_motion; print([name for name in {later} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
