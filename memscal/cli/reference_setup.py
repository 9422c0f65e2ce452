"""What ``memscal reference`` presses on the film, and through which interface."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import click

from memscal.cli.options import Quantity, indenter_from, si

if TYPE_CHECKING:
    from memscal.mechanics.interface import Interface
    from memscal.model.indenter import Indenter

__all__ = ["SHAPES", "indenter_of", "interface_of", "interface_options"]

_Command = TypeVar("_Command", bound=Callable[..., Any])

#: The paper's rod and sphere, in mm.
_RADIUS = {"rod": 0.25, "sphere": 128.8}
SHAPES = ("rod", "sphere", "cone", "profile")

# What each shape is described by; every other of these options belongs to another shape.
_DESCRIBED_BY = {
    "rod": "radius",
    "sphere": "radius",
    "cone": "inclination",
    "profile": "profile_table",
}


def interface_options(command: _Command) -> _Command:
    """Add the options of a rough interface."""
    slip = click.option(
        "--slip-length",
        type=Quantity("um", open_low=False),
        default=0.0,
        help="Elastic tangential displacement of the interface before it slips, in um.  "
        "[default: 0, rigid]",
    )
    greenwood = click.option(
        "--greenwood-tripp",
        type=(Quantity("um"), Quantity("1/mm^2"), Quantity("um")),
        metavar="UM 1/MM^2 UM",
        help="Rough interface: rms height of the asperities (um), their number per mm^2, and the "
        "radius of their tips (um).",
    )
    exponential = click.option(
        "--exponential",
        type=(Quantity("um"), Quantity("MPa")),
        metavar="UM MPa",
        help="Rough interface: pressure that falls by e within a length (um), and its value where "
        "the mean planes meet (MPa).",
    )
    return slip(greenwood(exponential(command)))


def indenter_of(shape: str, given: Mapping[str, Any]) -> Indenter:
    """Return the indenter that the options describe.

    Raises
    ------
    click.UsageError
        If its own option is missing, or one of another shape is given.
    """
    own = _DESCRIBED_BY[shape]
    for name in sorted(set(_DESCRIBED_BY.values()) - {own}):
        if given[name] is not None:
            raise click.UsageError(f"{_option(name)} does not describe a {shape}.")
    if shape in _RADIUS:
        return indenter_from(shape, {**given, "radius": given["radius"] or _RADIUS[shape]})
    if given[own] is None:
        raise click.UsageError(f"A {shape} needs {_option(own)}.")
    if shape == "cone":
        from memscal.model.indenter import Cone

        return Cone(inclination=math.radians(given["inclination"]))
    from memscal.formats.indenter_table import read_indenter_table

    return read_indenter_table(
        given["profile_table"], r_unit=given["r_unit"], z_unit=given["z_unit"]
    )


def interface_of(given: Mapping[str, Any]) -> Interface:
    """Return the interface that the options describe.

    Raises
    ------
    click.UsageError
        If two normal laws are given.
    """
    from memscal.mechanics.interface import ExponentialCompliance, GreenwoodTripp, Interface

    rough, exponential = given["greenwood_tripp"], given["exponential"]
    if rough and exponential:
        raise click.UsageError("Give --greenwood-tripp or --exponential: one normal law.")
    normal: GreenwoodTripp | ExponentialCompliance | None = None
    if rough:
        normal = GreenwoodTripp(
            roughness=si(rough[0], -6),
            asperity_density=si(rough[1], 6),
            asperity_radius=si(rough[2], -6),
        )
    if exponential:
        normal = ExponentialCompliance(
            decay_length=si(exponential[0], -6), reference_pressure=si(exponential[1], 6)
        )
    return Interface(normal=normal, slip_length=si(given["slip_length"], -6))


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")
