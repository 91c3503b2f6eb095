"""The viewer's web page and the files of a run, served to this machine alone.

The page asks other machines for nothing but map tiles. It loads the recording as a file: Rerun's own server of recorded
data (version 0.41) keeps a processor core busy for as long as it runs, and a browser beside it waits.
"""

from __future__ import annotations

import contextlib
import http.client
import os
import re
import shutil
import threading
import urllib.request
from collections.abc import Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Self
from urllib.parse import quote

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


def without_other_machines(page: str) -> str:
    """Return the viewer's page such that it loads fonts, news and examples from nowhere and reports nothing.

    Args:
        page: HTML of the viewer's page.

    Returns:
        The same page; map tiles are still asked for.
    """
    page = _ELSEWHERE.sub("", page)
    return page.replace('<script src="re_viewer.js">', _QUIET + '<script src="re_viewer.js">', 1)


class PageServer:
    """Serves the page of Rerun's own web server, changed, and files to this machine; a context manager.

    Attributes:
        address: address of the page, which opens the files.
    """

    def __init__(self, port: int, inner: int, files: Sequence[Path]) -> None:
        """Listen on a port of this machine.

        Args:
            inner: port of Rerun's web server, on this machine.
            files: recordings and layouts that the page opens, with different names.

        Raises:
            OSError: the port is taken.
        """

        own = {f"/{_FOLDER}/{quote(file.name)}": file for file in files}
        page = f"http://127.0.0.1:{port}/"
        self.address = page + "?" + "&".join(f"url={quote(page.rstrip('/') + name, safe='')}" for name in own)

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                path = self.path.partition("?")[0]
                if re.sub(r":\d*$", "", self.headers.get("Host", "")).lower() not in _HOSTS:
                    # a page of another machine whose name was made to mean this one (DNS rebinding)
                    self.send_error(421, "Open the address that sinssim printed")
                    return
                with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # the browser was closed
                    if path in own:
                        _send(self, own[path])
                    else:
                        _answer(self, path, inner)

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


def _answer(handler: BaseHTTPRequestHandler, path: str, inner: int) -> None:
    """Answer a request by what Rerun's web server has."""
    try:
        with _OWN.open(f"http://127.0.0.1:{inner}{quote(path, safe='/%')}", timeout=60.0) as found:
            kind, body = found.headers.get("Content-Type", "application/octet-stream"), found.read()
    except (http.client.HTTPException, OSError):
        handler.send_error(404)
        return
    handler.send_response(200)
    handler.send_header("Content-Type", kind)
    if path in ("/", "/index.html"):
        body = without_other_machines(body.decode()).encode()
    else:
        handler.send_header("rerun-final-length", str(len(body)))  # the page shows its progress by it
    handler.send_header("Content-Length", str(len(body)))
    handler.end_headers()
    handler.wfile.write(body)
