"""Opening a run: what is served, to whom, what is left behind, and what is said where it cannot be drawn."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import parse_qs, urlsplit

import psutil
import pytest
import rerun_cli
from rerun.experimental import ViewerClient

from sinssim.errors import InputError, RunError
from sinssim.experiments.run.run_execution import run
from sinssim.recording import rerun_viewer
from sinssim.recording.rerun_viewer import without_other_machines
from tests.fork import Fork
from tests.recording import fake_run
from tests.slow import slow


@pytest.fixture(scope="module")
def directory(tmp_path_factory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        fake_run.install(3000, patch.setattr)
        return run(fake_run.scenario(), tmp_path_factory.mktemp("viewer") / "run").directory


@pytest.mark.parametrize("how", [signal.SIGINT, *slow(signal.SIGTERM)])
def test_web_serves_this_machine_only_and_leaves_no_process(directory, how):
    server = Fork(lambda: rerun_viewer.serve(directory))
    children = []
    try:
        address = server.stdout.readline().decode().removeprefix("Open ").strip()
        page = address.split("?")[0]
        assert page.startswith("http://127.0.0.1:")
        assert b"web viewer" in urllib.request.urlopen(page, timeout=10.0).read()
        children = psutil.Process(server.pid).children(recursive=True)
        processes = [psutil.Process(server.pid), *children]
        listening = [c for p in processes for c in p.net_connections("tcp") if c.status == psutil.CONN_LISTEN]
        assert {c.laddr.ip for c in listening} == {"127.0.0.1"}
        assert page.removeprefix("http://").strip("/") in {f"127.0.0.1:{c.laddr.port}" for c in listening}
        files = parse_qs(urlsplit(address).query)["url"]
        assert [Path(file).name for file in files] == ["recording.rrd", "view.rbl"]
        assert all(file.startswith(page) for file in files)
        assert urllib.request.urlopen(files[0], timeout=10.0).read() == (directory / "recording.rrd").read_bytes()
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(f"{page}files/summary.json", timeout=10.0)
        assert len(listening) == 3  # and the server that has the viewer's page
    finally:
        server.kill(how)
        server.wait()
    assert server.returncode == 0
    assert children
    assert not any(child.is_running() for child in children)


@pytest.fixture
def broken_viewer(tmp_path, monkeypatch):
    """Put a program in the viewer's place that says something and ends."""

    def install(said: str) -> None:
        program = tmp_path / "rerun"
        program.write_text(f"#!/bin/sh\necho '{said}' >&2\nexit 101\n")
        program.chmod(0o755)
        monkeypatch.setattr(rerun_cli, "__file__", str(tmp_path / "__init__.py"))

    return install


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ("thread main panicked at Failed to get render context", "apt-get install mesa-vulkan-drivers"),
        ("Error: winit EventLoopError: neither WAYLAND_DISPLAY nor DISPLAY is set", "--web"),
        ("\033[33mWARN\033[0m walkers::io::fetch: tile\n\033[1mbad\033[0m file", "Its last output: bad file"),
        *slow(
            ("No graphics adapter was found", "apt-get install mesa-vulkan-drivers"),
            ("something else", "ended with code 101. Its last output: something else"),
        ),
    ],
)
def test_a_viewer_that_cannot_draw_is_explained(directory, broken_viewer, said, expected):
    broken_viewer(said)
    with pytest.raises(RunError, match="Rerun's viewer") as shown:
        rerun_viewer.open_viewer(directory)
    assert expected in str(shown.value)
    with pytest.raises(RunError) as saved:
        rerun_viewer.screenshot(directory, directory / "picture.png")
    assert expected in str(saved.value)
    assert not (directory / "picture.png").exists()


def test_a_picture_without_a_folder_is_refused_before_anything_is_opened(directory, broken_viewer):
    broken_viewer("must not be started")
    with pytest.raises(InputError, match="there is no folder"):
        rerun_viewer.screenshot(directory, directory / "nowhere" / "picture.png")


@pytest.fixture(params=["timed", "static", "frames"])
def foreign(request, tmp_path) -> Path:
    """A valid recording that describes no run: over the usual time, without any time, over a time of its own."""
    import rerun as rr

    file = tmp_path / "foreign.rrd"
    recording = rr.RecordingStream("foreign")
    recording.save(file)
    recording.log("note", rr.TextDocument("hello"), static=True)
    for k in range(5 if request.param != "static" else 0):
        if request.param == "timed":
            recording.set_time("sim_time", duration=float(k))
        else:
            recording.set_time("frame", sequence=k)
        recording.log("value", rr.Scalars(float(k)))
    recording.flush()
    recording.disconnect()
    return file


def test_a_recording_that_describes_no_run_opens_as_it_was_recorded(foreign, tmp_path, broken_viewer):
    assert rerun_viewer.find_run_info(foreign) is None
    with pytest.raises(InputError, match=r"does not describe a run .* the view 'navigation' cannot be made of it"):
        rerun_viewer.open_viewer(foreign, "navigation")
    with pytest.raises(InputError, match="without --view"):
        rerun_viewer.screenshot(foreign, tmp_path / "picture.png", "navigation")
    broken_viewer("started")  # so it is opened, in a window and for a picture
    for look in (
        lambda: rerun_viewer.open_viewer(foreign),
        lambda: rerun_viewer.screenshot(foreign, tmp_path / "picture.png"),
    ):
        with pytest.raises(RunError, match="Its last output: started"):
            look()


@pytest.mark.slow
def test_a_recording_that_describes_no_run_makes_a_picture(foreign, tmp_path):
    rerun_viewer.screenshot(foreign, tmp_path / "picture.png", size=(640, 400))
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")


def test_what_is_no_recording_makes_no_picture(tmp_path, broken_viewer):
    broken_viewer("must not be started")
    (tmp_path / "notes.rrd").write_text("# notes")
    with pytest.raises(InputError, match="is not a recording"):
        rerun_viewer.screenshot(tmp_path / "notes.rrd", tmp_path / "picture.png")


def test_a_picture_waits_for_the_layout_that_was_asked_for(directory, tmp_path, monkeypatch):
    """A busy viewer leaves questions unanswered, shows the recorded layout first, and draws its own by and by."""
    timeline = SimpleNamespace(name="sim_time", start=0, end=10**9)
    shown = SimpleNamespace(timelines=[timeline], current_time=0)
    state = SimpleNamespace(loading=[], recordings=[shown])

    class Client:
        looks, questions, drawn = 0, 0, [b"notices", b"half", b"whole", b"whole", b"never looked at"]

        def get_state(self):
            self.questions += 1
            if self.questions % 2:
                raise RuntimeError("the viewer did not answer within 15 s")
            return state

        def get_blueprint(self, of):
            assert of == "recording"
            self.looks += 1
            panel = {"PanelBlueprint": {"state": "Expanded" if self.looks < 3 else "Hidden"}}
            return SimpleNamespace(blueprint={"/top_panel": panel} if self.looks > 1 else {})

        def set_time(self, timeline, *, duration, play_state):
            assert (timeline, duration, play_state) == ("sim_time", 0.5, "paused")
            shown.current_time = int(duration * 1e9)

        def take_screenshot(self):
            assert self.looks == 3
            assert shown.current_time == 5 * 10**8
            return self.drawn.pop(0)

    class Viewer:
        until = rerun_viewer._Viewer.until

        def __init__(self, arguments, quiet):
            assert quiet
            assert len([a for a in arguments if a.endswith((".rrd", ".rbl"))]) == 2

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def wait_for_port(self, port):
            pass

        def check(self, deadline):
            pass

    monkeypatch.setattr(ViewerClient, "connect", lambda url: Client())
    monkeypatch.setattr(rerun_viewer, "_Viewer", Viewer)
    monkeypatch.setattr(rerun_viewer, "_LOOK_SECONDS", 0.0)
    rerun_viewer.screenshot(directory, tmp_path / "picture.png", "navigation")
    assert (tmp_path / "picture.png").read_bytes() == b"whole"


def test_the_window_begins_at_a_time(directory, monkeypatch):
    """The viewer is asked until the recording is loaded and its cursor is there."""
    from rerun.experimental import ViewerClient

    cursor = SimpleNamespace(current_time=None, timelines=[SimpleNamespace(name="sim_time", start=0, end=10**9)])
    states = [SimpleNamespace(loading=True, recordings=[]), *[SimpleNamespace(loading=False, recordings=[cursor])] * 9]

    class Client:
        def get_state(self):
            return states.pop(0)

        def set_time(self, timeline, *, duration, play_state):
            assert (timeline, play_state) == ("sim_time", "paused")
            cursor.current_time = int(duration * 1e9)

    class Viewer(rerun_viewer._Viewer):
        def __enter__(self):
            self.process = SimpleNamespace(wait=lambda: 0, poll=lambda: None)
            assert self.arguments[1] == asked[0]
            return self

        def __exit__(self, *_):
            pass

        def wait_for_port(self, port):
            assert port == 4321

    asked = ["4321"]
    monkeypatch.setattr(rerun_viewer, "_free_ports", lambda count: [4321])
    monkeypatch.setattr(ViewerClient, "connect", lambda url: Client())
    monkeypatch.setattr(rerun_viewer, "_Viewer", Viewer)
    monkeypatch.setattr(rerun_viewer, "_LOOK_SECONDS", 0.0)
    rerun_viewer.open_viewer(directory, time_s=0.25)
    assert cursor.current_time == 250_000_000
    asked[0] = "auto"
    rerun_viewer.open_viewer(directory)
    assert cursor.current_time == 250_000_000


@pytest.mark.slow
@pytest.mark.parametrize("view", ["flight", "navigation", "sensors"])
def test_every_view_makes_a_picture(directory, tmp_path, view, monkeypatch):
    from matplotlib.image import imread

    monkeypatch.setenv("TMPDIR", str(tmp_path))  # nothing may be left there
    monkeypatch.setattr(tempfile, "tempdir", None)
    begin = time.monotonic()
    rerun_viewer.screenshot(directory, tmp_path / "picture.png", view, size=(1280, 800))
    picture = imread(tmp_path / "picture.png")
    assert picture.shape[:2] == (800, 1280)
    assert len({tuple(pixel) for pixel in picture[::8, ::8].reshape(-1, picture.shape[2])}) > 30
    assert time.monotonic() - begin < 60.0
    assert os.listdir(tmp_path) == ["picture.png"]


def test_a_run_without_a_recording_is_refused_by_its_reason(tmp_path, monkeypatch):
    fake_run.install(300, monkeypatch.setattr)
    made = run(fake_run.scenario(keep="report"), tmp_path / "run").directory
    with pytest.raises(InputError, match=r"is a run without a recording .* --keep all --recording light"):
        rerun_viewer.find_recording(made)


def test_a_recording_of_another_version_is_refused_by_its_version(directory, monkeypatch):
    def older(text: str) -> None:
        raise TypeError("RunInfo.__init__() got an unexpected keyword argument 'sensors'")

    monkeypatch.setattr(rerun_viewer.RunInfo, "from_json", older)
    with pytest.raises(InputError, match=r"made by another version of sinssim than .*unexpected keyword argument"):
        rerun_viewer.find_run_info(directory / "recording.rrd")


def test_the_web_page_asks_no_other_machine_but_for_map_tiles():
    page = """<link rel="icon" href="favicon.ico" /><link
      href="https://fonts.googleapis.com/css2?family=Inter" rel="stylesheet" /><script src="re_viewer.js"></script>"""
    found = without_other_machines(page)
    assert "fonts" not in found
    assert "favicon.ico" in found
    assert found.index("window.fetch =") < found.index("re_viewer.js")


def test_the_web_page_starts_at_an_instant():
    """The request for 100 s is, byte by byte, what Rerun's own client sends; a negative number has ten bytes."""
    asked = bytes.fromhex("3217120a0a0873696d5f74696d651a070880d0dbc3f4022801")
    found = rerun_viewer.starting_at("<head></head><body>", 100.0)
    assert f"Uint8Array.from({list(asked)})" in found
    assert found.index("viewer_control") < found.index("</head><body>")
    assert "[34, 11, 8, 255, 255, 255, 255, 255, 255, 255, 255, 255, 1]" in rerun_viewer.starting_at("</head>", -1e-9)


def client(*recordings: Any, loading: bool = False, moved: list[Any] | None = None, layout: Any = None) -> Any:
    """Return a stand-in for what a viewer tells of itself."""
    return SimpleNamespace(
        get_state=lambda: SimpleNamespace(recordings=recordings, loading=loading),
        set_time=lambda *given, **more: moved.append((given, more)) if moved is not None else None,
        get_blueprint=lambda name: SimpleNamespace(blueprint=layout if name == "recording" else {}),
    )


def shown(*timelines: tuple[str, int | None, int | None], now: int | None = None) -> Any:
    lines = [SimpleNamespace(name=name, start=start, end=end) for name, start, end in timelines]
    return SimpleNamespace(timelines=lines, current_time=now)


def test_the_middle_of_the_recorded_time() -> None:
    """From the earliest start, 40 s, to the latest end, 90 s; other timelines and open ends do not count."""
    one = shown((rerun_viewer._TIMELINE, 50 * 10**9, 90 * 10**9), ("log_time", 0, 10**18))
    two = shown((rerun_viewer._TIMELINE, 40 * 10**9, 70 * 10**9), (rerun_viewer._TIMELINE, 0, None))
    assert rerun_viewer._middle(client(one, two)) == pytest.approx(65.0)
    assert rerun_viewer._middle(client(shown(("log_time", 0, 10**9)))) is None


def test_the_cursor_is_moved_once() -> None:
    """It is there within a millisecond; else it is moved and paused, to be looked at again."""
    moved: list[Any] = []
    assert rerun_viewer._moved(client(shown(now=None), shown(now=65 * 10**9 + 900_000), moved=moved), 65.0)
    assert not rerun_viewer._moved(client(shown(now=65 * 10**9 + 1_100_000), moved=moved), 65.0)
    assert moved == [((rerun_viewer._TIMELINE,), {"duration": 65.0, "play_state": "paused"})]


def test_a_viewer_that_has_loaded() -> None:
    ready = shown((rerun_viewer._TIMELINE, 0, 5))
    assert rerun_viewer._loaded(client(ready), True)
    assert not rerun_viewer._loaded(client(ready, loading=True), True)
    assert not rerun_viewer._loaded(client(), False)
    assert rerun_viewer._loaded(client(shown()), False)
    assert not rerun_viewer._loaded(client(shown((rerun_viewer._TIMELINE, 0, None))), True)
    panel = {"/top_panel": {"PanelBlueprint": {"state": "Hidden"}}}
    assert rerun_viewer._laid_out(client(layout=panel))
    assert not rerun_viewer._laid_out(client(layout={"/top_panel": {"PanelBlueprint": {"state": "Collapsed"}}}))
    assert not rerun_viewer._laid_out(client(layout={}))


class Handler:
    """Keeps what is sent to a browser."""

    def __init__(self) -> None:
        self.status, self.headers, self.wfile = 0, dict[str, str](), io.BytesIO()

    def send_response(self, status: int) -> None:
        self.status = status

    def send_error(self, status: int, *why: str) -> None:
        self.status = status

    def send_header(self, name: str, value: str) -> None:
        self.headers[name] = value

    def end_headers(self) -> None: ...


def test_what_the_server_of_the_page_hands_on(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The page asks no other machine; of a file it is told the length; what is not there is not found."""
    asked: list[Any] = []

    def opened(address: str, timeout: float) -> Any:
        asked.append((address, timeout))
        if "none" in address:
            raise OSError
        answer = SimpleNamespace(headers={"Content-Type": "text/wasm"}, read=lambda: b"four")
        return contextlib.nullcontext(answer)

    monkeypatch.setattr(rerun_viewer, "_OWN", SimpleNamespace(open=opened))
    monkeypatch.setattr(rerun_viewer, "without_other_machines", lambda page: f"{page} alone")
    sent = [Handler() for _ in range(5)]
    for handler, path in zip(sent, ("/", "/a b.wasm", "/none"), strict=False):
        rerun_viewer._answer(handler, path, 1234, None)  # type: ignore[arg-type]
    assert asked == [(f"http://127.0.0.1:1234{path}", 60.0) for path in ("/", "/a%20b.wasm", "/none")]
    (tmp_path / "run.rrd").write_bytes(b"sixsix")
    rerun_viewer._send(sent[3], tmp_path / "run.rrd")  # type: ignore[arg-type]
    rerun_viewer._send(sent[4], tmp_path / "none")  # type: ignore[arg-type]
    assert [handler.status for handler in sent] == [200, 200, 404, 200, 404]
    assert [handler.wfile.getvalue() for handler in sent] == [b"four alone", b"four", b"", b"sixsix", b""]
    assert [handler.headers for handler in sent] == [
        {"Content-Type": "text/wasm", "Content-Length": "10"},
        {"Content-Type": "text/wasm", "rerun-final-length": "4", "Content-Length": "4"},
        {},
        {"Content-Type": "application/octet-stream", "Content-Length": "6", "Cache-Control": "no-store"},
        {},
    ]
