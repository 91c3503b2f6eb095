"""The viewer's web page, served to this machine without asking other machines for anything but map tiles."""

from __future__ import annotations

import re
import threading
import urllib.error
import urllib.request
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Self

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
    """Serves the files of Rerun's own web server to this machine, with the page changed; a context manager."""

    def __init__(self, port: int, inner: int) -> None:
        """Listen on a port of this machine.

        Args:
            port: the port.
            inner: port of Rerun's web server, on this machine.

        Raises:
            OSError: the port is taken.
        """

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                _answer(self, inner)

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


def _answer(handler: BaseHTTPRequestHandler, inner: int) -> None:
    """Answer a request by what Rerun's web server has."""
    path = handler.path.partition("?")[0]
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{inner}{path}", timeout=60.0) as found:
            kind, body = found.headers.get("Content-Type", "application/octet-stream"), found.read()
    except (urllib.error.URLError, OSError):
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
