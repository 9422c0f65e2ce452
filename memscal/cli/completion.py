"""``memscal completion``: the shell's completion script."""

import click

from memscal.cli.failures import debug_option
from memscal.cli.output import emit

EXAMPLES = """\b
Examples:
  memscal completion bash > ~/.local/share/bash-completion/completions/memscal
  memscal completion zsh > ~/.zfunc/_memscal
  memscal completion fish > ~/.config/fish/completions/memscal.fish
"""


@click.command("completion", epilog=EXAMPLES)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@debug_option
def command(shell: str) -> None:
    """Print the script with which SHELL completes commands, options and file names."""
    from click.shell_completion import get_completion_class

    from memscal.cli.commands import memscal

    kind = get_completion_class(shell)
    assert kind is not None  # click completes each of the shells of the argument
    script = kind(memscal, {}, "memscal", "_MEMSCAL_COMPLETE")
    # Not .source(): for bash it would look for a shell on this machine before it answers.
    emit(script.source_template % script.source_vars())
