"""The worked examples of the documentation run as they are printed."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from sinssim import ALGORITHMS, ImuData, NavState, jit, load_scenario, navigate
from sinssim.algorithms import REGISTRY, Algorithm
from tests.oracles.s_turn import STurn

PAGE = Path(__file__).parent.parent / "docs" / "adding-an-algorithm.md"


@pytest.fixture
def cayley(tmp_path, monkeypatch):
    """The file and the registry line of the page, in place for one test."""
    file, line, _ = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    path = tmp_path / "cayley.py"
    path.write_text(file, encoding="utf-8")
    # kernels of this file must not stay in the cache, whose key knows of the package's files only
    monkeypatch.setattr(jit, "_kernel_folder", lambda: str(tmp_path / "kernels"))
    name = "sinssim.strapdown.cayley"
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    ((key, entry),) = eval(f"{{{line}}}", {"Algorithm": Algorithm}).items()
    monkeypatch.setitem(REGISTRY, key, entry)
    monkeypatch.setitem(ALGORITHMS, key, entry.sentence)
    return module


def test_worked_example_of_an_algorithm(cayley):
    q = np.array(cayley.cayley_k.py_func(0.0, 0.2, 0.0))
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-15)
    assert 2 * np.arctan2(q[2], q[0]) == pytest.approx(0.2 - 0.2**3 / 48, abs=1e-6)  # next: +φ⁵/1280

    flight = STurn(duration=20, period=3.0).fly(50)
    first = NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])
    imu = ImuData(flight.time, flight.dtheta, flight.dvel)

    def error(**options):
        solution = navigate(imu, first, gravity="somigliana", **options)
        assert np.max(solution.defect) < 1e-13
        return np.max(flight.attitude_error(solution.q_nb))

    cayleys = error(algorithm="cayley")
    assert error(algorithm="cayley", frame="wander") == pytest.approx(cayleys, rel=1e-3, abs=0)
    # a quarter of what the normalised first-order step misses at a constant rate
    assert 0 < cayleys < 1e-3
    assert cayleys > 100 * error(algorithm="quaternion")


def test_worked_example_of_the_filter(capsys):
    page = PAGE.with_name("estimation.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    exec(code, {})
    first, second = capsys.readouterr().out.splitlines()[:2]
    verdict, sigma = first.split()
    assert verdict == "True"
    # five minutes of a laser-navigation unit at 50°: random walk and bias over the Earth's rate
    assert float(sigma) == pytest.approx(np.radians(2.76 / 60.0), rel=0.15)
    assert second.startswith("[")


def test_scenario_and_commands_of_the_filter(tmp_path):
    page = PAGE.with_name("estimation.md").read_text(encoding="utf-8")
    (keys,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    parked = "[parked]\nlatitude_deg = 50.0\nlongitude_deg = 14.0\naltitude_m = 300.0\nduration_s = 60.0\n"
    path = tmp_path / "page.toml"
    path.write_text(f'name = "page"\n{parked}\n{keys}', encoding="utf-8")
    scenario = load_scenario(path)
    assert scenario.filter.smooth
    assert scenario.aiding.gnss.outages_s == ((1200.0, 1500.0),)
    (commands,) = re.findall(r"```sh\n(.*?)```", page, re.DOTALL)
    run = re.findall(r"^sinssim run (\w+)", commands, re.MULTILINE)
    assert len(run) == 7
    for name in run:
        assert load_scenario(name).filter is not None
    for link in re.findall(r"\]\(([\w./-]+)\)", page):
        assert (PAGE.parent / link).exists(), link
