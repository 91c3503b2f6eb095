"""The server of the viewer's page: it answers this machine alone, and asks nobody else."""

from __future__ import annotations

import http.client
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from sinssim.recording.rerun_viewer import PageServer, _free_ports

SECRET = b"the recording"


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """The port of a server, before another one that stands for Rerun's."""
    file = tmp_path_factory.mktemp("page") / "a run \u00e9.rrd"

    class Rerun(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200 if self.path == "/" else 404)
            self.end_headers()
            self.wfile.write(b"Rerun's page")

        def log_message(self, *_: object) -> None:
            pass

    file.write_bytes(SECRET)
    inner = HTTPServer(("127.0.0.1", 0), Rerun)
    threading.Thread(target=inner.serve_forever, daemon=True).start()
    (free,) = _free_ports(1)
    with PageServer(free, inner.server_address[1], [file]):
        yield free
    inner.shutdown()
    inner.server_close()


def ask(port: int, path: str, host: str | None) -> tuple[int, bytes]:
    """Return the status and the body of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20.0)
    connection.putrequest("GET", "/", skip_host=True)
    connection._buffer[0] = f"GET {path} HTTP/1.1".encode("latin-1")  # type: ignore[attr-defined]
    if host is not None:
        connection.putheader("Host", host)
    connection.endheaders()
    with connection.getresponse() as answer:
        return answer.status, answer.read()


FILE = "/files/a%20run%20%C3%A9.rrd"


@pytest.mark.parametrize(
    "host", ["127.0.0.1:{port}", "localhost:{port}", "LocalHost", "[::1]:{port}", "localhost:8000"]
)
def test_this_machine_is_answered(port: int, host: str) -> None:
    assert ask(port, FILE, host.format(port=port)) == (200, SECRET)
    assert ask(port, "/", host.format(port=port))[0] == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1.evil.example", "localhost.evil.example:{port}", "", None,
             "[::1]:{port}.evil.example", "evil.example:1@127.0.0.1"],
)  # fmt: skip
def test_another_name_of_this_machine_is_refused(port: int, host: str | None) -> None:
    """A page of another machine cannot read the recording by a name of its own that leads here."""
    for path in (FILE, "/"):
        status, body = ask(port, path, None if host is None else host.format(port=port))
        assert status == 421
        assert SECRET not in body
        assert b"Rerun's page" not in body


def test_no_proxy_is_asked_for_the_page(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("http_proxy", "HTTP_PROXY", "all_proxy"):
        monkeypatch.setenv(name, f"http://127.0.0.1:{_free_ports(1)[0]}")
    for name in ("no_proxy", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)
    assert ask(port, "/", "localhost") == (200, b"Rerun's page")


@pytest.mark.parametrize(
    "path", ["/\u00e9", "/%C3%A9", "/\x7f\x01", "//evil.example/", "/%", "*", "http://evil.example/"]
)
def test_odd_paths_are_not_found(port: int, path: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert ask(port, path, "localhost")[0] == 404
    assert "Traceback" not in capfd.readouterr().err
