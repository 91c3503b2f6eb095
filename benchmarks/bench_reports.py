"""Sizes of reports, and how soon and how smoothly headless Chromium shows them; graphics are drawn by the processor.

    python -m benchmarks.bench_reports [--repeat 3] [RUN_DIRECTORY]

The report is that of `first_flight`, which is run if no directory is given, and the list is one of 500 short runs. A
page is interactive once its first charts are drawn and answer; the first opening has an empty profile.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

import sinssim
from sinssim.experiments.run.finished_runs import runs_in
from sinssim.experiments.run.run_comparison import write_list
from tests.browser import CHROMIUM, Page, file_address
from tests.experiments.run.test_by_hand import write

_PAN = """new Promise(done => {
  const chart = live.drawn.find(one => one.seen), begin = performance.now();
  let frames = 0, way = 1;
  live.zoom(chart, 0.2, 0.3);
  const step = () => {
    if (++frames % 40 === 0) way = -way;
    live.pan(chart, 0.02 * way);
    const passed = performance.now() - begin;
    if (passed < 4000) requestAnimationFrame(step); else done(1000 * frames / passed);
  };
  requestAnimationFrame(step);
})"""


def opened(page: Page, path: Path, ready: str) -> float:
    """Return the time from opening a page until it is interactive, s."""
    page.open("about:blank", "true")
    page.open(file_address(path), ready)
    return 1e-3 * float(page.value("performance.now()"))


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", nargs="?", type=Path, help="directory of a run of first_flight")
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    if CHROMIUM is None:
        raise SystemExit("There is no Chromium on this machine.")
    with tempfile.TemporaryDirectory() as folder:
        run = options.run or sinssim.run(sinssim.load_scenario("first_flight"), Path(folder) / "run").directory
        report, many = Path(str(run)) / "report.html", Path(folder) / "many"
        time = tuple(np.linspace(0.0, 600.0, 2000))
        for k in range(500):
            write(many / f"run {k}", time, 1.0 + 0.01 * k, more=f"[imu]\nbias = {k}\n")
        pages = {"report": (report, "live.drawn.length"), "list": (write_list(runs_in(many), many), "live.severalRuns")}
        for name, (path, ready) in pages.items():
            print(f"{name}: {path.stat().st_size / 1e6:.2f} MB")
            with Page(size=(1250, 1000)) as page:
                times = [opened(page, path, ready) for _ in range(1 + options.repeat)]
                print(f"  interactive after {times[0]:.2f} s at first, then {min(times[1:]):.2f} s")
                page.value("document.querySelector('figure.live').scrollIntoView()")
                page.wait(1.0)
                print(f"  {page.value(_PAN):.0f} frames/s while {page.value('live.drawn.length')} charts move")


if __name__ == "__main__":
    main()
