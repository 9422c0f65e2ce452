"""``memscal simulate``: a synthetic scan, or a whole experiment, whose truth is known."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from memscal.cli.failures import DONE, debug_option
from memscal.cli.options import (
    FILE,
    Quantity,
    film_from,
    film_options,
    force_option,
    indenter_from,
    json_option,
    kernel_from,
    kernel_options,
    radius_options,
    require_one_kernel,
    si,
)
from memscal.cli.output import emit_json, message, note, prove_writable
from memscal.cli.reference import interface_of, interface_options

if TYPE_CHECKING:
    from memscal.model.scan import Scan
    from memscal.simulation.experiment import Experiment

__all__ = [
    "FILES",
    "NAMES",
    "command",
    "experiment_from",
    "sphere_options",
    "tell_experiment",
    "tell_scan",
]

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
    from memscal.model.indenter import Rod, Sphere
    from memscal.simulation.experiment import simulate_experiment

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


def tell_scan(scan: Scan, output: Path, as_json: bool) -> None:
    """Print the truth of one scan."""
    if as_json:
        emit_json({"schema_version": "1", **_described(scan, output)})
        return
    from memscal.cli.output import emit_tables
    from memscal.summaries.table import Table

    rows = [
        ("kind", scan.kind),
        ("points", _shape(scan)),
        *(_entry(*item) for item in dict(scan.synthetic or {}).items()),
    ]
    emit_tables(Table("Synthetic scan (calculated, not measured) and its truth", ("", ""), rows))


def tell_experiment(scans: Mapping[Path, Scan], as_json: bool) -> None:
    """Print the truth of an experiment, one column for each scan."""
    if as_json:
        described = [_described(scan, path) for path, scan in scans.items()]
        emit_json({"schema_version": "1", "synthetic": True, "scans": described})
        return
    from memscal.cli.output import emit_tables
    from memscal.summaries.table import Table

    truths = [dict(scan.synthetic or {}) for scan in scans.values()]
    names: list[str] = []
    for truth in sorted(truths, key=len, reverse=True):
        names += [name for name in truth if name not in names]
    rows: list[Sequence[str]] = [
        ("kind", *(scan.kind for scan in scans.values())),
        ("points", *(_shape(scan) for scan in scans.values())),
    ]
    for name in names:
        words = next(_entry(name, truth[name])[0] for truth in truths if name in truth)
        values = (_entry(name, truth[name])[1] if name in truth else "-" for truth in truths)
        rows.append((words, *values))
    head = ("", *(path.name for path in scans))
    emit_tables(Table("Synthetic experiment (calculated, not measured) and its truth", head, rows))


def _described(scan: Scan, path: Path) -> dict[str, Any]:
    return {
        "scan": str(path),
        "synthetic": True,
        "kind": scan.kind,
        "shape": list(scan.u_zz.shape),
        "truth_si": {name: _standard(value) for name, value in (scan.synthetic or {}).items()},
    }


def _standard(value: float | str) -> float | str:
    """Return what standard JSON can say: a friction that always sticks is ``"inf"``."""
    return "inf" if value == float("inf") else value


def _shape(scan: Scan) -> str:
    return " x ".join(str(n) for n in scan.u_zz.shape)


def _entry(name: str, value: float | str) -> tuple[str, str]:
    """Return a truth in words, and with its unit."""
    if isinstance(value, str):
        return name.replace("_", " "), value
    if name.startswith("load_") and name.removeprefix("load_").isdigit():
        return f"true load {name.removeprefix('load_')}", f"{value:.6g} N"
    from memscal.model.quantities import TRUTH, estimated_quantity

    shown = TRUTH.get(name) or estimated_quantity(name)
    return shown.words, f"{value / shown.scale:.6g} {shown.unit}".rstrip()


#: The paper's film as the virtual laboratory has it, in the units of the command line.
FILM = {
    "young-modulus": 2.2,
    "poisson-ratio": 0.5,
    "thickness": 2.0,
    "young-modulus-uncertainty": 0.1,
    "poisson-ratio-uncertainty": 0.005,
    "thickness-uncertainty": 0.02,
}

_ROD_NAMES = ("half_range", "raster")
"""The options that only a rod scan alone has."""

_SHARE = Quantity("percent", open_low=False)
_SIGNED_SHARE = Quantity("percent", low=-math.inf)
_POSITION = Quantity("mm", low=-math.inf)

EXAMPLES = """\b
Examples:
  memscal simulate -o scan.h5
  memscal simulate -o scan.h5 --points 33 --noise 0.5 --seed 7
  memscal simulate -o loads.h5 --load 0.5 --load 1 --load 2 --repeats 3
  memscal simulate -o raster.h5 --raster --points 33 --half-range 6
  memscal simulate -o ring.h5 --sigma 700 --weight 1.5 --sigma 400 --weight -0.5
  memscal simulate -o disc.h5 --disc-radius 800 --sigma 300

\b
Examples of an experiment: a rod scan to calibrate with, and a sphere's contacts to measure:
  memscal simulate --experiment sphere -o experiment
  memscal simulate --experiment sphere -o sticky --friction inf --draw-inputs --seed 7
  memscal simulate --experiment sphere -o rough --friction 1.6 --slip-length 1.82
  memscal simulate --experiment sphere -o wrong --gain 1.05
"""


@click.command("simulate", epilog=EXAMPLES)
@click.option(
    "--experiment",
    type=click.Choice(["rod", "sphere"]),
    default="rod",
    show_default=True,
    help="A rod scan; or a whole experiment with a sphere: a rod scan, and scans of the sphere's "
    "contacts, dry and lubricated.",
)
@click.option(
    "-o",
    "--output",
    type=FILE,
    metavar="SCAN|FOLDER",
    help="Scan to write (memscal-scan), or the folder of an experiment's three scans.  "
    "[default: synthetic_scan.h5, or synthetic_experiment]",
)
@kernel_options
@click.option(
    "--load",
    "loads",
    type=Quantity("N"),
    multiple=True,
    help="Normal load, in N. Repeated: one scan at each.  [default: 1; of a sphere's dry contacts "
    "0.34, 0.69, 1.37 and 2.75]",
)
@radius_options(default=0.25, uncertainty=0.0025)
@film_options(defaults=FILM)
@click.option(
    "--half-range",
    type=Quantity("mm"),
    default=8.0,
    show_default=True,
    help="Rod scan alone: positions run from minus to plus this, in mm.",
)
@click.option(
    "--points",
    type=click.IntRange(min=2, max=4096),
    default=65,
    show_default=True,
    help="Positions of the rod along each axis.",
)
@click.option(
    "--repeats",
    type=click.IntRange(min=1, max=4096),
    default=1,
    show_default=True,
    help="Repeats at each load; with a sphere, of its contacts.",
)
@click.option("--raster", is_flag=True, help="Rod scan alone: a square instead of a line.")
@click.option(
    "--noise",
    type=_SHARE,
    default=0.5,
    show_default=True,
    help="Standard deviation of the noise, in percent of the largest signal.",
)
@click.option(
    "--centre",
    type=_POSITION,
    default=0.14,
    show_default=True,
    help="Position of the sensor along the scan, in mm.",
)
@click.option(
    "--centre-y",
    type=_POSITION,
    default=0.0,
    show_default=True,
    help="Its position across the scan, in mm.",
)
@click.option(
    "--baseline",
    type=_SIGNED_SHARE,
    default=1.0,
    show_default=True,
    help="Offset of the voltage, in percent of the largest signal.",
)
@click.option(
    "--drift",
    type=_SIGNED_SHARE,
    default=0.5,
    show_default=True,
    help="Change of the offset across the scan, in percent of the largest signal.",
)
@click.option(
    "--load-uncertainty",
    type=_SHARE,
    default=1.0,
    show_default=True,
    help="Standard uncertainty to state for the load, in percent.",
)
@click.option(
    "--state-noise/--no-state-noise",
    default=True,
    show_default=True,
    help="Whether the scan states its noise (u_zz_errors).",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    metavar="N",
    help="Seed of the noise.",
)
@sphere_options
@json_option
@force_option
@debug_option
def command(experiment: str, output: Path | None, as_json: bool, force: bool, **given: Any) -> int:
    """Make a synthetic scan, or the scans of an experiment, from a known apparatus function.

    The base stress of a frictionless rod on the bonded film, or of a sphere's contacts, is
    convolved with the apparatus function; noise, an offset and a drift are added. Every file is
    labelled as synthetic and holds its truth. What the options do not say is the paper's.
    """
    _check_usage(experiment, given)
    if experiment == "sphere":
        return _sphere(output or Path("synthetic_experiment"), given, as_json, force)
    output = output or Path("synthetic_scan.h5")
    prove_writable([output], force=force)
    scan = _simulate(given)

    from memscal.formats.scan import write_scan

    write_scan(scan, output, overwrite=force)
    tell_scan(scan, output, as_json)
    note("The scan is synthetic: nothing in it was measured.")
    message(f"Written: {output}")
    return DONE


def _check_usage(experiment: str, given: Mapping[str, Any]) -> None:
    """Refuse options that contradict each other, or belong to the other experiment."""
    context = click.get_current_context()
    typed = ParameterSource.COMMANDLINE
    others = NAMES if experiment == "rod" else _ROD_NAMES
    strange = [name for name in others if context.get_parameter_source(name) == typed]
    if strange:
        options = [
            option.opts[0]
            for option in context.command.params
            if isinstance(option, click.Option) and option.name in strange
        ]
        other = "sphere" if experiment == "rod" else "rod"
        belongs = "belongs" if len(options) == 1 else "belong"
        raise click.UsageError(f"{', '.join(options)} {belongs} to --experiment {other}.")
    require_one_kernel(given)
    if given["raster"] and max(len(given["loads"]), 1) * given["repeats"] > 1:
        raise click.UsageError("A raster has one repeat at one load.")
    for name in ("loads", "lubricated_loads"):
        if experiment == "sphere" and len(set(given[name])) < len(given[name]):
            raise click.UsageError(
                "A load of the sphere is given twice: give it once, and --repeats."
            )


def _sphere(folder: Path, given: Mapping[str, Any], as_json: bool, force: bool) -> int:
    from memscal.formats.scan import ensure_folder_writable, write_scans

    ensure_folder_writable(folder, FILES, overwrite=force)
    experiment = experiment_from(given)
    scans = {f"{name}.h5": scan for name, scan in experiment.scans.items()}
    write_scans(scans, folder, overwrite=force)
    tell_experiment({folder / name: scan for name, scan in scans.items()}, as_json)
    note("The scans are synthetic: nothing in them was measured.")
    message(f"Written: {', '.join(str(folder / name) for name in scans)}")
    return DONE


def _simulate(given: Mapping[str, Any]) -> Scan:
    from memscal.model.indenter import Rod
    from memscal.simulation.rod_scan import simulate

    film, rod = film_from(given), indenter_from("rod", given)
    assert isinstance(rod, Rod)
    loads = given["loads"] or (1.0,)
    return simulate(
        film=film,
        rod=rod,
        kernel=kernel_from(given),
        conversion_constant=si(given["conversion_constant"], -3),
        load=loads[0] if len(loads) == 1 else loads,
        half_range=si(given["half_range"], -3),
        points=given["points"],
        repeats=given["repeats"],
        raster=given["raster"],
        noise=si(given["noise"], -2),
        centre=(si(given["centre"], -3), si(given["centre_y"], -3)),
        baseline=si(given["baseline"], -2),
        drift=si(given["drift"], -2),
        load_uncertainty=si(given["load_uncertainty"], -2),
        state_noise=given["state_noise"],
        seed=given["seed"],
    )
