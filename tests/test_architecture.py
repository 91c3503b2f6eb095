"""Imports point one way, and the heavy libraries stay where they belong."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import sinssim
from sinssim.jit import NO_KERNELS

PACKAGE = Path(sinssim.__file__).parent

LAYERS = [
    # what stands under everything
    "errors", "units", "interrupt", "algorithms", "names", "rates", "data", "checks", "jit", "earth_models",
    "rotation", "earth",
    # data flows right, imports point left
    "scenario", "truth", "sensors", "strapdown", "nav_error", "alignment", "estimation", "aided", "recording",
    "studies", "simulation", "precompile", "cli", "__main__",
]  # fmt: skip
"""Modules and subpackages, each of which may import those before it and nothing else of the package."""

HOMES = {
    "rerun": {"recording", "studies"},
    "rerun_cli": {"recording"},
    "jsbsim": {"truth"},
    "filterpy": {"estimation"},
    "typer": {"cli"},
    "tomllib": {"scenario"},
}
"""Libraries that only these parts may import."""

FILES = sorted(file for file in PACKAGE.rglob("*.py") if "_content" not in file.parts)


def layer(module: str) -> str:
    """Return the part of the package that a module belongs to: "sinssim.truth.curve" → "truth"."""
    return module.split(".")[1] if "." in module else ""


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


def test_every_part_has_its_place() -> None:
    parts = {path.stem for path in PACKAGE.glob("*.py")} | {path.name for path in PACKAGE.iterdir() if path.is_dir()}
    assert parts - {"__init__", "__pycache__", "_content", "py.typed"} <= set(LAYERS)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(PACKAGE).as_posix())
def test_imports_point_left(file: Path) -> None:
    place = file.relative_to(PACKAGE)
    if place.name == "__init__.py" and len(place.parts) == 1:
        return  # the package's top level offers names of every part, loaded on first use
    own = place.parts[0].removesuffix(".py")
    for line, name in imports(file):
        library = name.split(".")[0]
        if library == "sinssim":
            other = layer(name)
            if other in ("", "__version__", own):
                continue
            assert LAYERS.index(other) < LAYERS.index(own), f"{place}, line {line}: {own} must not import {name}"
        elif library in HOMES:
            assert own in HOMES[library], f"{place}, line {line}: {own} must not import {library}"


def test_no_kernel_uses_a_part_that_is_said_to_hold_none() -> None:
    """Kernels are kept under a digest that leaves these parts out; what a kernel's file imports may be in it."""
    names = (".".join(("sinssim", *file.relative_to(PACKAGE).with_suffix("").parts)) for file in FILES)
    modules = {name.removesuffix(".__init__"): file for name, file in zip(names, FILES, strict=True)}
    found = {name for name, file in modules.items() if "sinssim.jit" in {i for _, i in imports(file)}}
    found -= {"sinssim.truth.cache"}  # it only wants to know where the cache is
    assert len(found) > 15
    reached: set[str] = set()
    while found - reached:
        name = (found - reached).pop()
        reached.add(name)
        found |= {i for _, i in imports(modules[name]) if i in modules}
    assert not [name for name in reached if {layer(name), f"{layer(name)}.py"} & set(NO_KERNELS)]


def test_what_a_run_loads_before_its_flight_begins() -> None:
    """The flight is the long part: what comes after it is loaded while another process flies."""
    later = ("rerun", "pyarrow", "matplotlib", "filterpy", "jsbsim")
    code = f"import sys, sinssim.simulation; print([name for name in {later} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
