"""Reports of every kind and the web view in a real browser: a console without errors, a page that fits, something
drawn, also without scripts and in print, no request, and nothing that axe-core finds serious (`make test-reports`)."""

from __future__ import annotations

import io
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sinssim.cli import app as cli
from sinssim.experiments.run.run_execution import run
from tests.browser import CHROMIUM, Page, file_address
from tests.experiments.ensembles.examples import scenario
from tests.recording import fake_run

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")]

STUDY = """\
description = "a parked vehicle"

[[parts]]
title = "one"
algorithms = ["quaternion"]
rates_hz = [50.0, 100.0]

[[parts.motions]]
parked = { latitude_deg = 50.0, duration_s = 5.0 }
"""


KINDS = ("run", "study", "ensemble", "both", "budget", "trade", "calibration", "alignment", "noise", "plane", "list")


def call(*arguments: str) -> None:
    with pytest.raises(SystemExit) as stopped:
        cli.main(arguments)
    assert not stopped.value.code


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of each of `KINDS`."""
    folder = tmp_path_factory.mktemp("browser")
    with pytest.MonkeyPatch.context() as patch:
        fake_run.install(3000, patch.setattr)
        for name in ("run", "other"):
            run(fake_run.scenario(), folder / name)
    (folder / "mine.toml").write_text(STUDY, encoding="utf-8")
    (folder / "many.toml").write_text(scenario(ensemble={"epoch_s": 5.0}).to_toml(), encoding="utf-8")
    call("compare", str(folder / "mine.toml"), "-o", str(folder / "study"), "-q")
    call("ensemble", str(folder / "many.toml"), "--runs", "20", "-o", str(folder / "ensemble"), "-q")
    call("compare-runs", str(folder / "run"), str(folder / "other"), "-o", str(folder / "both"), "-q")
    short = ("-q", "--set", "parked.duration_s=60", "--set", "imu.rate_hz=10")
    call("budget", "parked", *short, "--require", "r95(end) <= 1 km", "-o", str(folder / "budget"))
    call("compare", "parked", *short, "--vary", "imu.grade=tactical,consumer", "-o", str(folder / "trade"))
    call("run", "parked", *short, "-o", str(folder / "rest"))
    call("align", "parked", *short[1:], "-o", str(folder / "alignment"))
    call("allan", str(folder / "rest"), "-q", "--channel", "gyro_x", "-o", str(folder / "noise"))
    table = ("--set", "turntable.dwell_s=5", "--set", "imu.rate_hz=10")
    call("calibrate", "calibration_table", "-q", *table, "-o", str(folder / "calibration"))
    call("run", "one_component", "-q", "-o", str(folder / "plane"))
    call("runs", str(folder), "--html")
    (folder / "list").mkdir()
    (folder / "runs.html").rename(folder / "list" / "report.html")
    return folder


def seen(page: Page) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(page.picture())).convert("RGB")).astype(int)


def colourful(picture: np.ndarray) -> int:
    """Return the number of pixels of a colour, which frames and text are not."""
    return int(((picture.max(axis=2) - picture.min(axis=2)) > 60).sum())


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("dark", [False, True])
def test_a_report(made: Path, name: str, dark: bool) -> None:
    with Page(size=(1250, 1000), dark=dark) as page:
        page.open(file_address(made / name / "report.html"))
        page.wait(1.0)
        assert page.problems == []
        assert page.value("document.documentElement.scrollWidth <= window.innerWidth")
        assert page.value("document.querySelectorAll('svg, img').length") > 0
        assert page.value(
            "[...document.querySelectorAll('svg text')].every(t => getComputedStyle(t).fill !== "
            "getComputedStyle(document.body).backgroundColor)"
        )
        page.value("document.querySelector('svg').scrollIntoView()")
        page.wait(0.5)
        picture = seen(page)
        assert (np.median(picture) < 60) == dark
        assert colourful(picture) > 100


@pytest.mark.parametrize("name", KINDS)
def test_a_narrow_report_without_scripts_and_in_print(made: Path, name: str) -> None:
    with Page(size=(360, 740)) as page:
        page.open(file_address(made / name / "report.html"), "document.readyState === 'complete'")
        page.wait(1.0)
        assert page.value("document.documentElement.scrollWidth <= innerWidth")
        assert page.serious() == []
        page.media("print")
        figures = "[...document.querySelectorAll('figure.live, figure.live_map')]"
        assert page.value(f"{figures}.every(one => getComputedStyle(one.querySelector('svg')).display !== 'none')")
        assert page.value(f"{figures}.every(one => !one.querySelector('.curves, .zoomed')?.offsetWidth)")
        page.media("screen")
        page.size(1250, 1000)
        page.scripts(False)
        page.open(file_address(made / name / "report.html"))
        page.wait(1.0)
        assert colourful(np.asarray(Image.open(io.BytesIO(page.picture(whole=True))).convert("RGB")).astype(int)) > 100
        assert page.problems == []
        assert [address for address in page.requests if not address.startswith(("file:", "data:"))] == []


def test_the_page_of_a_flight_of_84_minutes(tmp_path: Path) -> None:
    """With 18 charts and more, which share one time."""
    call("run", "first_flight", "-q", "--keep", "report", "-o", str(tmp_path / "run"))
    report = tmp_path / "run" / "report.html"
    assert report.stat().st_size < 1.5e6
    with Page(size=(1250, 8000)) as page:
        page.open(file_address(report), "live.drawn.length >= 18 && live.drawn.every(chart => chart.seen)")
        page.value("live.show(live.drawn.find(chart => chart.timed), 20, 30)")
        page.drawn()
        shown = "live.drawn.filter(chart => chart.timed).map(({plot}) => [plot.scales.x.min, plot.scales.x.max].join())"
        assert page.value(f"[...new Set({shown})]") == ["20,30"]
        assert page.problems == []


@pytest.mark.parametrize("name", ["run", "study", "ensemble"])
def test_the_web_view(made: Path, name: str) -> None:
    command = [sys.executable, "-m", "sinssim", "view", str(made / name), "--web"]
    timed = ["--time", "7"] if name == "run" else []
    server = subprocess.Popen([*command, *timed], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    try:
        address = server.stdout.readline().removeprefix("Open ").strip()
        with Page(graphics=True) as page:
            page.open(address)
            begin, drawn = time.monotonic(), 0
            while drawn < 1000 and time.monotonic() - begin < 240.0:  # 15 s on a machine of its own
                page.wait(2.0)
                # the page that loads the data has a coloured list at its left, and a coloured word at its top
                drawn = colourful(seen(page)[50:, 250:])
            assert drawn >= 1000  # a line across half of the view is one pixel or two high
            if timed:  # 7e9 ns as the viewer tells it
                page.until("window._handle.viewer_state().join().includes('34,6,8,128,140,238,137,26')")
            # without internet the map's tiles are missing, and Chromium says so
            ours = [problem for problem in page.problems if not re.search(r"tile\.openstreetmap\.org", problem)]
            assert ours == []
    finally:
        server.terminate()
        server.wait(20.0)
        server.stdout.close()
