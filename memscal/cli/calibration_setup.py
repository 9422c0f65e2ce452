"""What the options of ``memscal calibrate`` say about its method and its inputs."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from memscal.cli.output import note
from memscal.cli.targets import beside

if TYPE_CHECKING:
    from memscal.deconvolution.problem import Regulariser

__all__ = ["artifact_beside", "chosen_method", "correlation"]


def artifact_beside(scan: Path, channel: str) -> Path:
    """Name the artifact of one of a scan's channels."""
    return beside(scan, ".apparatus.h5" if channel == "zz" else f".{channel}.apparatus.h5")


def chosen_method(
    method: str | None, options: tuple[str, ...], seed: int | None, channel: str = "zz"
) -> Regulariser:
    """Set up the method, or a channel's usual one; a wrong name or option is a matter of usage."""
    from memscal.deconvolution.registry import create_regulariser
    from memscal.errors import InputError

    method = method or ("white-noise" if channel == "zz" else "evidence")
    given = dict(_option(text) for text in options)
    if "seed" in given:
        raise click.UsageError("Give the seed as --seed, not as --option.")
    try:
        if given:
            _check_kinds(given, create_regulariser(method))
        regulariser = create_regulariser(method, seed=seed or 0, **given)
    except InputError as failure:
        raise click.UsageError(f"{failure.problem} {failure.cure}".strip()) from failure
    if seed is not None and not hasattr(regulariser, "seed"):
        note(f"--seed changes nothing here: {regulariser.name} draws no random numbers.")
    return regulariser


def correlation(text: str) -> tuple[tuple[str, str], float]:
    """Read INPUT,INPUT=R."""
    pair, equals, value = text.partition("=")
    first, comma, second = (part.strip() for part in pair.partition(","))
    try:
        coefficient = float(value)
    except ValueError:
        coefficient = math.nan
    if not (equals and comma and math.isfinite(coefficient)):
        raise click.UsageError(f"--correlation {text!r} is not of the form INPUT,INPUT=R.")
    return (first, second), coefficient


def _option(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    if not (equals and name.isidentifier()):
        raise click.UsageError(f"--option {text!r} is not of the form NAME=VALUE.")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def _check_kinds(given: dict[str, Any], usual: Regulariser) -> None:
    """Refuse text where the method's own default is a number, or a part where it is a count."""
    for name, value in given.items():
        default = getattr(usual, name, None)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if isinstance(default, float) and not (number and math.isfinite(value)):
            raise click.UsageError(
                f"--option {name}={value}: {name} is a number, such as {default}."
            )
        if type(default) is int and type(value) is not int:
            raise click.UsageError(f"--option {name}={value}: {name} is a whole number.")
