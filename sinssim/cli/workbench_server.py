"""The server of the workbench: its page, what the page asks for, and who may ask.

It answers this machine alone, at addresses with a token, and changes something only for its own page. Everything it
makes is a file that the commands make too; it knows the commands that it started, and nothing else.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import re
import secrets
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from sinssim.cli.workbench_commands import OF_TEXTS, Children, arguments_of
from sinssim.content import list_content
from sinssim.errors import InputError, SinssimError, shortened
from sinssim.recording.rerun_viewer import asks_this_machine
from sinssim.system.files import MARK, read_bytes, read_text, write_text
from sinssim.system.process import interruptible

if TYPE_CHECKING:
    import uvicorn
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response

INSTALL = "pip install 'sinssim[workbench]'"
_DEPTH, _MOST_FILES = 3, 2000  # of the search for scenarios: levels below the folder, folders that are looked into
_MOST_BYTES = 4_000_000  # of a request
_MOST_CHARACTERS = 1_000_000  # of a scenario
_SCENARIO = re.compile(
    r"^\s*(?:\[\s*)?(?:flight|parked|great_circle|motion|track|drive|voyage|turntable|log|one_component)\s*[].=]", re.M
)
"""What the text of a scenario has: the table of its source."""
_STUDY = re.compile(r"^\s*\[\[\s*(?:parts|axes)\s*\]\]", re.M)
"""What the text of a study has."""
_CONTENT: tuple[Literal["scenarios"], Literal["studies"]] = "scenarios", "studies"
_TEXTS = "scenario.toml", "study.toml"  # of a finished result
_SHOWN = {
    ".html": "text/html", ".svg": "image/svg+xml", ".png": "image/png", ".json": "text/plain", ".toml": "text/plain",
    ".md": "text/plain", ".csv": "text/plain",
}  # fmt: skip
"""Files of a finished run that a browser shows."""
_ALONE = (
    "sandbox allow-scripts allow-downloads allow-popups; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Policy for files of a folder, which may be another person's: their scripts reach nothing, not even the workbench."""
_HEADERS = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin", "Cross-Origin-Opener-Policy": "same-origin",
            "Content-Security-Policy": "frame-ancestors 'none'"}  # fmt: skip


class _ChangedError(InputError):
    """The file on the disk is not the one that was opened."""


class Workbench:
    """What the page asks for, in a folder.

    Attributes:
        folder: the folder; its runs are in `runs` there.
        token: part of each address.
    """

    def __init__(self, folder: Path, children: Children) -> None:
        """Take a folder and the commands that run in it."""
        self.folder, self._children, self.token = folder.resolve(), children, secrets.token_urlsafe(24)
        self._saving = threading.Lock()

    def scenarios(self, _: dict[str, Any]) -> dict[str, Any]:
        """Return the scenarios and studies of the folder and the shipped ones."""
        listed = [(path, False, study) for path, study in self._scenarios()]
        for kind in _CONTENT:
            files = list_content(kind).items()
            listed += [(name, True, kind == "studies") for name, file in files if self.folder not in file.parents]
        scenarios = [{"path": path, "shipped": shipped, "study": study} for path, shipped, study in listed]
        return {"folder": str(self.folder), "scenarios": scenarios}

    def runs(self, _: dict[str, Any]) -> dict[str, Any]:
        """Return what has finished."""
        from sinssim.experiments.run.finished_runs import runs_in

        place = self.folder / "runs"
        return {
            "runs": [
                {"path": entry.path.relative_to(self.folder).as_posix(), "kind": entry.kind, "status": entry.status,
                 "scenario": entry.scenario, "solution": entry.solution, "error_m": entry.rms_horizontal_error_m,
                 "bytes": entry.size_bytes, "date": f"{entry.date:%Y-%m-%d %H:%M}", "problem": entry.problem,
                 "report": (entry.path / "report.html").is_file(), "view": (entry.path / "recording.rrd").is_file(),
                 "text": next((name for name in _TEXTS if (entry.path / name).is_file()), "")}
                for entry in (runs_in(place) if place.is_dir() and not place.is_symlink() else ())
            ]
        }  # fmt: skip

    def _scenarios(self) -> Iterator[tuple[str, bool]]:
        """Yield the paths of scenarios and studies in the folder, without those of finished runs, and which are
        studies."""
        levels = [[self.folder]]
        for _ in range(_DEPTH + 1):
            levels.append([])
            for place in levels[-2][:_MOST_FILES]:
                with suppress(OSError):
                    for entry in sorted(os.scandir(place), key=lambda entry: entry.name):
                        if entry.name.startswith(".") or entry.is_symlink():
                            continue
                        path = Path(entry.path)
                        if entry.is_dir():
                            if not (path / MARK).is_file():
                                levels[-1].append(path)
                        elif path.suffix == ".toml" and (kind := _kind_of(path)):
                            yield path.relative_to(self.folder).as_posix(), kind is _STUDY

    def scenario(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Return the text of a scenario, and the digest by which `save` knows it again."""
        contents = read_bytes(self._file(asked))
        return {"text": contents.decode().replace("\r\n", "\n"), "digest": _digest(contents)}

    def check(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Return the mistakes and the plan of a text, of its file by a `sinssim check` that has ended."""
        from sinssim.cli.workbench_scenario import checked_text, found_by_command

        number = asked.get("number")
        if not isinstance(number, int):
            return checked_text(_text(asked), self._file(asked))
        child = self._children[number]
        return found_by_command("\n".join(child.lines), child.code or 0, str(asked.get("path")), _text(asked))

    def plan(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Return the plan of a text as HTML of a width, px."""
        from sinssim.cli.workbench_scenario import plan_html

        width = asked.get("width")
        if not isinstance(width, int | float) or not 200.0 <= width <= 4000.0:
            raise InputError("the width of a plan is a number from 200 to 4000.")
        return {"html": plan_html(_text(asked), self._file(asked), min(max(width, 440.0), 700.0))}

    def save(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Write a scenario of the folder, unless its file is not the one that was opened."""
        path, text, known = asked.get("path"), _text(asked), asked.get("digest")
        file = self._inside(path)
        if file.suffix != ".toml" or file.name.startswith("."):
            raise InputError(f"the name {shortened(str(path))} must end in .toml.")
        if any((place / MARK).is_file() for place in file.parents if place != self.folder):
            raise InputError(f"{path} is part of a finished result, and stays as it is; save it under another name.")
        with self._saving:
            before = read_bytes(file) if file.exists() else None
            if known != ("" if before is None else _digest(before)):
                what = "was changed by another program since you opened it" if known else "exists already"
                raise _ChangedError(f"{path} {what}. Nothing was written.")
            try:
                file.parent.mkdir(parents=True, exist_ok=True)
                text = text.replace("\n", "\r\n") if b"\r\n" in (before or b"") else text
                write_text(file, text)
            except OSError as error:
                raise InputError(f"{path} cannot be written: {error.strerror}.") from error
        return {"digest": _digest(text.encode())}

    def start(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Start a command."""
        command = arguments_of(asked)
        for path in asked["paths"]:
            if command[0] in OF_TEXTS:
                self._file({"path": path})
            elif not self._inside(path).is_dir():
                raise InputError(f"there is no result {shortened(path)}.")
        return self._children.start(command).to_json()

    def cancel(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Interrupt a command."""
        number = asked.get("number")
        self._children.cancel(number if isinstance(number, int) else 0)
        return {}

    def commands(self, _: dict[str, Any]) -> dict[str, Any]:
        """Return the commands that run, and those that have ended."""
        return {"commands": [child.to_json() for child in self._children]}

    def keys(self, _: dict[str, Any]) -> dict[str, Any]:
        """Return the keys that a scenario may have."""
        return {"tables": _tables()}

    def shown(self, path: str) -> tuple[Path, str]:
        """Return a file of a finished run, and its type for the browser."""
        file = self._inside(path)
        if not any((place / MARK).is_file() for place in file.parents if self.folder in place.parents):
            raise InputError(f"{shortened(path)} is no file of a finished result.")
        if file.name.startswith(".") or file.suffix not in _SHOWN or not file.is_file():
            raise InputError(f"{shortened(path)} is no file that the workbench shows.")
        return file, _SHOWN[file.suffix]

    def _file(self, asked: dict[str, Any]) -> Path:
        """Return the file of a scenario: a path in the folder, or the name of a shipped one."""
        path = asked.get("path")
        if isinstance(path, str) and not path.endswith(".toml"):
            file = next((files[path] for kind in _CONTENT if path in (files := list_content(kind))), None)
            if file is None or self.folder in file.parents:
                raise InputError(f"there is no shipped scenario or study {shortened(path)!r}.")
            return file
        return self._inside(path)

    def _inside(self, path: object) -> Path:
        """Return the place of a path in the folder; raise for one that leads out of it."""
        if not isinstance(path, str) or not path or "\0" in path or len(path) > 1000:
            raise InputError("give a path in the folder.")
        try:
            place = (self.folder / path).resolve()
        except (OSError, RuntimeError) as error:  # a circle of links
            raise InputError(f"{shortened(path)} is no path in {self.folder}.") from error
        if Path(path).is_absolute() or ".." in Path(path).parts or self.folder not in place.parents:
            raise InputError(f"{shortened(path)} is outside the folder {self.folder}.")
        return place


def _kind_of(file: Path) -> re.Pattern[str] | None:
    """Return what the text of a file has: `_STUDY`, `_SCENARIO` or neither."""
    try:
        text = read_text(file, errors="replace") if file.stat().st_size <= _MOST_CHARACTERS else ""
        return next((kind for kind in (_STUDY, _SCENARIO) if kind.search(text)), None)
    except (OSError, SinssimError):
        return None


def _text(asked: dict[str, Any]) -> str:
    text = asked.get("text")
    if not isinstance(text, str) or len(text) > _MOST_CHARACTERS:
        raise InputError(f"the text of a scenario has at most {_MOST_CHARACTERS} characters.")
    return text


def _digest(contents: bytes) -> str:
    return hashlib.sha256(contents).hexdigest()


@cache
def _tables() -> list[dict[str, Any]]:
    from sinssim.cli.workbench_scenario import keys_of_scenarios

    return keys_of_scenarios()


@cache
def _page() -> str:
    """Return the page, HTML, with its style and its scripts."""
    from sinssim.recording.live_chart import packaged, scripts_with
    from sinssim.recording.page import page
    from sinssim.recording.svg_chart import STYLE

    body, style, *scripts = (
        packaged(name, __package__ or "")
        for name in ("workbench.html", "workbench.css", "scenario_editor.js", "workbench.js")
    )
    return page("sinssim workbench", [body, scripts_with(scripts)], STYLE + style, asks=True)


def application(workbench: Workbench) -> Starlette:
    """Return the application that answers the page's requests, behind the checks of who asks."""
    from starlette.applications import Starlette
    from starlette.middleware import Middleware
    from starlette.responses import FileResponse, JSONResponse, Response
    from starlette.routing import Mount, Route

    def asked_for(answer: Callable[[dict[str, Any]], dict[str, Any]]) -> Callable[[Request], Any]:
        async def endpoint(request: Request) -> Response:
            try:
                asked = dict(request.query_params) if request.method == "GET" else await _json(request)
                return JSONResponse(await asyncio.to_thread(answer, asked))
            except SinssimError as error:
                return JSONResponse({"error": str(error)}, 409 if isinstance(error, _ChangedError) else 400)
            except (OSError, UnicodeDecodeError) as error:
                return JSONResponse({"error": f"the file cannot be read: {error}."}, 400)

        return endpoint

    async def page(_: Request) -> Response:
        return Response(await asyncio.to_thread(_page), media_type="text/html")

    async def shown(request: Request) -> Response:
        try:
            file, kind = await asyncio.to_thread(workbench.shown, request.path_params["path"])
        except SinssimError as error:
            return Response(str(error), 404, media_type="text/plain")
        return FileResponse(file, media_type=kind, headers={"Content-Security-Policy": _ALONE})

    reads = ("scenarios", "runs", "scenario", "commands", "keys")
    changes = ("check", "plan", "save", "start", "cancel")
    routes = [
        Route("/", page),
        Route("/files/{path:path}", shown),
        *(Route(f"/{name}", asked_for(getattr(workbench, name))) for name in reads),
        *(Route(f"/{name}", asked_for(getattr(workbench, name)), methods=["POST"]) for name in changes),
    ]
    return Starlette(
        routes=[Mount(f"/{workbench.token}", routes=routes)], middleware=[Middleware(_Guard, token=workbench.token)]
    )


async def _json(request: Request) -> dict[str, Any]:
    """Return the object that a request brings."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > _MOST_BYTES:
            raise InputError(f"a request has at most {_MOST_BYTES} bytes.")
    try:
        asked = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise InputError("the request is no JSON.") from error
    if not isinstance(asked, dict):
        raise InputError("the request must be an object.")
    return asked


class _Guard:
    """Refuses requests from other machines, without the token, and changes by other pages."""

    def __init__(self, app: Any, token: str) -> None:
        self._app, self._token = app, token

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        status, why = self._refusal(scope, headers)
        if status:
            body = f"{why}\n".encode()
            about = [(b"content-type", b"text/plain"), (b"content-length", str(len(body)).encode())]
            await send({"type": "http.response.start", "status": status, "headers": about})
            await send({"type": "http.response.body", "body": body})
            return

        async def answer(message: Any) -> None:
            if message["type"] == "http.response.start":
                given = {name.lower() for name, _ in message["headers"]}
                message["headers"] += [(name.lower().encode(), value.encode()) for name, value in _HEADERS.items()
                                       if name.lower().encode() not in given]  # fmt: skip
            await send(message)

        await self._app(scope, receive, answer)

    def _refusal(self, scope: Any, headers: dict[str, str]) -> tuple[int, str]:
        """Return the status and the reason of a refusal; 0 for none."""
        if not asks_this_machine(headers.get("host")):
            return 421, "Open the address that sinssim printed."
        _, token, *_ = f"{scope['path']}/".split("/")
        if not secrets.compare_digest(token.encode(), self._token.encode()):
            return 404, "Open the address that sinssim printed, with its token."
        if scope["method"] not in ("GET", "HEAD"):
            kind = headers.get("content-type", "").partition(";")[0].strip()
            if headers.get("origin") != f"http://{headers['host']}" or kind != "application/json":
                return 403, "Only the page of the workbench may ask for this."
        return 0, ""


def server_of(workbench: Workbench) -> uvicorn.Server:
    """Return the server of a workbench; it answers plain requests only."""
    import uvicorn

    return uvicorn.Server(
        uvicorn.Config(
            application(workbench),
            log_level="critical",
            lifespan="off",
            ws="none",
            proxy_headers=False,
            server_header=False,
            timeout_graceful_shutdown=1,
        )
    )


def serve(folder: Path, port: int = 0, *, ready: Callable[[str], None]) -> None:
    """Serve the workbench of an existing folder to browsers on this machine only, at a port, 0 for a free one, until
    interrupted; `ready` is called with the address of the page once the server listens. Raise InputError if the port is
    taken, or the extra is not installed."""
    try:
        import starlette  # noqa: F401
        import uvicorn  # noqa: F401
    except ImportError as error:
        raise InputError(f"the workbench needs {error.name}, which is not installed: {INSTALL}.") from error
    with (
        suppress(KeyboardInterrupt),
        interruptible(signal.SIGTERM, signal.SIGINT, signal.SIGHUP),
        socket.socket() as listening,
        Children(folder) as children,
    ):
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind(("127.0.0.1", port))
            listening.listen()
        except (OSError, OverflowError) as error:
            raise InputError(f"the port {port} of this machine cannot be used: {error}. Give another one.") from error
        workbench = Workbench(folder, children)
        server = server_of(workbench)
        ready(f"http://127.0.0.1:{listening.getsockname()[1]}/{workbench.token}/")
        server.run(sockets=[listening])
