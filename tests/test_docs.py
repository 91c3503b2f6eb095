"""The worked examples of the documentation run as they are printed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim import load_scenario

DOCS = Path(__file__).parent.parent / "docs"


def test_worked_example_of_the_filter(capsys):
    page = (DOCS / "estimation.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict[str, Any] = {}
    exec(code, names)
    first, second = capsys.readouterr().out.splitlines()[:2]
    verdict, sigma = first.split()
    assert verdict == "True"
    # a laser-navigation unit at 50°: bias and random walk over the Earth's rate. Two minutes by eq. (1), in which the
    # base may have turned by σ_d (10 µg/√Hz over τ) to 4σ_d, limit and error of what is measured of it
    bias, walk, white = np.radians(0.0035) / 3600.0, np.radians(0.002) / 60.0, 10e-6
    north = 7.292115e-5 * np.cos(np.radians(50.0))
    tau = np.linspace(1.0, 59.0, 59)
    turns = (2.0 * white**2 / tau + walk**2 * (2.0 * tau / 3.0 - tau**2 / 120.0)) / (1.0 - tau / 120.0) ** 2
    turn = np.sqrt(turns.min()) / 120.0
    coarse = names["result"].aided.estimate.sigma[0, 8] * north
    assert np.sqrt(bias**2 + walk**2 / 120.0 + turn**2) * 0.97 < coarse
    assert coarse < np.sqrt(bias**2 + walk**2 / 120.0 + 17.0 * turn**2)
    # and three minutes of the filter, less the 40 s in which it tells the tilt from noise; inverse variances add up
    noise = 1.0 / (1.0 / (coarse**2 - bias**2) + (180.0 - 40.0) / walk**2)
    assert float(sigma) * north == pytest.approx(np.sqrt(bias**2 + noise), rel=0.05)
    assert second.startswith("[")


def test_scenario_and_commands_of_the_filter(tmp_path):
    page = (DOCS / "estimation.md").read_text(encoding="utf-8")
    (keys,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    parked = "[parked]\nlatitude_deg = 50.0\nlongitude_deg = 14.0\naltitude_m = 300.0\nduration_s = 60.0\n"
    path = tmp_path / "page.toml"
    path.write_text(f'name = "page"\n{parked}\n{keys}', encoding="utf-8")
    scenario = load_scenario(path)
    assert scenario.filter.smooth
    assert scenario.aiding.gnss.outages_s == ((1200.0, 1500.0),)
    (commands,) = re.findall(r"```sh\n(.*?)```", page, re.DOTALL)
    run = re.findall(r"^sinssim run (\w+)", commands, re.MULTILINE)
    assert len(run) == 6
    for name in run:
        assert load_scenario(name).filter is not None
    for link in re.findall(r"\]\(([\w./-]+)\)", page):
        assert (DOCS / link).exists(), link


def test_examples_of_ensembles(capsys, tmp_path, monkeypatch):
    """The page's numbers: circles by closed form where there is one, percentiles of the drawn rates by numpy."""
    page = (DOCS / "ensembles.md").read_text(encoding="utf-8")
    statistics, whole, in_parts = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict[str, Any] = {}
    exec(statistics, names)
    first, second = capsys.readouterr().out.splitlines()
    wanted = np.percentile(names["rates"], [50.0, 95.0], method="median_unbiased")
    assert first.startswith(f"CEP {wanted[0]:.3f} nmi/h, R95 {wanted[1]:.3f} (")
    assert 20.0 * 2.4477 < float(second.split()[0]) < 30.0 * 2.4477
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(whole, names)
    shape = capsys.readouterr().out.split(") ")[0]
    assert shape == "(80, 11, 3"
    assert sorted(file.name for file in Path("tables").iterdir()) == ["errors.parquet", "runs.parquet"]
    exec(in_parts, names)
    assert capsys.readouterr().out.startswith("0.0 (80, 11) ")


def test_scenario_and_links_of_ensembles(tmp_path):
    page = (DOCS / "ensembles.md").read_text(encoding="utf-8")
    (keys,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    path = tmp_path / "page.toml"
    path.write_text(f'name = "page"\n[parked]\nlatitude_deg = 50.0\nduration_s = 60.0\n{keys}', encoding="utf-8")
    scenario = load_scenario(path)
    assert scenario.ensemble.vary[0].key == "parked.heading_deg"
    for link in re.findall(r"\]\(([\w./-]+)\)", page):
        assert (DOCS / link).exists(), link


def test_commands_scenario_and_links_of_gravity(tmp_path):
    page = (DOCS / "gravity.md").read_text(encoding="utf-8")
    (commands,) = re.findall(r"```sh\n(.*?)```", page, re.DOTALL)
    lines = re.findall(r"^sinssim (?:run|budget) (\w+)(?: --set (\S+))?", commands, re.MULTILINE)
    assert len(lines) == 3
    degrees = [load_scenario(name, [key] if key else []).navigation.gravity_degree for name, key in lines]
    assert degrees == [None, 120, None]
    (keys,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    path = tmp_path / "page.toml"
    path.write_text(f'name = "page"\n[parked]\nlatitude_deg = 50.0\nduration_s = 60.0\n{keys}', encoding="utf-8")
    assert load_scenario(path).gravity.remainder.order == 2
    for module in re.findall(r"`(sinssim(?:\.\w+)+)`", page):
        parts = module.split(".")
        places = [DOCS.parent / "/".join(parts[:n]) for n in (len(parts), len(parts) - 1)]
        assert any(place.with_suffix(".py").exists() or place.is_dir() for place in places), module
