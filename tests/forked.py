"""Runs Python each in a process of its own, forked from one that has imported numba and has compiled something.

A process that starts anew takes a second for that, and two for all packages that sinssim imports. The forked ones share
no kernel: those of sinssim are defined in the file that each runs, or are imported by it.
"""

from __future__ import annotations

import ast
import contextlib
import gc
import os
import socket
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path


class Forks:
    """Starts processes, one after the other; a context manager."""

    def __init__(self, *modules: str) -> None:
        """Name what the processes have imported when they start, beside numba: no part of sinssim."""
        self._modules = modules

    def __enter__(self) -> Forks:
        self._socket, theirs = socket.socketpair()
        with theirs:
            self._server = subprocess.Popen(
                [sys.executable, "-P", __file__, str(theirs.fileno()), *self._modules],
                pass_fds=[theirs.fileno()],
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": ""},
            )
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._server.wait()

    def run(self, *words: str | Path, cwd: Path | None = None, **variables: str) -> subprocess.CompletedProcess[str]:
        """Run Python on a file, on `-m` and a module, or on `-c` and code, and wait for its end.

        Args:
            *words: arguments of the interpreter.
            cwd: the working directory; by default the folder of the file.
            **variables: environment variables that differ from those of this process; numba's are heeded, and
                PYTHONPATH; those that only the interpreter's own start reads are not.

        Returns:
            Exit code and what the process wrote.
        """
        arguments = [str(word) for word in words]
        request = arguments, str(cwd or Path(arguments[0]).parent), {**os.environ, **variables}
        with contextlib.ExitStack() as stack:
            asked, out, err = files = [
                stack.enter_context(tempfile.TemporaryFile("w+", encoding="utf-8")) for _ in range(3)
            ]
            asked.write(repr(request))
            for file in files:
                file.seek(0)
            socket.send_fds(self._socket, [b"?"], [file.fileno() for file in files])
            code = int(self._socket.recv(16))
            out.seek(0)
            err.seek(0)
            return subprocess.CompletedProcess(arguments, code, out.read(), err.read())


def _serve(requests: socket.socket, modules: list[str]) -> None:
    """Fork a process for each request until the other end is closed."""
    import importlib

    import numba

    for module in modules:
        importlib.import_module(module)

    numba.njit(lambda x: 2.0 * x)(1.0)  # the compiler is ready from here on
    gc.freeze()  # its memory stays shared
    while True:
        said, files, _, _ = socket.recv_fds(requests, 1, 3)
        if not said:
            return
        child = os.fork()
        if child == 0:
            requests.close()
            with open(files[0], encoding="utf-8") as asked:
                request = ast.literal_eval(asked.read())
            for stream, file in zip((1, 2), files[1:], strict=True):
                os.dup2(file, stream)
                os.close(file)
            code = 0
            try:
                _become(*request)
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else int(end.code is not None)
            except BaseException:
                traceback.print_exc()
                code = 1
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)  # to take down all that the compiler has made would take longer than most of these processes
        for file in files:
            os.close(file)
        requests.send(str(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])).encode())


def _become(words: list[str], folder: str, variables: dict[str, str]) -> None:
    """Do what the interpreter does with its arguments and its environment."""
    import runpy

    import numba

    os.environ.clear()
    os.environ.update(variables)
    os.chdir(folder)
    numba.config.reload_config()
    sys.path[:0] = [folder, *filter(None, variables.get("PYTHONPATH", "").split(os.pathsep))]
    sys.argv = words[words[0] == "-m" :]
    if words[0] == "-c":
        exec(compile(words[1], "<string>", "exec"), {"__name__": "__main__"})
    elif words[0] == "-m":
        runpy.run_module(words[1], run_name="__main__", alter_sys=True)
    else:
        runpy.run_path(words[0], run_name="__main__")


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])), sys.argv[2:])
