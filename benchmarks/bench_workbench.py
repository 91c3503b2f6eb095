"""Times of the workbench in headless Chromium: opening, the check behind typing, a list of 500 runs.

    python -m benchmarks.bench_workbench [--repeat 3] [--runs 500]

The page counts as open when it lists the scenarios, from the start of the command. Behind typing is the time from a key
in the text of a shipped scenario until its mistake, or its end, is seen on the page.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.bench_disk import environment
from sinssim.system.files import MARK
from tests.browser import CHROMIUM, Page

_SCENARIOS = ("first_flight", "aided_airliner", "gate_to_gate", "drive")
_TYPING = """(async () => {
  const area = document.getElementById("text"), verdict = document.getElementById("verdict"), times = [];
  for (let k = 0; k < 20; k++) {
    const wrong = k % 2 === 0, at = area.value.indexOf(wrong ? "[imu]" : "x[imu]");
    area.focus();
    area.setSelectionRange(at, at + !wrong);
    const begun = performance.now();
    document.execCommand(wrong ? "insertText" : "delete", false, "x");
    while ((document.querySelector(".bad") !== null) !== wrong || (verdict.className === "wrong") !== wrong)
      await new Promise(done => setTimeout(done, 1));
    times.push(performance.now() - begun);
    await new Promise(done => setTimeout(done, 100));
  }
  return times.sort((a, b) => a - b);
})()"""


@contextmanager
def workbench(folder: Path) -> Iterator[tuple[str, float]]:
    """Serve a folder; yield the address, and when the command was started."""
    begun = time.monotonic()
    command = [sys.executable, "-m", "sinssim", "workbench", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment()) as server:
        assert server.stdout is not None
        try:
            yield server.stdout.readline().removeprefix("Open ").strip(), begun
        finally:
            server.terminate()


def make_runs(folder: Path, count: int) -> None:
    """Write the files of small finished runs."""
    for number in range(count):
        run = folder / "runs" / f"run_{number}"
        (run / "streams").mkdir(parents=True)
        for name in (MARK, "scenario.toml", "report.html", *(f"streams/{k}.parquet" for k in range(30))):
            (run / name).write_text("")
        numbers = '{"quaternion": {"rms_horizontal_error_m": 1000.0}}'
        (run / "summary.json").write_text(f'{{"scenario": "parked", "versions": {{}}, "algorithms": {numbers}}}')


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--runs", type=int, default=500)
    arguments = parser.parse_args()
    if CHROMIUM is None:
        print("There is no Chromium on this machine.")
        return
    for _ in range(arguments.repeat):
        with tempfile.TemporaryDirectory() as name, Page() as page:
            with workbench(Path(name)) as (address, begun):
                page.open(address, "document.querySelectorAll('#shipped button').length > 3")
                print(f"open {time.monotonic() - begun:.2f} s after the start of the command")
                for scenario in _SCENARIOS:
                    page.open(f"{address}?{scenario}#{scenario}", "document.querySelector('#drawn svg')")
                    page.wait(1.0)
                    times = page.value(_TYPING)
                    print(f"{scenario}: {times[len(times) // 2]:.0f} ms behind typing, at most {times[-1]:.0f} ms")
            make_runs(Path(name), arguments.runs)
            with workbench(Path(name)) as (address, _):
                page.open(address, "document.querySelectorAll('#finished tbody tr').length > 0")
                listed = page.value(
                    "(async t => (await (await fetch('runs')).text(), performance.now() - t))(performance.now())"
                )
                print(f"{arguments.runs} runs are listed in {listed / 1e3:.2f} s")


if __name__ == "__main__":
    main()
