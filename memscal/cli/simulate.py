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
from memscal.cli.output import emit_json, emit_tables, message, note, prove_writable
from memscal.cli.reference import interface_of, interface_options

if TYPE_CHECKING:
    from memscal.model.scan import Scan
    from memscal.simulation.experiment import Experiment

__all__ = ["FILES", "NAMES", "command", "number_option"]

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


def number_option(
    name: str, unit: str, default: float, about: str, **limits: Any
) -> Callable[[_Command], _Command]:
    """Return the option of a number in a unit, whose default is shown."""
    kind = Quantity(unit, **limits)
    return click.option(name, type=kind, default=default, show_default=True, help=about)


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
    number_option("--sphere-radius", "mm", 128.8, "Sphere: radius of curvature, in mm."),
    number_option(
        "--sphere-radius-uncertainty",
        "mm",
        0.5,
        "Sphere: standard uncertainty (k = 1) of its radius, in mm.",
        open_low=False,
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
    number_option("--spacing", "mm", 0.5, "Sphere: distance of neighbouring contacts, in mm."),
    number_option(
        "--load-scatter",
        "percent",
        2.0,
        "Sphere: standard deviation of each contact's own load, in percent.",
        high=10.0,
        open_low=False,
    ),
    click.option(
        "--record-loads",
        is_flag=True,
        help="Sphere: record the load that each contact had, read to 0.2 percent, in place of "
        "the nominal one.",
    ),
    number_option(
        "--position-error",
        "um",
        10.0,
        "Sphere: standard deviation of each contact's own position, in um.",
        open_low=False,
    ),
    click.option(
        "--draw-inputs",
        is_flag=True,
        help="Sphere: draw the true film, radii and loads from their uncertainties; the files "
        "state the nominal ones, and the truth beside.",
    ),
    number_option(
        "--gain",
        "ratio",
        1.0,
        "Sphere: a mistake to be found, a factor on the voltages of the sphere's scans only.",
    ),
    number_option(
        "--thickness-factor",
        "ratio",
        1.0,
        "Sphere: a mistake to be found, the film's true thickness over the one stated.",
    ),
)


def _sphere_options(command: _Command) -> _Command:
    """Add the options of an experiment with a sphere."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def _experiment_from(options: Mapping[str, Any]) -> Experiment:
    """Simulate the experiment that the options describe."""
    film, rod = film_from(options), indenter_from("rod", options)
    radius = {
        "radius": options["sphere_radius"],
        "radius_uncertainty": options["sphere_radius_uncertainty"],
    }
    sphere = indenter_from("sphere", radius)
    interface = interface_of(options)
    from memscal.model.indenter import Rod, Sphere
    from memscal.simulation.experiment import simulate_experiment

    assert isinstance(rod, Rod)
    assert isinstance(sphere, Sphere)
    return simulate_experiment(
        film=film,
        rod=rod,
        sphere=sphere,
        kernel=kernel_from(options),
        conversion_constant=si(options["conversion_constant"], -3),
        rod_points=options["points"],
        loads=options["loads"] or _LOADS,
        lubricated_loads=options["lubricated_loads"],
        friction=options["friction"],
        loading=options["loading"],
        interface=interface,
        points=options["contacts"],
        spacing=si(options["spacing"], -3),
        repeats=options["repeats"],
        noise=si(options["noise"], -2),
        load_scatter=si(options["load_scatter"], -2),
        record_loads=options["record_loads"],
        load_uncertainty=si(options["load_uncertainty"], -2),
        position_error=si(options["position_error"], -6),
        centre=(si(options["centre"], -3), si(options["centre_y"], -3)),
        baseline=si(options["baseline"], -2),
        drift=si(options["drift"], -2),
        state_noise=options["state_noise"],
        draw_inputs=options["draw_inputs"],
        gain=options["gain"],
        thickness_factor=options["thickness_factor"],
        seed=options["seed"],
    )


def _print_truth(scans: Mapping[Path, Scan], title: str) -> None:
    """Print the truth of scans, one column for each."""
    from memscal.summaries.table import Table

    truths = [dict(scan.synthetic or {}) for scan in scans.values()]
    names = dict.fromkeys(name for truth in sorted(truths, key=len, reverse=True) for name in truth)
    rows: list[Sequence[str]] = [
        ("kind", *(scan.kind for scan in scans.values())),
        ("points", *(" x ".join(map(str, scan.u_zz.shape)) for scan in scans.values())),
    ]
    for name in names:
        words = next(_entry(name, truth[name])[0] for truth in truths if name in truth)
        values = (_entry(name, truth[name])[1] if name in truth else "-" for truth in truths)
        rows.append((words, *values))
    head = ("", *(path.name if len(scans) > 1 else "" for path in scans))
    emit_tables(Table(f"Synthetic {title} (calculated, not measured) and its truth", head, rows))


def _described(scan: Scan, path: Path) -> dict[str, Any]:
    return {
        "scan": str(path),
        "synthetic": True,
        "kind": scan.kind,
        "shape": list(scan.u_zz.shape),
        "truth_si": {name: _standard(value) for name, value in (scan.synthetic or {}).items()},
    }


def _standard(value: float | str) -> float | str:
    """Return a value of standard JSON: infinite friction is ``"inf"``."""
    return "inf" if value == float("inf") else value


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
@number_option(
    "--half-range", "mm", 8.0, "Rod scan alone: positions run from minus to plus this, in mm."
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
@number_option(
    "--noise",
    "percent",
    0.5,
    "Standard deviation of the noise, in percent of the largest signal.",
    open_low=False,
)
@number_option(
    "--centre", "mm", 0.14, "Position of the sensor along the scan, in mm.", low=-math.inf
)
@number_option("--centre-y", "mm", 0.0, "Its position across the scan, in mm.", low=-math.inf)
@number_option(
    "--baseline",
    "percent",
    1.0,
    "Offset of the voltage, in percent of the largest signal.",
    low=-math.inf,
)
@number_option(
    "--drift",
    "percent",
    0.5,
    "Change of the offset across the scan, in percent of the largest signal.",
    low=-math.inf,
)
@number_option(
    "--load-uncertainty",
    "percent",
    1.0,
    "Standard uncertainty to state for the load, in percent.",
    open_low=False,
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
@_sphere_options
@json_option
@force_option
@debug_option
def command(
    experiment: str, output: Path | None, as_json: bool, force: bool, **options: Any
) -> int:
    """Make a synthetic scan, or the scans of an experiment, from a known apparatus function.

    The base stress of a frictionless rod on the bonded film, or of a sphere's contacts, is
    convolved with the apparatus function; noise, an offset and a drift are added. Every file is
    labelled as synthetic and holds its truth. Defaults are the paper's.
    """
    _check_usage(experiment, options)
    if experiment == "sphere":
        return _sphere(output or Path("synthetic_experiment"), options, as_json, force)
    output = output or Path("synthetic_scan.h5")
    prove_writable([output], force=force)
    scan = _simulate(options)

    from memscal.formats.scan import write_scan

    write_scan(scan, output, overwrite=force)
    if as_json:
        emit_json({"schema_version": "1", **_described(scan, output)})
    else:
        _print_truth({output: scan}, "scan")
    note("The scan is synthetic: nothing in it was measured.")
    message(f"Written: {output}")
    return DONE


def _check_usage(experiment: str, options: Mapping[str, Any]) -> None:
    """Refuse options that contradict each other, or belong to the other experiment."""
    context = click.get_current_context()
    typed = ParameterSource.COMMANDLINE
    others = NAMES if experiment == "rod" else _ROD_NAMES
    strange = [name for name in others if context.get_parameter_source(name) == typed]
    if strange:
        names = [
            option.opts[0]
            for option in context.command.params
            if isinstance(option, click.Option) and option.name in strange
        ]
        other = "sphere" if experiment == "rod" else "rod"
        belongs = "belongs" if len(names) == 1 else "belong"
        raise click.UsageError(f"{', '.join(names)} {belongs} to --experiment {other}.")
    require_one_kernel(options)
    if options["raster"] and max(len(options["loads"]), 1) * options["repeats"] > 1:
        raise click.UsageError("A raster has one repeat at one load.")
    for name in ("loads", "lubricated_loads"):
        if experiment == "sphere" and len(set(options[name])) < len(options[name]):
            raise click.UsageError(
                "A load of the sphere is given twice: give it once, and --repeats."
            )


def _sphere(folder: Path, options: Mapping[str, Any], as_json: bool, force: bool) -> int:
    from memscal.formats.scan import ensure_folder_writable, write_scans

    ensure_folder_writable(folder, FILES, overwrite=force)
    experiment = _experiment_from(options)
    scans = {folder / f"{name}.h5": scan for name, scan in experiment.scans.items()}
    write_scans({path.name: scan for path, scan in scans.items()}, folder, overwrite=force)
    if as_json:
        described = [_described(scan, path) for path, scan in scans.items()]
        emit_json({"schema_version": "1", "synthetic": True, "scans": described})
    else:
        _print_truth(scans, "experiment")
    note("The scans are synthetic: nothing in them was measured.")
    message(f"Written: {', '.join(map(str, scans))}")
    return DONE


def _simulate(options: Mapping[str, Any]) -> Scan:
    from memscal.model.indenter import Rod
    from memscal.simulation.rod_scan import simulate

    film, rod = film_from(options), indenter_from("rod", options)
    assert isinstance(rod, Rod)
    loads = options["loads"] or (1.0,)
    return simulate(
        film=film,
        rod=rod,
        kernel=kernel_from(options),
        conversion_constant=si(options["conversion_constant"], -3),
        load=loads[0] if len(loads) == 1 else loads,
        half_range=si(options["half_range"], -3),
        points=options["points"],
        repeats=options["repeats"],
        raster=options["raster"],
        noise=si(options["noise"], -2),
        centre=(si(options["centre"], -3), si(options["centre_y"], -3)),
        baseline=si(options["baseline"], -2),
        drift=si(options["drift"], -2),
        load_uncertainty=si(options["load_uncertainty"], -2),
        state_noise=options["state_noise"],
        seed=options["seed"],
    )
