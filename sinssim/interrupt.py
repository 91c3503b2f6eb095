"""Being asked to stop by other means than Ctrl-C."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator


@contextlib.contextmanager
def interruptible(*signals: signal.Signals) -> Iterator[None]:
    """Treat signals inside the block like Ctrl-C, so that what is to be tidied up then is tidied up.

    Args:
        *signals: which; main thread only.

    Raises:
        KeyboardInterrupt: one of them came.
    """
    before = {number: signal.signal(number, signal.default_int_handler) for number in signals}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
