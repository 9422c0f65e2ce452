"""``memscal reference``: a contact with the film, and the stress at its base."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from memscal.cli import output as out
from memscal.cli.options import (
    FILE,
    PAPER,
    NonNegative,
    Options,
    Quantity,
    figure_option,
    film_from,
    film_options,
    indenter_from,
    named,
    option,
    options_of,
    out_option,
    output_options,
    radius_options,
    repeatable,
)
from memscal.extensions import hook
from memscal.formats.files import together

if TYPE_CHECKING:
    from memscal.mechanics.contact import Contact
    from memscal.mechanics.interface import Interface
    from memscal.model.indenter import Indenter

#: The paper's rod and sphere, in m.
_RADIUS = {"rod": 0.25e-3, "sphere": 128.8e-3}
SHAPES = ("rod", "sphere", "cone", "profile")

# What each shape is described by; every other of these options belongs to another shape.
_DESCRIBED_BY = {
    "rod": "radius",
    "sphere": "radius",
    "cone": "inclination",
    "profile": "profile_table",
}
_ASPERITIES = (Quantity("um"), Quantity("1/mm^2"), Quantity("um"))

interface_options = options_of(
    option("--slip-length", NonNegative("um"), 0.0, show_default=False)(
        "Elastic tangential displacement of the interface before it slips, in um.  "
        "[default: 0, rigid]"
    ),
    option("--greenwood-tripp", _ASPERITIES, metavar="UM 1/MM^2 UM")(
        "Rough interface: rms height of the asperities (um), their number per mm^2, and the "
        "radius of their tips (um)."
    ),
    option("--exponential", (Quantity("um"), Quantity("MPa")), metavar="UM MPa")(
        "Rough interface: pressure that falls by e within a length (um), and its value where "
        "the mean planes meet (MPa)."
    ),
)
"""The options of a rough interface."""


def _indenter(shape: str, options: Options) -> Indenter:
    """Return the indenter that the options describe."""
    needed = _DESCRIBED_BY[shape]
    for name in sorted(set(_DESCRIBED_BY.values()) - {needed}):
        if options[name] is not None:
            raise click.UsageError(f"{named([name])} does not describe a {shape}.")
    if shape in _RADIUS:
        return indenter_from(shape, {**options, "radius": options["radius"] or _RADIUS[shape]})
    if options[needed] is None:
        raise click.UsageError(f"A {shape} needs {named([needed])}.")
    if shape == "cone":
        from memscal.model.indenter import Cone

        return Cone(inclination=math.radians(options["inclination"]))
    from memscal.formats.tables.text_table import read_indenter_table

    return read_indenter_table(
        options["profile_table"], r_unit=options["r_unit"], z_unit=options["z_unit"]
    )


def interface_of(options: Options) -> Interface:
    """Return the interface that the options describe."""
    from memscal.mechanics.interface import ExponentialCompliance, GreenwoodTripp, Interface

    asperities = options["greenwood_tripp"]
    exponential = options["exponential"]
    if asperities and exponential:
        raise click.UsageError("Give --greenwood-tripp or --exponential: one normal law.")
    normal: GreenwoodTripp | ExponentialCompliance | None = None
    if asperities:
        height, density, radius = asperities
        normal = GreenwoodTripp(roughness=height, asperity_density=density, asperity_radius=radius)
    if exponential:
        decay, pressure = exponential
        normal = ExponentialCompliance(decay_length=decay, reference_pressure=pressure)
    return Interface(normal=normal, slip_length=options["slip_length"])


EXAMPLES = """\b
Examples:
  memscal reference rod
  memscal reference rod --load 0.5 --load 1 --load 2
  memscal reference rod --film-law neo-hookean -o rubber.h5
  memscal reference sphere --load 0.34 --load 1.37 --load 2.75 --friction 0.3 --figure sphere.png
  memscal reference sphere --depth 20 --friction inf --loading total --backend fem --json
  memscal reference sphere --friction 1.6 --slip-length 1.82
  memscal reference cone --inclination 2 --load 0.5
  memscal reference profile --profile-table tip.csv --load 1
"""


@click.command("reference", epilog=EXAMPLES)
@click.argument("indenter", type=click.Choice(SHAPES))
@repeatable("--load loads", Quantity("N"))(
    "Normal load, in N. Repeated, a path: visited in the order given.  [default: 1, without "
    "--depth]"
)
@repeatable("--depth depths", Quantity("um"))(
    "Indentation depth, in um, in place of a load. May be repeated."
)
@radius_options("the rod or of the sphere's curvature", uncertainties=False)
@option("--inclination", Quantity("deg", high=89.0))(
    "Cone: angle between its face and the film, in degrees."
)
@option("--profile-table", FILE, metavar="TABLE")(
    "Profile: a delimited table of radius and height, from the axis outward."
)
@option("--r-unit", "UNIT")("Profile: unit of the radii.  [default: of the column's head, or mm]")
@option("--z-unit", "UNIT")("Profile: unit of the heights.  [default: of the head, or um]")
@option("--friction", NonNegative("ratio", infinite=True), metavar="MU")(
    "Friction coefficient between indenter and film; inf: it sticks wherever it touches.  "
    "[default: 0; inf of a rod on a film that is not linear]"
)
@option("--loading", ["incremental", "total"], "incremental")(
    "A point sticks where it first touched, or as if loaded in one step. The same under a rod."
)
@interface_options
@film_options(defaults={**PAPER, "film-law": None}, uncertainties=False)
@option("--backend", ["hankel", "fem"], "hankel")(
    "Hankel transforms on an infinite film, or finite elements on one with a free edge."
)
@option("--strain", ["linear", "finite"])(
    "finite: --film-law neo-hookean, unless another is given; linear: --film-law linear."
)
@option("--film-radius", Quantity("mm"))(
    "Radius of the film's free edge, in mm, for finite elements.  [default: 12 thicknesses "
    "from the contact]"
)
@option("--rings", click.IntRange(min=16))(
    "Rings from the axis to the largest contact.  [default: as many as it takes]"
)
@out_option("Reference file to write (memscal-reference); for one load or depth.")
@figure_option("Draw the contacts.")
@option("--mesh", FILE, metavar="FILE.vtu")(
    "Displacement and stress in the film, for ParaView (needs meshio); for finite elements "
    "and one load or depth."
)
@output_options
def command(indenter: str, as_json: bool, force: bool, **options: Any) -> None:
    """Press a rigid INDENTER on a bonded film: load, depth, contact, and stress at the base.

    Defaults are the paper's: a film of E = 2.2 MPa, Poisson's ratio 0.5 and thickness 2 mm; a
    rod of radius 0.25 mm, a sphere of radius 128.8 mm. Without --film-law the film is linear.
    """
    _check_usage(options)

    from memscal.formats.reference import write_reference
    from memscal.summaries.contact import contacts_table, depth_messages

    files = [options["output"], options["mesh"], *options["figures"]]
    out.prove_writable(files, force=force, inputs=[options["profile_table"]])
    output, mesh, *figures = files
    contacts = _pressed(indenter, options)
    drawn = out.rendered(partial(contacts[0].plot, beside=contacts[1:]), figures)
    messages, warnings = depth_messages(contacts)
    with together():
        if mesh is not None:
            hook("write_mesh")(contacts[0].mesh(), mesh, overwrite=force)
        if output is not None:
            write_reference(contacts[0].profile(), output, overwrite=force)
        out.write_files(drawn, force=force)
        if as_json:
            # A rod's contact does not depend on the loading that was asked for.
            loading = {"loading": options["loading"]}
            out.emit_json(
                {
                    "schema_version": "1",
                    "output": output and str(output),
                    "solutions": [contact.to_dict() | loading for contact in contacts],
                    "warnings": warnings,
                }
            )
        else:
            out.emit_tables(contacts_table(contacts))
    out.show_messages(messages)
    out.say_written(files)


def _check_usage(options: Options) -> None:
    """Refuse options that do not go together; choose the film's law where none is given."""
    loads = options["loads"]
    depths = options["depths"]
    mesh = options["mesh"]
    if loads and depths:
        raise click.UsageError("Give --load or --depth, not both: one follows from the other.")
    for name in ("output", "mesh"):
        if options[name] is not None and max(len(loads), len(depths)) > 1:
            raise click.UsageError(
                f"A file holds one load: with --{name} give one --load or one --depth."
            )
    law = options["film_law"]
    strain = options["strain"]
    if strain == "linear":
        options |= {"film_law": "linear", "mooney_rivlin_ratio": None}
    elif strain == "finite" and law == "linear":
        raise click.UsageError("--film-law linear has no finite strain: leave --strain out.")
    else:
        options["film_law"] = law or ("neo-hookean" if strain else "linear")
    if mesh is not None and options["backend"] != "fem" and options["film_law"] == "linear":
        raise click.UsageError("--mesh shows finite elements: add --backend fem.")
    if mesh is not None and mesh.suffix.lower() != ".vtu":
        raise click.UsageError(f"{mesh} does not end in .vtu, the format of --mesh.")


def _pressed(indenter: str, options: Options) -> list[Contact]:
    from memscal.mechanics.indent import indent

    film = film_from(options)
    body = _indenter(indenter, options)
    linear = film.law == "linear"
    friction = options["friction"]
    if friction is None:
        # A film that slides is drawn out from under a rod, and is not solved to any depth.
        friction = math.inf if indenter == "rod" and not linear else 0.0
    depths = options["depths"]
    loads = None if depths else options["loads"] or (1.0,)
    with out.working("Pressing"):
        return indent(
            film,
            body,
            load=loads,
            depth=depths or None,
            friction=friction,
            interface=interface_of(options),
            **{name: options[name] for name in ("loading", "backend", "rings", "film_radius")},
            strain="linear" if linear else "finite",
        )
