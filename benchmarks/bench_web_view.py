"""Time until headless Chromium shows the web view of the demonstration run, and the messages of its console.

    python -m benchmarks.bench_web_view [--repeat 3] [--picture FILE.png]

Every repetition starts a new server and a new browser with an empty profile; graphics are drawn by the processor. The
view is considered complete when the plots show curves: at least 15 000 coloured pixels, and as many in the next
picture. The viewer's own pages while it loads have up to 8000.
"""

from __future__ import annotations

import argparse
import io
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.bench_disk import environment
from tests.browser import CHROMIUM, Page

_SERVE = "import pathlib, sys; from sinssim.recording.rerun_viewer import serve; serve(pathlib.Path(sys.argv[1]))"
_LONGEST = 240.0
_DRAWN = 15_000


def colourful(picture: bytes) -> int:
    """Return the number of coloured pixels; frames and text have no colour."""
    pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(int)
    return int(((pixels.max(axis=2) - pixels.min(axis=2)) > 60).sum())


def shown(folder: Path, picture: Path | None) -> tuple[float, float, list[str]]:
    """Return the times from starting the browser and from opening the page to the view, s, and the problems."""
    server = subprocess.Popen([sys.executable, "-c", _SERVE, str(folder)], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    try:
        address = server.stdout.readline().removeprefix("Open ").strip()
        started = time.monotonic()
        with Page() as page:
            opened = time.monotonic()
            page.open(address)
            page.wait(1.0)  # a page has no picture while it is opened
            before, first, seen = 0, 0.0, b""
            while time.monotonic() - opened < _LONGEST:
                taken = time.monotonic()
                seen = page.picture()
                now = colourful(seen)
                if before >= _DRAWN and abs(now - before) < 0.2 * before:
                    break
                before, first = now, taken
                page.wait(1.0)
            else:
                raise SystemExit(f"The view was not shown within {_LONGEST:g} s.")
            if picture is not None:
                picture.write_bytes(seen)
            # without internet the map tiles are missing, and Chromium reports this
            problems = [problem for problem in page.problems if not re.search(r"tile\.openstreetmap\.org", problem)]
            return first - started, first - opened, problems
    finally:
        server.terminate()
        server.wait(20.0)
        server.stdout.close()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--picture", type=Path, help="keep the last picture")
    arguments = parser.parse_args()
    if CHROMIUM is None:
        print("There is no Chromium on this machine.")
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "run"
        command = [sys.executable, "-m", "sinssim", "run", "first_flight", "-o", str(folder)]
        subprocess.run(command, check=True, capture_output=True, env=environment())
        size = (folder / "recording.rrd").stat().st_size / 1e6
        for _ in range(arguments.repeat):
            whole, page, problems = shown(folder, arguments.picture)
            print(
                f"{size:.0f} MB: {page:.1f} s from opening the page, {whole:.1f} s with the browser's start; ", end=""
            )
            print("; ".join(problems) or "no messages on the console")


if __name__ == "__main__":
    main()
