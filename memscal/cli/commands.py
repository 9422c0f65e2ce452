"""The group of commands: their names and one line on each, without importing any of them."""

import os

import click

from memscal.cli.failures import debug_option
from memscal.extensions import COMMANDS, module
from memscal.version import __version__

SETTINGS = {"help_option_names": ["--help", "-h"], "max_content_width": 100}


class LazyGroup(click.Group):
    """Commands whose modules are imported when they are used."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click passes it
        """Return the names in the order of use."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - click passes it
        """Import a command."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = module(COMMANDS[cmd_name][0]).command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find a command, suggest names close to a misspelt one; refuse an option given twice."""
        name = args[0]
        if name not in COMMANDS and not name.startswith("-") and not ctx.resilient_parsing:
            from difflib import get_close_matches

            close = get_close_matches(name, COMMANDS)
            hint = f"Did you mean {' or '.join(close)}?" if close else ""
            ctx.fail(f"There is no command {name!r}. {hint}".strip())
        found, command, rest = super().resolve_command(ctx, args)
        if command is not None and not ctx.resilient_parsing:
            inner = click.Context(command, ctx, found)
            ctx.meta["memscal.words"], _, given = command.make_parser(inner).parse_args([*rest])
            for option in given:
                if given.count(option) > 1 and not (
                    option.multiple or option.type.name == "boolean"
                ):
                    inner.fail(f"{option.opts[0]} is given twice, but has one value.")
        return found, command, rest

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - click passes it
        """List the commands from what stands here, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, about) for name, (_, about) in COMMANDS.items()])


EXAMPLES = """\b
Examples:
  memscal simulate -o scan.h5
  memscal calibrate scan.h5 --figure scan.png
  memscal inspect scan.apparatus.h5

\b
Exit codes:
  0    done
  1    done, but a quality check failed, or one of several scans or tables; the results say so
  2    wrong usage of a command
  3    the input was refused
  4    the outputs were not written; what was there before is untouched
  70   a fault in memscal itself
  129  interrupted by SIGHUP, 130 by Ctrl-C, 143 by SIGTERM; nothing is left half-written
"""


@click.group(cls=LazyGroup, context_settings=SETTINGS, epilog=EXAMPLES)
@click.version_option(__version__, "--version", message="memscal %(version)s")
@debug_option
def memscal() -> None:
    """Calibrate stress sensors under an elastic film.

    A sensor at the base of a film reports U = A G (x) sigma_zz: the normal stress there, blurred
    by its apparatus function G and scaled by its conversion constant A. memscal estimates both
    from a scan with a thin rigid rod, with standard uncertainties and quality checks.

    Lengths are in mm, depths in um, loads in N and moduli in MPa; each option states its unit.
    """
    if os.environ.get("SOURCE_DATE_EPOCH") is not None:
        from memscal.model.provenance import timestamp

        timestamp()  # refuses a wrong one before numpy does
        if not os.environ["SOURCE_DATE_EPOCH"]:  # which counts as none
            del os.environ["SOURCE_DATE_EPOCH"]
