"""The command line: each command has a module of its own, imported when it is used."""

from collections.abc import Sequence

from memscal.cli.commands import memscal
from memscal.cli.failures import guarded
from memscal.parallel import one_thread_per_process


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command ``memscal`` and return its exit code, as ``memscal --help`` lists them."""
    one_thread_per_process()
    return guarded(memscal, arguments)
