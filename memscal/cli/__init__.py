"""The command line: parse, call the library, print.

Each command has a module of its own, which is imported when the command is used; the libraries
that do the work are imported inside the commands.  Asking for help imports click alone.
"""

from __future__ import annotations

from collections.abc import Sequence

from memscal.cli.commands import memscal
from memscal.cli.failures import Session, guarded
from memscal.parallel import one_thread_per_process

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command ``memscal`` and return its exit code.

    0 done; 1 done, but a quality check failed; 2 usage; 3 input refused; 4 output not written;
    70 internal error; 130 interrupted.
    """

    def run(session: Session) -> int:
        args = None if arguments is None else list(arguments)
        code = memscal.main(args, prog_name="memscal", standalone_mode=False, obj=session)
        return code if isinstance(code, int) else 0

    one_thread_per_process()
    return guarded(run)
