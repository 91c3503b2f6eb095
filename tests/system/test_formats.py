"""File formats and export formats outside the package: by `use`, and of an installed package."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import sinssim
from sinssim.cli.commands.content import Listing, names_of
from sinssim.content import _of_packages
from sinssim.errors import InputError
from sinssim.logs.formats import FORMATS, WRITERS, detect, read_file
from sinssim.logs.formats.export_streams import export
from sinssim.system.registries import forget
from tests.system.test_installed import install

PAGE = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
(FORMAT,) = re.findall(r'^```python\n("""Our recorder.*?)^```', PAGE, re.DOTALL | re.MULTILINE)
"""The example of the page on formats."""

WRITER = '''"""Our display: seconds and heights."""

from __future__ import annotations

from pathlib import Path

from sinssim.logs.formats.export_streams import Content

SUFFIX = ".hgt"
HOLDS = "solution"


def write(content: Content, place: Path) -> list[str]:
    """Write the heights."""
    solution = content.solution
    rows = (f"{t:.3f} {h:.3f}" for t, h in zip(solution.time, solution.height, strict=True))
    place.write_text("\\n".join(rows) + "\\n")
    return ["Time, s, and height, m."]
'''


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A project with a format of each kind."""
    for kind, name, text in (("formats", "recorder", FORMAT), ("writers", "display", WRITER)):
        (tmp_path / "own" / kind).mkdir(parents=True)
        (tmp_path / "own" / kind / f"{name}.py").write_text(text, encoding="utf-8")
    return tmp_path / "own"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A file of the format: a unit at rest, ten samples a second."""
    rows = "\n".join(f"{0.1 * k:.1f} 0 0 0 0 0 -0.98" for k in range(51))
    (tmp_path / "unit.log").write_text(f"RECORDER\n{rows}\n")
    return tmp_path / "unit.log"


def test_a_format_by_use(folder: Path, log: Path) -> None:
    with pytest.raises(InputError, match="none of the known formats"):
        detect(log)
    assert sinssim.use(folder) == ["recorder", "display"]
    assert detect(log) == "recorder"
    loaded = sinssim.load_log(log)
    assert loaded.imu.time[-1] == pytest.approx(5.0)
    np.testing.assert_allclose(loaded.imu.dvel[1:, 2], -0.98)
    assert list(FORMATS)[-1] == "recorder"
    assert names_of(Listing.FORMATS)["recorder"].startswith("Our recorder: seconds, three increments of angle and ")
    forget()
    assert "recorder" not in FORMATS
    with pytest.raises(InputError, match="format 'recorder'"):
        read_file(log, "recorder")


def test_a_scenario_names_its_format(folder: Path, log: Path, tmp_path: Path) -> None:
    """The run keeps a copy of the format's file, from which it can be repeated."""
    text = sinssim.load_scenario(Path(__file__).parents[1] / "data" / "drive" / "drive.toml").to_toml()
    assert "recorder" not in text
    place = tmp_path / "mine.toml"
    place.write_text(
        f'use = ["{folder}"]\n[log.imu]\nfile = "{log}"\nformat = "recorder"\n'
        "[log.start]\nlatitude_deg = 50.0\nlongitude_deg = 8.0\nheight_m = 100.0\nheading_deg = 10.0\n"
        '[imu]\ngrade = "tactical"\n',
        encoding="utf-8",
    )
    scenario = sinssim.load_scenario(place)
    assert [item.words for item in scenario.own_items()] == ["file format recorder"]


def test_formats_of_an_installed_package(folder: Path, log: Path, tmp_path: Path) -> None:
    """Without `use`: the list of installed packages is read when nothing of the package's own fits."""
    package = install(tmp_path / "site", "theirs", "their_formats")
    folder.rename(package)
    broken = install(tmp_path / "site", "broken", "nowhere_at_all")
    assert not broken.exists()
    (tmp_path / "path.gpx").write_text('<?xml version="1.0"?><gpx version="1.1"></gpx>')
    code = f"""
import sys, json
from pathlib import Path
sys.path.insert(0, {str(tmp_path / "site")!r})
import sinssim
from sinssim.content import _of_packages
from sinssim.logs.formats import detect
known = detect(Path({str(tmp_path / "path.gpx")!r})), _of_packages.cache_info().misses
short = ["parked.duration_s=5", "imu.rate_hz=10", "recording.keep=streams"]
run = sinssim.run("parked", {str(tmp_path / "run")!r}, overrides=short)
from sinssim.logs.formats.export_streams import export
done = export(run.directory, "display", {str(tmp_path / "h.hgt")!r})
print(json.dumps([*known, detect(Path({str(log)!r})), done.sentences[0]]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == ["gpx", 0, "recorder", "Time, s, and height, m."]
    assert len((tmp_path / "h.hgt").read_text().splitlines()) == 51
    assert done.stderr.count("The installed package broken 1.2 provides content") == 1


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("def read(", "def reads("), r"the file format recorder cannot be used: .*recorder\.py defines no read\."),
        (
            ("table = np", "table = 1 / 0\n    np"),
            r"the file format recorder failed: .*recorder\.py, line 17: ZeroDivisionError",
        ),
        (
            ("import numpy", "import nothing_there\nimport numpy"),
            r"the file format recorder cannot be used: .*line 5: Modu",
        ),
    ],
)
def test_a_format_that_fails_is_named(folder: Path, log: Path, change: tuple[str, str], said: str) -> None:
    file = folder / "formats" / "recorder.py"
    assert change[0] in FORMAT
    file.write_text(FORMAT.replace(*change), encoding="utf-8")
    sinssim.use(file)
    with pytest.raises(InputError, match=said):
        read_file(log, "recorder")


def test_names_of_the_package_stay_its_own(folder: Path) -> None:
    for kind, name in (("formats", "nmea"), ("writers", "kml")):
        file = next((folder / kind).glob("*.py")).rename(folder / kind / f"{name}.py")
        with pytest.raises(InputError, match=f"sinssim itself has the .* {name}, and results"):
            sinssim.use(file)
    code = f"import sinssim; sinssim.use({str(folder)!r}); sinssim.load_log('x.nmea')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "sinssim itself has the" in done.stderr


def test_what_is_exported_by_a_scenario_project(folder: Path, tmp_path: Path) -> None:
    run = sinssim.run("parked", tmp_path / "run", overrides=["parked.duration_s=5", "imu.rate_hz=10"])
    assert run.directory is not None
    with pytest.raises(InputError, match="format 'display'"):
        export(run.directory, "display")
    sinssim.use(folder / "writers" / "display.py")
    assert "display" in WRITERS
    done = export(run.directory, "display", tmp_path / "heights.hgt")
    assert done.place == tmp_path / "heights.hgt"
    _of_packages.cache_clear()
