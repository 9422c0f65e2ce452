"""Regularisers by name: memscal's own, and others' by entry point."""

from __future__ import annotations

import inspect
from collections.abc import Collection
from importlib import import_module
from typing import TYPE_CHECKING, Any

from memscal.deconvolution.problem import Regulariser
from memscal.errors import InputError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["ENTRY_POINT_GROUP", "create_regulariser", "regulariser_names"]

ENTRY_POINT_GROUP = "memscal.regularisers"

_OWN = {
    "white-noise": "memscal.deconvolution.white_noise:WhiteNoise",
    "evidence": "memscal.deconvolution.evidence:Evidence",
    "white-noise-draw": "memscal.deconvolution.white_noise:WhiteNoiseDraw",
    "tikhonov": "memscal.deconvolution.tikhonov:Tikhonov",
    "wiener": "memscal.deconvolution.wiener:Wiener",
    "unsupervised-wiener": "memscal.deconvolution.wiener:UnsupervisedWiener",
    "richardson-lucy": "memscal.deconvolution.wiener:RichardsonLucy",
}


def regulariser_names() -> tuple[str, ...]:
    """Names of every regulariser: memscal's own first, then plug-ins'.

    Examples
    --------
    >>> regulariser_names()[0]
    'white-noise'
    """
    others = sorted({point.name for point in _plug_ins()} - set(_OWN))
    return (*_OWN, *others)


def create_regulariser(name: str, /, **options: Any) -> Regulariser:
    """Create a regulariser by name.

    Parameters
    ----------
    name : str
        One of :func:`regulariser_names`.
    **options
        Its parameters; ``seed`` is passed on only to those that draw random numbers.

    Raises
    ------
    InputError
        If there is no such regulariser, or it has no such option.

    Examples
    --------
    >>> create_regulariser("tikhonov", amplitude=0.5).amplitude
    0.5
    """
    factory = _factory(name)
    accepted = inspect.signature(factory).parameters
    if "seed" not in accepted:
        options = {key: value for key, value in options.items() if key != "seed"}
    unknown = sorted(set(options) - set(accepted))
    takes_any = any(p.kind is p.VAR_KEYWORD for p in accepted.values())
    if unknown and not takes_any:
        raise InputError(
            f"Method {name} has no option {', '.join(unknown)}.",
            cure=f"Its options are: {', '.join(accepted) or 'none'}.",
        )
    regulariser: Regulariser = factory(**options)
    return regulariser


def _factory(name: str) -> Any:
    if name in _OWN:
        module, _, attribute = _OWN[name].partition(":")
        return getattr(import_module(module), attribute)
    found = [point for point in _plug_ins() if point.name == name]
    if not found:
        raise InputError(
            f"There is no method named {name}.",
            cure=f"Choose from {', '.join(regulariser_names())}.",
        )
    point = found[0]
    try:
        return point.load()
    except Exception as error:
        # Whatever another package's import raises, the user needs to know which package it is.
        raise InputError(
            f"The method {name}, {point.value}, could not be loaded: {error}.",
            cure="Repair or remove the package that provides it.",
        ) from error


def _plug_ins() -> Collection[EntryPoint]:
    """Entry points of other packages; looked up only when one is asked for."""
    from importlib.metadata import entry_points

    return entry_points(group=ENTRY_POINT_GROUP)
