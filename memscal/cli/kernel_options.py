"""Options that describe an apparatus function: of a simulated scan, or of one to be expected."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import click

from memscal.cli.options import Quantity, si

if TYPE_CHECKING:
    from memscal.axisymmetry.kernels import RadialKernel

__all__ = ["kernel_from", "kernel_options", "require_one_kernel"]

_Command = TypeVar("_Command", bound=Callable[..., Any])

_OPTIONS = (
    click.option(
        "--sigma",
        "sigmas",
        type=Quantity("um"),
        multiple=True,
        default=(561.0,),
        show_default=True,
        help="Standard deviation of the Gaussian apparatus function, in um. Repeated with "
        "--weight: a sum of Gaussians.",
    ),
    click.option(
        "--weight",
        "weights",
        type=Quantity("ratio", low=-math.inf),
        multiple=True,
        help="Share of each Gaussian, in the order of --sigma; they add up to 1.",
    ),
    click.option(
        "--disc-radius",
        type=Quantity("um"),
        help="Radius of a uniform disc, in um: the apparatus function is this disc, blurred by a "
        "Gaussian of --sigma.",
    ),
    click.option(
        "--conversion-constant",
        type=Quantity("mV/Pa"),
        default=1e-4,
        show_default=True,
        help="Conversion constant A, in mV/Pa.",
    ),
)


def kernel_options(command: _Command) -> _Command:
    """Add the apparatus function and the conversion constant."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def require_one_kernel(given: Mapping[str, Any]) -> None:
    """Refuse options that describe no kernel, or two.

    Raises
    ------
    click.UsageError
        If weights and widths do not pair, or a disc has several blurs.
    """
    sigmas, weights = given["sigmas"], given["weights"]
    if given["disc_radius"] is not None:
        if weights or len(sigmas) > 1:
            raise click.UsageError(
                "A disc is blurred by one Gaussian: give --disc-radius and one --sigma, and no "
                "--weight."
            )
    elif len(weights) != len(sigmas) and (weights or len(sigmas) > 1):
        raise click.UsageError(
            f"There are {len(sigmas)} --sigma and {len(weights)} --weight: give one weight to each."
        )


def kernel_from(given: Mapping[str, Any]) -> RadialKernel:
    """Return the apparatus function that the options describe."""
    from memscal.axisymmetry.kernels import GaussianMixture, SmoothedDisc

    sigmas = tuple(si(sigma, -6) for sigma in given["sigmas"])
    if given["disc_radius"] is not None:
        return SmoothedDisc(radius=si(given["disc_radius"], -6), sigma=sigmas[0])
    return GaussianMixture(given["weights"] or (1.0,), sigmas)
