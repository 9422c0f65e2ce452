"""Help, hints and completion."""

import re

import click
import pytest

from memscal.cli.commands import COMMANDS, memscal
from memscal.cli.options import Quantity


def commands():
    context = click.Context(memscal)
    found = {name: memscal.get_command(context, name) for name in COMMANDS}
    return {name: command for name, command in found.items() if command is not None}


def options(command):
    return [option for option in command.params if isinstance(option, click.Option)]


@pytest.mark.parametrize("name", COMMANDS)
def test_the_options_in_the_examples_exist(name):
    command = commands()[name]
    known = {text for option in options(command) for text in (*option.opts, *option.secondary_opts)}
    assert set(re.findall(r" (--?[a-z][a-z-]*)", command.epilog or "")) <= known | {"--help"}


def test_every_option_with_a_unit_says_it_in_words():
    every = [(name, option) for name, of in commands().items() for option in options(of)]
    assert [(name, option.name) for name, option in every if not option.help] == []
    measured = [pair for pair in every if isinstance(pair[1].type, Quantity)]
    stated = [(name, option) for name, option in measured if option.type.name != "ratio"]
    assert len(stated) > 50
    silent = [(name, option.name) for name, option in stated if option.type.name not in option.help]
    assert silent == []


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_gets_its_completion_script(run, shell):
    assert f"_MEMSCAL_COMPLETE={shell}_complete" in run("completion", shell).exits(0).out
