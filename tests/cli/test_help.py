"""Help, hints and completion."""

import re

import click
import pytest
from helpers.console import Run

from memscal.cli import main
from memscal.cli.commands import COMMANDS, memscal


def commands() -> dict[str, click.Command]:
    context = click.Context(memscal)
    found = {name: memscal.get_command(context, name) for name in COMMANDS}
    return {name: command for name, command in found.items() if command is not None}


def options(command: click.Command) -> list[click.Option]:
    return [option for option in command.params if isinstance(option, click.Option)]


@pytest.mark.parametrize("name", COMMANDS)
def test_the_options_in_the_examples_exist(name):
    command = commands()[name]
    known = {text for option in options(command) for text in (*option.opts, *option.secondary_opts)}
    assert set(re.findall(r" (--?[a-z][a-z-]*)", command.epilog or "")) <= known | {"--help"}


def test_every_option_with_a_unit_says_it_in_words():
    every = [(name, option) for name, of in commands().items() for option in options(of)]
    assert [(name, option.name) for name, option in every if not option.help] == []
    units = [(*pair, getattr(pair[1].type, "unit", None)) for pair in every]
    stated = [of for of in units if of[2] not in (None, "ratio")]
    assert len(stated) > 50
    assert [(name, option.name) for name, option, unit in stated if unit not in option.help] == []


@pytest.mark.parametrize(("arguments", "hint"), [
    (["calibrat", "scan.h5"], "Did you mean calibrate?"),
    (["import", "t.csv", "-o", "a.h5", "--x-units", "mm"], "--x-unit"),
    (["reference", "cone"], "rod"), (["reference", "rod", "--load", "0"], "above 0"),
    (["reference", "rod", "--load", "nan"], "(in N)"),
    (["reference", "rod", "--radius", "a quarter"], "(in mm)"),
    (["reference", "rod", "--poisson-ratio", "0.7"], "at most 0.5"), (["calibrate"], "SCAN"),
    (["completion", "tcsh"], "fish"), (["--verbose"], "--version"),
])  # fmt: skip
def test_wrong_usage_is_exit_code_2_with_a_hint(run: Run, arguments, hint):
    assert run(*arguments).exits(2, hint).out == ""


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_gets_its_completion_script(run: Run, shell):
    assert f"_MEMSCAL_COMPLETE={shell}_complete" in run("completion", shell).exits(0).out


@pytest.mark.parametrize(("words", "expected"), [
    (["memscal", "ca"], {"calibrate"}), (["memscal", "calibrate", "--met"], {"--method"}),
    (["memscal", "calibrate", "--method", "white"], {"white-noise", "white-noise-draw"}),
    (["memscal", "reference", ""], {"rod", "sphere", "cone", "profile"}),
])  # fmt: skip
def test_words_are_completed(
    words, expected, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setenv("_MEMSCAL_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", " ".join(words))
    monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
    with pytest.raises(SystemExit):
        main([])
    lines = capsys.readouterr().out.splitlines()
    assert {line.partition(",")[2] for line in lines} == expected
