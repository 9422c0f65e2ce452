"""The sphere's part of ``memscal simulate``: a whole experiment, as a folder of scans."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import click

from memscal.cli.kernel_options import kernel_from
from memscal.cli.options import Quantity, film_from, indenter_from, si
from memscal.cli.reference_setup import interface_of, interface_options

if TYPE_CHECKING:
    from memscal.laboratory.experiment import Experiment

__all__ = ["FILES", "NAMES", "experiment_from", "sphere_options"]

_Command = TypeVar("_Command", bound=Callable[..., Any])

FILES = ("rod_scan.h5", "sphere_dry.h5", "sphere_lubricated.h5")
"""The files of an experiment; a test compares them with what the laboratory names."""

NAMES = (
    *("lubricated_loads", "sphere_radius", "sphere_radius_uncertainty", "friction", "loading"),
    *("slip_length", "greenwood_tripp", "exponential", "contacts", "spacing", "load_scatter"),
    *("record_loads", "position_error", "draw_inputs", "gain", "thickness_factor"),
)
"""The options that only an experiment with a sphere has."""

_LOADS = (0.34, 0.69, 1.37, 2.75)


_OPTIONS = (
    click.option(
        "--lubricated-load",
        "lubricated_loads",
        type=Quantity("N"),
        multiple=True,
        default=(0.69, 2.75),
        show_default=True,
        help="Sphere: load of the lubricated contacts, in N. May be repeated.",
    ),
    click.option(
        "--sphere-radius",
        type=Quantity("mm"),
        default=128.8,
        show_default=True,
        help="Sphere: radius of curvature, in mm.",
    ),
    click.option(
        "--sphere-radius-uncertainty",
        type=Quantity("mm", open_low=False),
        default=0.5,
        show_default=True,
        help="Sphere: standard uncertainty (k = 1) of its radius, in mm.",
    ),
    click.option(
        "--friction",
        type=Quantity("ratio", open_low=False, infinite=True),
        default=0.2,
        show_default=True,
        metavar="MU",
        help="Sphere: friction coefficient of the dry contacts; inf: they stick wherever they "
        "touch.",
    ),
    click.option(
        "--loading",
        type=click.Choice(["incremental", "total"]),
        default="incremental",
        show_default=True,
        help="Sphere: a point sticks where it first touched, or as if loaded in one step.",
    ),
    interface_options,
    click.option(
        "--contacts",
        type=click.IntRange(min=2, max=4096),
        default=33,
        show_default=True,
        help="Sphere: contacts in a row.",
    ),
    click.option(
        "--spacing",
        type=Quantity("mm"),
        default=0.5,
        show_default=True,
        help="Sphere: distance of neighbouring contacts, in mm.",
    ),
    click.option(
        "--load-scatter",
        type=Quantity("percent", high=10.0, open_low=False),
        default=2.0,
        show_default=True,
        help="Sphere: standard deviation of each contact's own load, in percent.",
    ),
    click.option(
        "--record-loads",
        is_flag=True,
        help="Sphere: record the load that each contact had, read to 0.2 percent, in place of "
        "the nominal one.",
    ),
    click.option(
        "--position-error",
        type=Quantity("um", open_low=False),
        default=10.0,
        show_default=True,
        help="Sphere: standard deviation of each contact's own position, in um.",
    ),
    click.option(
        "--draw-inputs",
        is_flag=True,
        help="Sphere: draw the true film, radii and loads from their uncertainties; the files "
        "state the nominal ones, and the truth beside.",
    ),
    click.option(
        "--gain",
        type=Quantity("ratio"),
        default=1.0,
        show_default=True,
        help="Sphere: a mistake to be found, a factor on the voltages of the sphere's scans only.",
    ),
    click.option(
        "--thickness-factor",
        type=Quantity("ratio"),
        default=1.0,
        show_default=True,
        help="Sphere: a mistake to be found, the film's true thickness over the one stated.",
    ),
)


def sphere_options(command: _Command) -> _Command:
    """Add the options of an experiment with a sphere."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def experiment_from(given: Mapping[str, Any]) -> Experiment:
    """Simulate the experiment that the options describe."""
    film, rod = film_from(given), indenter_from("rod", given)
    radius = {
        "radius": given["sphere_radius"],
        "radius_uncertainty": given["sphere_radius_uncertainty"],
    }
    sphere = indenter_from("sphere", radius)
    interface = interface_of(given)
    from memscal.laboratory.experiment import simulate_experiment
    from memscal.model.indenter import Rod, Sphere

    assert isinstance(rod, Rod)
    assert isinstance(sphere, Sphere)
    return simulate_experiment(
        film=film,
        rod=rod,
        sphere=sphere,
        kernel=kernel_from(given),
        conversion_constant=si(given["conversion_constant"], -3),
        rod_points=given["points"],
        loads=given["loads"] or _LOADS,
        lubricated_loads=given["lubricated_loads"],
        friction=given["friction"],
        loading=given["loading"],
        interface=interface,
        points=given["contacts"],
        spacing=si(given["spacing"], -3),
        repeats=given["repeats"],
        noise=si(given["noise"], -2),
        load_scatter=si(given["load_scatter"], -2),
        record_loads=given["record_loads"],
        load_uncertainty=si(given["load_uncertainty"], -2),
        position_error=si(given["position_error"], -6),
        centre=(si(given["centre"], -3), si(given["centre_y"], -3)),
        baseline=si(given["baseline"], -2),
        drift=si(given["drift"], -2),
        state_noise=given["state_noise"],
        draw_inputs=given["draw_inputs"],
        gain=given["gain"],
        thickness_factor=given["thickness_factor"],
        seed=given["seed"],
    )
