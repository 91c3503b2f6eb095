"""A workbench that answers on a port of this machine, and a browser's requests."""

from __future__ import annotations

import http.client
import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from sinssim.cli.workbench_commands import Children
from sinssim.cli.workbench_server import Workbench, server_of


class Answer(NamedTuple):
    """What the server has answered."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class Served(NamedTuple):
    """A workbench that is served."""

    workbench: Workbench
    children: Children
    port: int

    def ask(self, path: str, body: Any = None, *, token: str | None = None, **headers: str) -> Answer:
        """Return the answer to a request as the page makes it; a header's name has underscores for hyphens.

        A header "" is left out.
        """
        own = f"127.0.0.1:{self.port}"
        sent = {"Host": own} | ({} if body is None else {"Origin": f"http://{own}", "Content-Type": "application/json"})
        sent |= {name.replace("_", "-"): value for name, value in headers.items()}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20.0)
        address = f"/{self.workbench.token if token is None else token}/{path}"
        connection.putrequest("GET" if body is None else "POST", address, skip_host=True)
        content = b"" if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
        for name, value in {**sent, "Content-Length": str(len(content))}.items():
            if value:
                connection.putheader(name, value)
        connection.endheaders(content)
        with connection.getresponse() as answer:
            return Answer(answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read())


@contextmanager
def served(folder: Path) -> Iterator[Served]:
    """Serve the workbench of a folder, which is the current one meanwhile."""
    with pytest.MonkeyPatch.context() as patch, socket.socket() as listening, Children(folder) as children:
        patch.chdir(folder)
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        workbench = Workbench(folder, children)
        server = server_of(workbench)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        try:
            yield Served(workbench, children, listening.getsockname()[1])
        finally:
            server.should_exit = True
            thread.join(20.0)
