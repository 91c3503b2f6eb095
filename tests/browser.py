"""A real browser for tests: Chromium without a window, spoken to over a pipe."""

from __future__ import annotations

import base64
import itertools
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any, Self

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
"""The browser, None on a machine without one."""
AXE = os.environ.get("SINSSIM_AXE")
"""The script axe.min.js of axe-core, None without one; see `make test-reports`."""

_SOFTWARE_GRAPHICS = (
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
)


class Page:
    """A page of Chromium.

    Attributes:
        problems: errors on its console, and exceptions.
        requests: addresses that the pages have asked for.
    """

    def __init__(self, *, size: tuple[int, int] = (1600, 1000), dark: bool = False, graphics: bool = False) -> None:
        """Start the browser with an empty page of a size in pixels, in the light or in the dark colours.

        With `graphics`, it has the drawing in space that the web view needs.
        """
        assert CHROMIUM is not None
        self.problems: list[str] = []
        self.requests: list[str] = []
        self._folder = tempfile.TemporaryDirectory(prefix="sinssim-browser-", ignore_cleanup_errors=True)
        to_browser, self._write = os.pipe()
        self._read, from_browser = os.pipe()
        options = [
            *("--headless", "--no-sandbox", "--remote-debugging-pipe", "--hide-scrollbars", "--no-first-run"),
            *("--disable-background-networking", f"--user-data-dir={self._folder.name}"),
            *(_SOFTWARE_GRAPHICS if graphics else ("--disable-gpu",)),
            *(f"--window-size={size[0]},{size[1]}", "about:blank"),
        ]
        # the browser expects the pipe's ends at 3 and 4
        command = ["bash", "-c", f'exec "$@" 3<&{to_browser} 4>&{from_browser}', "bash", CHROMIUM, *options]
        self._process = subprocess.Popen(
            command, pass_fds=(to_browser, from_browser), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(to_browser)
        os.close(from_browser)
        self._numbers, self._rest = itertools.count(1), b""
        self._session: str | None = None
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._ask(f"{domain}.enable")
        width, height = size
        self.size(width, height)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._ask("Emulation.setEmulatedMedia", features=[scheme])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.wait(20.0)
        for end in (self._read, self._write):
            os.close(end)
        self._folder.cleanup()

    def size(self, width: int, height: int) -> None:
        """Give the window a size, px."""
        self._ask("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def open(self, address: str, until: str = "") -> None:
        """Load an address, and wait until an expression of its page is true."""
        self._ask("Page.navigate", url=address)
        if until:
            self.until(f"document.readyState === 'complete' && Boolean({until})")

    def until(self, expression: str) -> None:
        """Wait until an expression of the page is true."""
        deadline = time.monotonic() + 60.0
        while not self.value(f"Boolean({expression})"):
            assert time.monotonic() < deadline, expression
            self.wait(0.05)

    def value(self, expression: str) -> Any:
        """Return the value of an expression of the page."""
        options = {"returnByValue": True, "awaitPromise": True}
        return self._ask("Runtime.evaluate", expression=expression, **options)["result"].get("value")

    def drawn(self) -> None:
        """Wait until what was asked for is drawn."""
        self.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done))))")

    def allow(self, *permissions: str) -> None:
        """Give the page leave for what the browser would ask, such as "clipboardReadWrite"."""
        self._ask("Browser.grantPermissions", permissions=list(permissions))

    def media(self, kind: str) -> None:
        """Show the page as on a "screen" or in "print"."""
        self._ask("Emulation.setEmulatedMedia", media=kind)

    def serious(self) -> list[Any]:
        """Return what axe-core finds that hinders readers seriously; nothing without it."""
        if AXE is None:
            return []
        self.value(Path(AXE).read_text(encoding="utf-8") + "; 1")
        return list(
            self.value(
                """axe.run().then(({violations}) => violations.filter(({impact}) =>
                impact === "serious" || impact === "critical").map(({id, nodes}) => [id, nodes[0].html]))"""
            )
        )

    def scripts(self, on: bool) -> None:
        """Run the scripts of the pages that are opened, or not."""
        self._ask("Emulation.setScriptExecutionDisabled", value=not on)

    def mouse(self, *events: tuple[str, float, float], clicks: int = 1) -> None:
        """Move the mouse: "mouseMoved", "mousePressed" or "mouseReleased", and where in the window, px."""
        for kind, x, y in events:
            held = {} if kind == "mouseMoved" else {"button": "left", "clickCount": clicks}
            self._ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, **held)

    def wheel(self, x: float, y: float, down: float) -> None:
        """Turn the wheel at a point of the window."""
        self._ask("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=down)

    def touch(self, *steps: tuple[tuple[float, float], ...]) -> None:
        """Put fingers on points of the window, px, move them to those of each further step, and lift them."""
        self._ask("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
        for number, points in enumerate((*steps, ())):
            kind = "touchStart" if not number else "touchMove" if points else "touchEnd"
            fingers = [{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(points)]
            self._ask("Input.dispatchTouchEvent", type=kind, touchPoints=fingers)

    def key(self, *names: str, shift: bool = False) -> None:
        """Press keys one after another: "Tab", "ArrowLeft", "+" and so on."""
        for name in names:
            codes = {"Tab": 9, "Enter": 13}
            text = {"text": "\r" if name == "Enter" else name} if len(name) == 1 or name == "Enter" else {}
            common = {"key": name, "modifiers": 8 * shift, "windowsVirtualKeyCode": codes.get(name, 0)}
            self._ask("Input.dispatchKeyEvent", type="keyDown", **common, **text)
            self._ask("Input.dispatchKeyEvent", type="keyUp", **common)

    def picture(self, *, whole: bool = False) -> bytes:
        """Return a picture, PNG, of what is seen, or of the whole page."""
        found = self._ask("Page.captureScreenshot", format="png", captureBeyondViewport=whole, **self._clip(whole))
        return base64.b64decode(found["data"])

    def _clip(self, whole: bool) -> dict[str, Any]:
        if not whole:
            return {}
        size = self._ask("Page.getLayoutMetrics")["cssContentSize"]
        return {"clip": {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}}

    def wait(self, seconds: float) -> None:
        """Wait, and take note of problems."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            if select.select([self._read], [], [], left)[0]:
                self._receive()

    def _ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = next(self._numbers)
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + 120.0
        while time.monotonic() < deadline:
            for answer in self._receive():
                if answer.get("id") == number:
                    assert "error" not in answer, answer
                    return dict(answer["result"])
        raise TimeoutError(method)

    def _receive(self) -> list[dict[str, Any]]:
        """Return the messages that have arrived, at least a part of one."""
        part = os.read(self._read, 1 << 20)
        assert part, "the browser has ended"
        *whole, self._rest = (self._rest + part).split(b"\0")
        messages = [json.loads(message) for message in whole]
        for message in messages:
            found = message.get("params", {})
            match message.get("method"):
                case "Network.requestWillBeSent":
                    self.requests.append(found["request"]["url"])
                case "Runtime.consoleAPICalled" if found["type"] in ("error", "assert"):
                    self.problems.append(" ".join(str(a.get("value", a.get("description"))) for a in found["args"]))
                case "Runtime.exceptionThrown":
                    self.problems.append(str(found["exceptionDetails"].get("exception", found["exceptionDetails"])))
                case "Log.entryAdded" if found["entry"]["level"] == "error":
                    self.problems.append(f"{found['entry']['text']} {found['entry'].get('url', '')}".strip())
        return messages


def file_address(path: Path) -> str:
    """Return the address of a file on this machine."""
    return path.absolute().as_uri()
