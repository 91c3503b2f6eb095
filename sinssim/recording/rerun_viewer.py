"""Rerun's viewer: a run in its window, on a web page of this machine alone, or as a picture without a screen.

The page asks other machines for nothing but map tiles. It loads the recording as a file: Rerun's own server of recorded
data (version 0.41) keeps a processor core busy for as long as it runs, and a browser beside it waits.
"""

from __future__ import annotations

import contextlib
import http.client
import os
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import IO, Any, Self, TypeVar
from urllib.parse import quote

from sinssim import __version__
from sinssim.errors import InputError, RunError
from sinssim.logs.stored_run import warn_of_version
from sinssim.recording.rerun_views import RunInfo, all_views
from sinssim.system.files import Draft, draft
from sinssim.system.process import interruptible

_ELSEWHERE = re.compile(r"\s*<link\b[^>]*https://fonts\.[^>]*>", re.DOTALL)
"""Fonts of another machine, which the page needs for its first words only."""

_QUIET = """<script>
      // no statistics, news or examples of Rerun: the run is shown without any of them
      const everywhere = window.fetch;
      window.fetch = (what, how) =>
        /^https:\\/\\/([a-z]+\\.)*(rerun\\.io|api\\.github\\.com)\\//.test(what.url ?? String(what))
          ? Promise.resolve(new Response(null, { status: 204 }))
          : everywhere(what, how);
    </script>
    """


_HOSTS = ("127.0.0.1", "localhost", "[::1]")
"""Names by which a browser on this machine, or behind a forwarded port, asks for the page."""
_OWN = urllib.request.build_opener(urllib.request.ProxyHandler({}))
"""Asks without a proxy, which `http_proxy` may name: what is asked for lies on this machine."""
_FOLDER = "files"
_PIECE = 1 << 20  # bytes sent together


def asks_this_machine(host: str | None) -> bool:
    """Return whether the header Host of a request names this machine: another machine can give its name this one's
    address (DNS rebinding)."""
    return re.sub(r":\d*$", "", host or "").lower() in _HOSTS


def without_other_machines(page: str) -> str:
    """Return the viewer's page such that it loads fonts, news and examples from nowhere and reports nothing; map tiles
    are still asked for."""
    page = _ELSEWHERE.sub("", page)
    return page.replace('<script src="re_viewer.js">', _QUIET + '<script src="re_viewer.js">', 1)


_AT = """<script>
      // puts the time cursor at an instant, until what the viewer tells has had it there for a second
      (() => {
        const request = Uint8Array.from(REQUEST), part = `,${PLACE},`;
        let times = 0, looks = 0;
        const look = async () => {
          const viewer = window._handle;
          if (viewer && `,${viewer.viewer_state()},`.includes(part)) times++;
          else if (viewer) await viewer.viewer_control(request).then(() => { times = 0; }, () => {});
          if (times < 3 && looks++ < 600) setTimeout(look, 400);
        };
        look();
      })();
    </script>
    """


def starting_at(page: str, moment: float) -> str:
    """Return the viewer's page such that it begins at an instant, s.

    The request is that of `ViewerClient.set_time` in Rerun 0.41: the fields 2, a timeline, 3, an instant in whole
    nanoseconds, and 5, paused, of the message 6. The viewer tells the instant in a field 4.
    """
    place, number = bytearray(b"\x08"), round(1e9 * moment) % 2**64
    while number > 127:
        place.append(number % 128 + 128)
        number //= 128
    place.append(number)
    name = _TIMELINE.encode()
    parts = bytes([0x12, len(name) + 2, 0x0A, len(name), *name, 0x1A, len(place), *place, 0x28, 1])
    script = _AT.replace("REQUEST", str([0x32, len(parts), *parts])).replace("PLACE", str([0x22, len(place), *place]))
    return page.replace("</head>", script + "</head>", 1)


class PageServer:
    """Serves the page of Rerun's own web server, changed, and files to this machine; a context manager.

    Attributes:
        address: address of the page, which opens the files.
    """

    def __init__(self, port: int, inner: int, files: Sequence[Path], time_s: float | None = None) -> None:
        """Listen on a port of this machine, for a page that opens files of different names, recordings and layouts,
        with the time cursor at an instant, s; `inner` is the port of Rerun's web server."""

        routes = {f"/{_FOLDER}/{quote(file.name)}": file for file in files}
        page = f"http://127.0.0.1:{port}/"
        self.address = page + "?" + "&".join(f"url={quote(page.rstrip('/') + name, safe='')}" for name in routes)

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                path = self.path.partition("?")[0]
                if not asks_this_machine(self.headers.get("Host")):
                    self.send_error(421, "Open the address that sinssim printed")
                    return
                with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # the browser was closed
                    if path in routes:
                        _send(self, routes[path])
                    else:
                        _answer(self, path, inner, time_s)

            def log_message(self, *_: object) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, name="page", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()


def _send(handler: BaseHTTPRequestHandler, file: Path) -> None:
    """Send a file as it is on the disk now."""
    try:
        opened = file.open("rb")
    except OSError as error:
        handler.send_error(404, error.strerror)
        return
    with opened:
        handler.send_response(200)
        handler.send_header("Content-Type", "application/octet-stream")
        handler.send_header("Content-Length", str(os.fstat(opened.fileno()).st_size))
        handler.send_header("Cache-Control", "no-store")
        handler.end_headers()
        shutil.copyfileobj(opened, handler.wfile, _PIECE)


def _answer(handler: BaseHTTPRequestHandler, path: str, inner: int, time_s: float | None) -> None:
    """Answer a request by what Rerun's web server has."""
    try:
        with _OWN.open(f"http://127.0.0.1:{inner}{quote(path, safe='/%')}", timeout=60.0) as response:
            kind, body = response.headers.get("Content-Type", "application/octet-stream"), response.read()
    except (http.client.HTTPException, OSError):
        handler.send_error(404)
        return
    handler.send_response(200)
    handler.send_header("Content-Type", kind)
    if path in ("/", "/index.html"):
        page = without_other_machines(body.decode())
        body = (page if time_s is None else starting_at(page, time_s)).encode()
    else:
        handler.send_header("rerun-final-length", str(len(body)))  # the page shows its progress by it
    handler.send_header("Content-Length", str(len(body)))
    handler.end_headers()
    handler.wfile.write(body)


RUN_ENTITY = "about/run"
"""Entity of the `RunInfo` in a recording."""

T = TypeVar("T")

_TIMELINE = "sim_time"
_TILES = re.compile(r"walkers|tile\.|XDG_RUNTIME_DIR")
"""Lines of the viewer's output about maps without internet and the session, which explain no failure."""
_START_SECONDS = 60.0
_SETTLED_SECONDS = 1.0
"""Time after which a viewer that runs has found a screen, s."""
_PICTURE_SECONDS = (30.0, 90.0, 180.0)
"""Longest time for a picture, s: a viewer that has stopped answering is replaced, and the next one has longer, for a
machine that is busy with other work. It takes 3 s on an idle one."""
_LOOK_SECONDS = 0.3
"""Time between two looks at the viewer, s."""


def find_recording(path: Path) -> Path:
    """Return the recording of a path."""
    if path.is_file():
        return path
    if (path / "recording.rrd").is_file():
        warn_of_version(path)
        return path / "recording.rrd"
    if (path / "summary.json").is_file() and (path / "scenario.toml").is_file():
        raise InputError(
            f"{path} is a run without a recording (its scenario.toml has recording.keep and recording.detail). Run it "
            "again with --keep all --recording light; its report.html, if it has one, opens in any browser."
        )
    what = "contains no recording.rrd" if path.is_dir() else "does not exist"
    raise InputError(f"{path} {what}; give a run directory, such as runs/first_flight, or an .rrd file.")


def find_run_info(recording: Path) -> RunInfo | None:
    """Return what views need to know about the run in a recording; None for a recording with its own layout, such as
    that of the ground study or of another program."""
    from rerun.chunk import RrdReader

    text = None
    try:
        # The last one counts: a run updates its description.
        for chunk in RrdReader(recording).stream().filter(content=f"/{RUN_ENTITY}"):
            batch = chunk.to_record_batch()
            for name in batch.schema.names:
                if name.endswith("TextDocument:text"):
                    text = batch.column(name)[-1].as_py()[0]
    except (OSError, ValueError, TypeError, KeyError, RuntimeError) as error:
        raise InputError(
            f"{recording} is not a recording by sinssim, or it is damaged ({error}); run its scenario again."
        ) from error
    try:
        return None if text is None else RunInfo.from_json(text)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(
            f"{recording} was made by another version of sinssim than {__version__}: its description of the run cannot "
            f"be used ({error}). Run the scenario.toml beside it again, or open it without a view: "
            f"rerun {recording}"
        ) from error


def open_viewer(path: Path, view: str | None = None, *, time_s: float | None = None) -> None:
    """Open a run in Rerun's own viewer, with a view (its name, or the path of its file) in front and the time cursor at
    an instant, s, by default the start; return when its window is closed."""
    port = None if time_s is None else _free_ports(1)[0]
    arguments = ["--port", str(port or "auto"), "--bind", "127.0.0.1"]
    with _files(path, view) as files, _Viewer([*arguments, *files]) as viewer:
        if port is not None and time_s is not None:
            viewer.wait_for_port(port)
            client, deadline = _client(port), time.monotonic() + _PICTURE_SECONDS[-1]
            viewer.until(lambda: _loaded(client, timed=True), deadline)
            viewer.until(lambda: _moved(client, time_s), deadline)
        if viewer.process.wait():
            raise viewer.failure()


class LiveViewer:
    """Rerun's own viewer, which shows a run while it is computed; a context manager that closes it.

    Attributes:
        address: of its server, on this machine.
        is_lost: whether it was closed, or had stopped answering, before the run was complete.
    """

    def __init__(self, arguments: Sequence[str] = ()) -> None:
        """Prepare it, with further arguments of its program."""
        (self._port,) = _free_ports(1)
        self._viewer = _Viewer(["--bind", "127.0.0.1", "--port", str(self._port), *arguments])
        self.address, self.is_lost = f"rerun+http://127.0.0.1:{self._port}/proxy", False

    def __enter__(self) -> Self:
        """Open its window; raise RunError if there is none after a second."""
        self._viewer.__enter__()
        try:
            self._viewer.wait_for_port(self._port)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._viewer.process.wait(_SETTLED_SECONDS)  # it listens before it looks for a screen
                raise self._viewer.failure()
        except BaseException:
            self._viewer.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._viewer.__exit__()

    def lost(self) -> None:
        """End it."""
        self.is_lost = True
        self._viewer.process.kill()

    def wait(self) -> None:
        """Wait until its window is closed, or for Ctrl-C."""
        with contextlib.suppress(KeyboardInterrupt):
            self._viewer.process.wait()


def serve(
    path: Path, view: str | None = None, *, time_s: float | None = None, ready: Callable[[str], None] | None = None
) -> None:
    """Serve a run to browsers on this machine only, until interrupted; view and time as for `open_viewer`. `ready` is
    called with the page's address once the server answers; by default the address is printed."""
    web, inner, unused = _free_ports(3)
    arguments = ["--serve-web", "--bind", "127.0.0.1", "--web-viewer-port", str(inner), "--port", str(unused)]
    with (
        contextlib.suppress(KeyboardInterrupt),
        # the server must not outlive the program; with a shell's `&`, SIGINT is ignored
        interruptible(signal.SIGTERM, signal.SIGINT),
        _files(path, view) as files,
        _Viewer(arguments) as viewer,
        PageServer(web, inner, [Path(file) for file in files], time_s) as server,
    ):
        viewer.wait_for_port(inner)
        if ready is None:
            print(f"Open {server.address}\nStop with Ctrl-C.", flush=True)
        else:
            ready(server.address)
        viewer.process.wait()
        raise viewer.failure()


def screenshot(
    path: Path,
    picture: Path,
    view: str | None = None,
    *,
    size: tuple[int, int] = (1600, 1000),
    time_s: float | None = None,
) -> None:
    """Save a picture of a run; no screen is needed. The view is as for `open_viewer`, the time cursor by default in the
    middle of the recorded time."""
    if not picture.absolute().parent.is_dir():
        raise InputError(f"the picture {picture} cannot be written: there is no folder {picture.absolute().parent}.")
    timed = _is_timed(find_recording(path))
    with _files(path, view, menu=False) as files:
        for seconds in _PICTURE_SECONDS:
            try:
                png = _picture_of(files, size, timed, time_s, seconds)
                break
            except RunError:
                if seconds == _PICTURE_SECONDS[-1]:
                    raise
    try:
        with draft(picture) as beside:
            beside.write_bytes(png)
    except OSError as error:
        raise InputError(f"the picture {picture} cannot be written: {error.strerror}.") from error


def _picture_of(
    files: Sequence[str], size: tuple[int, int], timed: bool, time_s: float | None, seconds: float
) -> bytes:
    """Return the picture of a viewer that shows all of its files, as soon as it does not change any more."""
    (port,) = _free_ports(1)
    arguments = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", f"{size[0]}x{size[1]}"]
    with _Viewer([*arguments, *files], quiet=True) as viewer:
        viewer.wait_for_port(port)
        client = _client(port)
        deadline = time.monotonic() + seconds
        viewer.until(lambda: _loaded(client, timed) and (len(files) == 1 or _laid_out(client)), deadline)
        moment = viewer.until(lambda: (_middle(client) if time_s is None else time_s,), deadline)[0]
        if moment is not None:
            viewer.until(lambda: _moved(client, moment), deadline)
        before = b""

        def settled() -> bool:
            """Return whether the picture is the one of the look before."""
            nonlocal before
            last, before = before, bytes(client.take_screenshot())
            return last == before

        viewer.until(settled, deadline)
        return before


def _client(port: int) -> Any:
    from rerun.experimental import ViewerClient

    return ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")


def _moved(client: Any, moment: float) -> bool:
    """Return whether the time cursor is at an instant, s; move it there if it is not."""
    recordings = client.get_state().recordings
    if any(r.current_time is not None and abs(1e-9 * r.current_time - moment) < 1e-3 for r in recordings):
        return True
    client.set_time(_TIMELINE, duration=moment, play_state="paused")
    return False


def _is_timed(recording: Path) -> bool:
    """Return whether a recording holds data that change with time."""
    from rerun.chunk import RrdReader

    try:
        return any(not chunk.is_static for chunk in RrdReader(recording).stream())
    except (OSError, RuntimeError) as error:
        raise InputError(f"{recording} is not a recording, or it is damaged ({error}).") from error


def _loaded(client: Any, timed: bool) -> bool:
    state = client.get_state()
    if state.loading or not state.recordings:
        return False
    return not timed or any(r.timelines and r.timelines[0].end is not None for r in state.recordings)


def _laid_out(client: Any) -> bool:
    """Return whether the viewer uses the layout of the second file, which hides the menu, instead of the recorded one.

    The viewer shows a recording as soon as it is loaded, on a busy machine still with the recorded layout.
    """
    panel = client.get_blueprint("recording").blueprint.get("/top_panel", {})
    return bool(panel.get("PanelBlueprint", {}).get("state") == "Hidden")


def _middle(client: Any) -> float | None:
    """Return the middle of the recorded time, s; None if nothing was recorded over `_TIMELINE`."""
    spans = [
        (t.start, t.end)
        for recording in client.get_state().recordings
        for t in recording.timelines
        if t.name == _TIMELINE and t.end is not None
    ]
    return 0.5e-9 * (min(start for start, _ in spans) + max(end for _, end in spans)) if spans else None


def _run_to_show(recording: Path, view: str | None) -> RunInfo | None:
    """Return what a view needs; None if none is requested and the recording does not say it."""
    try:
        run = find_run_info(recording)
    except InputError:
        if view is not None:
            raise
        return None
    if run is None and view is not None:
        raise InputError(
            f"{recording} does not describe a run (it has no {RUN_ENTITY}), so that the view {view!r} cannot be "
            "made of it; without --view it opens with the layout that it was recorded with."
        )
    return run


@contextlib.contextmanager
def _files(path: Path, view: str | None, *, menu: bool = True) -> Iterator[list[str]]:
    """Yield the files to open: the recording, and a file with its layout.

    A run's layout is recorded at its beginning, and again when all is known of the run. A viewer that has drawn the
    first one keeps it, but shows the layout of a second file in any case. A run with its own views keeps the recorded
    layout: their files, which may be another person's, are not executed here.
    """
    recording = find_recording(path)
    run = _run_to_show(recording, view)
    if run is None or (run.views and view is None):
        yield [str(recording)]
        return
    layout = all_views(replace(run, views=()), view, menu=menu)
    with Draft() as folder:
        file = folder.path / "view.rbl"
        layout.save(run.application, file)
        yield [str(recording), str(file)]


def _free_ports(count: int) -> list[int]:
    """Return ports that are free at the moment."""
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for s in sockets:
            s.bind(("127.0.0.1", 0))
        return [s.getsockname()[1] for s in sockets]


@dataclass
class _Viewer:
    """Rerun's own binary as a child that ends with the block (the `rerun` script would leave its child behind)."""

    arguments: Sequence[str]
    quiet: bool = False
    """Whether it logs nothing: what it logs also covers the picture as notices."""

    def __enter__(self) -> _Viewer:
        import rerun_cli  # type: ignore[import-untyped]

        binary = Path(rerun_cli.__file__).parent / ("rerun.exe" if os.name == "nt" else "rerun")
        quiet = {"RUST_LOG": "off"} if self.quiet else {}
        self._output: IO[bytes] = tempfile.TemporaryFile()
        # The viewer makes a temporary folder and leaves it behind when a signal ends it.
        self._folder = Draft()
        self.process = subprocess.Popen(
            [str(binary), *self.arguments],
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=self._output,
            env={**os.environ, "NO_COLOR": "1", "TMPDIR": str(self._folder.path), **quiet},
        )
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        try:
            self.process.wait(5.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._folder.close()
        self._output.close()

    def wait_for_port(self, port: int) -> None:
        """Wait until the child listens on a port."""
        deadline = time.monotonic() + _START_SECONDS
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1.0):
                return
            self.check(deadline)
            time.sleep(0.05)

    def check(self, deadline: float) -> None:
        """Raise if the child has ended or the deadline has passed."""
        if self.process.poll() is not None or time.monotonic() > deadline:
            raise self.failure()

    def until(self, done: Callable[[], T], deadline: float) -> T:
        """Return the first answer of the child that is true, until a deadline as for `check`; a busy one may leave
        questions unanswered."""
        while True:
            with contextlib.suppress(OSError, RuntimeError):
                if answer := done():
                    return answer
            self.check(deadline)
            time.sleep(_LOOK_SECONDS)

    def failure(self) -> RunError:
        """Return an error with the child's last output."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(2.0)
        self._output.seek(0)
        output = self._output.read().decode(errors="replace")
        if "graphics adapter" in output.lower() or "render context" in output:
            return RunError(
                "Rerun's viewer found no graphics driver (Vulkan) to draw with. On a machine without a graphics "
                "card, install a software renderer, on Debian and Ubuntu: apt-get install mesa-vulkan-drivers "
                "libvulkan1. Or show the run in a browser: sinssim view RUN --web."
            )
        if "EventLoopError" in output:
            return RunError(
                "Rerun's viewer found no screen to open its window on. Show the run in a browser, sinssim view RUN "
                "--web, or save a picture of it, sinssim view RUN --screenshot FILE."
            )
        plain = re.sub(r"\x1b\[[0-9;]*m", "", output)
        lines = [line.strip() for line in plain.splitlines() if line.strip() and not _TILES.search(line)]
        ending = self.process.poll()
        how = "does not answer" if ending is None else f"ended with code {ending}"
        return RunError(f"Rerun's viewer {how}. Its last output: {' / '.join(lines[-3:]) or 'none'}")
