"""The command `sinssim` and `python -m sinssim`: runs the command line as a process.

Only modules that Python has already loaded are imported before Ctrl-C is handled.
"""

import gc
import os
import signal
import sys
from typing import NoReturn

_ALLOCATIONS = 200_000
"""Objects between two searches for reference cycles, more than loading makes: with the default of 700,
modules load under hundreds of searches."""


def program() -> NoReturn:
    """Run the command line, and end the process at once.

    Python's own exit takes a third of a second to release compilers and a gigabyte of arrays, and can fail if a thread
    is still loading a module. All files are closed by then.
    """
    code = 1
    gc.set_threshold(_ALLOCATIONS)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it would read the metadata of all installed packages
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # for matrices as small as here, waking threads takes longer
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:  # a shell's `&` makes a program ignore SIGINT
            signal.signal(number, _stop)
    _open_standard_streams()
    from sinssim.cli.app import READER_GONE, main

    try:
        for number, handler in before.items():
            signal.signal(number, handler)
        main()
    except SystemExit as end:
        code = int(end.code or 0)
    except KeyboardInterrupt:  # during the exit, after all work was done
        code = 130
    except BaseException:
        sys.excepthook(*sys.exc_info())
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except BrokenPipeError:
        code = code or READER_GONE
    except OSError as error:
        if not code:
            os.write(2, f"sinssim: the operating system reported an error: {error}.\n".encode())
        code = code or 1
    os._exit(code)


def _stop(number: int, frame: object) -> NoReturn:
    """End before any work has begun, when no clean-up is needed."""
    os.write(2, b"Interrupted.\n")
    os._exit(130)


def _open_standard_streams() -> None:
    """Replace closed standard streams by the null device, so that no file of a run gets their numbers."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number
            os.set_inheritable(number, True)
    sys.stdout = sys.stdout or os.fdopen(1, "w", encoding="utf-8")
    sys.stderr = sys.stderr or os.fdopen(2, "w", encoding="utf-8")


if __name__ == "__main__":
    program()
