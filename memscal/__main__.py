"""``python -m memscal`` is the command ``memscal``."""

import gc
import os
import signal
import sys


def run() -> int:
    """Run the command; a signal during its imports ends it at once, for nothing is written yet."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda number, _: os._exit(128 + number))
    # Libraries that load leave no cycles to collect, and those of a process that ends go with it.
    gc.set_threshold(200_000)
    from memscal.cli import main

    code = main()
    gc.freeze()
    return code


if __name__ == "__main__":
    sys.exit(run())
