"""``python -m memscal`` is the command ``memscal``."""

import os
import signal
import sys
from typing import Any

#: Signals that end a program.
ENDING = ("SIGINT", "SIGTERM", "SIGHUP")


def handle_ending(handler: Any) -> dict[int, Any]:
    """Set a handler of the signals that are not ignored (by nohup); return those before it."""
    numbers = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
    heard = [n for n in numbers if signal.getsignal(n) is not signal.SIG_IGN]
    return {number: signal.signal(number, handler) for number in heard}


def run() -> int:
    """Run the command; a signal during its imports ends it at once, for nothing is written yet."""
    handle_ending(lambda number, _: os._exit(128 + number))
    from memscal.cli import main

    return main()


if __name__ == "__main__":
    sys.exit(run())
