"""``memscal simulate``: a synthetic scan, or a whole experiment, whose truth is known."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from inspect import signature
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from memscal.cli.options import (
    FILE,
    FREE_OR_STUCK,
    PAPER,
    POSITION,
    NonNegative,
    Options,
    Quantity,
    film_from,
    film_options,
    flag,
    indenter_from,
    kernel_from,
    kernel_options,
    laboratory_option,
    option,
    options_of,
    output_options,
    radius_options,
    repeatable,
    rod_friction_option,
    with_laboratory,
)
from memscal.cli.output import emit_json, emit_tables, message, note, prove_writable, working
from memscal.cli.reference import interface_of, interface_options
from memscal.errors import OutputError
from memscal.formats.files import ensure_writable, together
from memscal.summaries.table import Table

if TYPE_CHECKING:
    from memscal.model import quantities
    from memscal.model.scan import Scan

FILES = ("rod_scan.h5", "sphere_dry.h5", "sphere_lubricated.h5")
"""The files of an experiment; a test compares them with the names of its scans."""

_LOADS = (0.34, 0.69, 1.37, 2.75)


_POSITIONS = click.IntRange(min=2, max=4096)


def _rows_and_columns(_: Any, __: Any, text: str | None) -> tuple[int, int] | None:
    """Return both numbers of a text such as 4x4."""
    if text is None:
        return None
    sizes = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text)
    if sizes is None:
        raise click.BadParameter(f"{text!r} is not rows x columns, such as 4x4.")
    return int(sizes[1]), int(sizes[2])


_sphere_options = options_of(
    repeatable("--lubricated-load lubricated_loads", Quantity("N"), (0.69, 2.75))(
        "Sphere: load of the lubricated contacts, in N. May be repeated."
    ),
    option("--sphere-radius", Quantity("mm"), 128.8)("Sphere: radius of curvature, in mm."),
    option("--sphere-radius-uncertainty", NonNegative("mm"), 0.5)(
        "Sphere: standard uncertainty (k = 1) of its radius, in mm."
    ),
    option("--friction", NonNegative("ratio", infinite=True), 0.2, metavar="MU")(
        "Sphere: friction coefficient of the dry contacts; inf: they stick wherever they touch."
    ),
    option("--loading", ["incremental", "total"], "incremental")(
        "Sphere: a point sticks where it first touched, or as if loaded in one step."
    ),
    interface_options,
    option("--contacts", _POSITIONS, 33)("Sphere: contacts in a row."),
    option("--spacing", Quantity("mm"), 0.5)("Sphere: distance of neighbouring contacts, in mm."),
    option("--load-scatter", NonNegative("percent", high=10.0), 2.0)(
        "Sphere: standard deviation of each contact's own load, in percent."
    ),
    flag("--record-loads")(
        "Sphere: record the load that each contact had, read to 0.2 percent, in place of "
        "the nominal one."
    ),
    option("--position-error", NonNegative("um"), 10.0)(
        "Sphere: standard deviation of each contact's own position, in um."
    ),
    flag("--draw-inputs")(
        "Sphere: draw the true film, radii and loads from their uncertainties; the files "
        "state the nominal ones, and the truth beside."
    ),
    flag("--one-load-cell")(
        "Sphere: its loads and the rod's have one common error, and the scans name one load cell."
    ),
    option("--gain", Quantity("ratio"), 1.0)(
        "Sphere: a deliberate error, a factor on the voltages of the sphere's scans only."
    ),
    option("--thickness-factor", Quantity("ratio"), 1.0)(
        "Sphere: a deliberate error, the film's true thickness over the one stated."
    ),
)

_SPHERE = click.Command("sphere")
_sphere_options(_SPHERE)
_SPHERE_NAMES = [each.name for each in _SPHERE.params]
"""The options that only an experiment with a sphere has."""


def _settings(function: Callable[..., Any], options: Options) -> Options:
    """Return the arguments that options are of a function, by their names."""
    from memscal.extensions.simulation.disturbances import Disturbances

    stated = _arguments(Disturbances, options)
    stated["centre"] = (options["centre"], options["centre_y"])
    return {
        **_arguments(function, options),
        "film": film_from(options),
        "rod": indenter_from("rod", options),
        "kernel": kernel_from(options),
        "disturbances": Disturbances(**stated),
    }


def _arguments(function: Callable[..., Any], options: Options) -> Options:
    return {name: options[name] for name in signature(function).parameters if name in options}


def _print_truth(scans: Mapping[Path, Scan], title: str) -> None:
    """Print the truth of scans, one column for each, and of the sensors of an array."""
    from memscal.extensions.simulation.sensor_array import OF_SENSORS

    truths = [dict(scan.synthetic or {}) for scan in scans.values()]
    names = dict.fromkeys(chain(*sorted(truths, key=len, reverse=True)))
    rows = [
        ("kind", *(scan.kind for scan in scans.values())),
        ("points", *(" x ".join(map(str, scan.u_zz.shape)) for scan in scans.values())),
    ]
    sensors = [name.lower() for scan in scans.values() for name in scan.sensors]
    for name in names:
        if name.rpartition("_")[2] in sensors:
            continue
        words = next(_entry(name, truth[name])[0] for truth in truths if name in truth)
        values = (_entry(name, truth[name])[1] if name in truth else "-" for truth in truths)
        rows.append((words, *values))
    head = ("", *(path.name if len(scans) > 1 else "" for path in scans))
    known = [
        [s.upper(), *(_entry(n, truths[0][f"{n}_{s}"])[1] for n in OF_SENSORS)] for s in sensors
    ]
    emit_tables(
        Table(f"Synthetic {title} (calculated, not measured) and its truth", head, rows),
        Table("Sensors of the array", ("", "A", "x", "y"), known),
    )


def _described(scan: Scan, path: Path) -> Options:
    return {
        "scan": str(path),
        "synthetic": True,
        "kind": scan.kind,
        "shape": scan.u_zz.shape,
        "truth": {name: _member(name, value) for name, value in (scan.synthetic or {}).items()},
    }


def _member(name: str, value: float | str) -> Any:
    """Return a truth as JSON holds it: text, also of what is infinite, or a number and its unit."""
    if name == "seed":
        return int(value)
    if isinstance(value, str) or value == math.inf:
        return str(value)
    quantity = _quantity(name)
    return {"value": value / quantity.scale, "unit": quantity.unit_text}


def _entry(name: str, value: float | str) -> tuple[str, str]:
    """Return a truth in words, and with its unit."""
    if isinstance(value, str):
        return name.replace("_", " "), value
    shown = _quantity(name)
    return shown.words, f"{value / shown.scale:.6g} {shown.unit}".rstrip()


def _quantity(name: str) -> quantities.Quantity:
    from memscal.model.quantities import TRUTH, estimated_quantity

    # That of a load or of a sensor ends with its number or name.
    start, _, which = name.rpartition("_")
    if start in TRUTH and name not in TRUTH:
        return replace(TRUTH[start], words=f"{TRUTH[start].words} {which}")
    return TRUTH.get(name) or estimated_quantity(name)


_ROD_NAMES = ("half_range", "raster", "array", "pitch", "crosstalk", "lab")
"""The options that only a rod scan alone has."""

EXAMPLES = """\b
Examples:
  memscal simulate -o scan.h5
  memscal simulate -o scan.h5 --points 33 --noise 0.5 --seed 7
  memscal simulate -o loads.h5 --load 0.1 --load 0.3 --load 1 --repeats 3
  memscal simulate -o raster.h5 --raster --points 33 --half-range 6
  memscal simulate -o ring.h5 --sigma 700 --weight 1.5 --sigma 400 --weight -0.5
  memscal simulate -o disc.h5 --disc-radius 800 --sigma 300
  memscal simulate -o array.h5 --array 4x4 --pitch 2 --crosstalk 0.01

\b
Examples of an experiment: a rod scan to calibrate with, and a sphere's contacts to measure:
  memscal simulate --experiment sphere -o experiment
  memscal simulate --experiment sphere -o sticky --friction inf --draw-inputs --seed 7
  memscal simulate --experiment sphere -o rough --friction 1.6 --slip-length 1.82
  memscal simulate --experiment sphere -o wrong --gain 1.05
"""


@click.command("simulate", epilog=EXAMPLES)
@option("--experiment", ["rod", "sphere"], "rod")(
    "A rod scan; or a whole experiment with a sphere: a rod scan, and scans of the sphere's "
    "contacts, dry and lubricated."
)
@option("-o --output", FILE, metavar="SCAN|FOLDER")(
    "Scan to write (memscal-scan), or the folder of an experiment's three scans.  "
    "[default: synthetic_scan.h5, or synthetic_experiment]"
)
@kernel_options
@repeatable("--load loads", Quantity("N"))(
    "Normal load, in N. Repeated: one scan at each.  [default: 1; of a sphere's dry contacts "
    "0.34, 0.69, 1.37 and 2.75]"
)
@radius_options(defaults=PAPER)
@film_options(defaults=PAPER)
@rod_friction_option(FREE_OR_STUCK)
@option("--half-range", Quantity("mm"))(
    "Rod scan alone: positions run from minus to plus this, in mm.  [default: 8; of an array 2.5 "
    "film thicknesses beyond its last sensors]"
)
@option("--points", _POSITIONS)(
    "Positions of the rod along each axis.  [default: 65; of an array in steps of an eighth of "
    "the film's thickness, of a quarter in a raster]"
)
@option("--repeats", click.IntRange(min=1, max=4096), 1)(
    "Repeats at each load; with a sphere, of its contacts."
)
@flag("--raster")(
    "Rod scan alone: a square instead of a line, as several rows of sensors always are."
)
@option("--array", "ROWSxCOLUMNS", callback=_rows_and_columns)(
    "Rod scan alone: rows and columns of sensors under one film, such as 1x10 or 4x4."
)
@option("--pitch", Quantity("mm"), 2.0)("Array: distance of neighbouring sensors, in mm.")
@option("--crosstalk", Quantity("ratio", low=-math.inf), 0.0)(
    "Array: share of a neighbour's signal that a sensor reads, such as 0.01."
)
@option("--noise", NonNegative("percent"), 0.5)(
    "Standard deviation of the noise, in percent of the largest signal."
)
@option("--centre", POSITION, 0.14)("Position of the sensor along the scan, in mm.")
@option("--centre-y", POSITION, 0.0)("Its position across the scan, in mm.")
@option("--baseline", Quantity("percent", low=-math.inf), 1.0)(
    "Offset of the voltage, in percent of the largest signal."
)
@option("--drift", Quantity("percent", low=-math.inf), 0.5)(
    "Change of the offset across the scan, in percent of the largest signal."
)
@option("--load-uncertainty", NonNegative("percent"), 1.0)(
    "Standard uncertainty to state for the load, in percent."
)
@option("--state-noise/--no-state-noise", default=True)(
    "Whether the scan states its noise (u_zz_errors)."
)
@option("--state-law/--no-state-law", default=True)(
    "Whether the scan states the film's law and the rod's friction."
)
@option("--seed", click.IntRange(min=0), 0, metavar="N")("Seed of the noise.")
@laboratory_option("Rod scan alone: ")
@_sphere_options
@output_options
def command(
    experiment: str, output: Path | None, as_json: bool, force: bool, **options: Any
) -> None:
    """Make a synthetic scan, or the scans of an experiment, from a known apparatus function.

    The base stress of a rod on the bonded film, or of a sphere's contacts, is convolved with the
    apparatus function; noise, an offset and a drift are added. Under the rod the film follows
    --film-law, under the sphere linear elasticity. Every file is labelled as synthetic and holds
    its truth. Defaults are the paper's.
    """
    _check_usage(experiment, options)
    if experiment == "sphere":
        _sphere(output or Path("synthetic_experiment"), options, as_json, force)
        return
    output = output or Path("synthetic_scan.h5")
    laboratory = options["lab"]
    prove_writable([output], force=force, inputs=[laboratory])

    from memscal.extensions.simulation.rod_scan import simulate
    from memscal.formats.scan import write_scan
    from memscal.model.instrument import StressSensor

    with working("Simulating"):
        scan = simulate(load=options["loads"] or 1.0, **_settings(simulate, options))
    if laboratory:
        scan = with_laboratory(laboratory, replace(scan, sensor=StressSensor()))
    with together():
        write_scan(scan, output, overwrite=force)
        if as_json:
            emit_json({"schema_version": "1", **_described(scan, output)})
        else:
            _print_truth({output: scan}, "scan")
    note("The scan is synthetic: nothing in it was measured.")
    message(f"Written: {output}")


def _check_usage(experiment: str, options: Options) -> None:
    context = click.get_current_context()
    typed = ParameterSource.COMMANDLINE
    others = _SPHERE_NAMES if experiment == "rod" else _ROD_NAMES
    given = [name for name in others if context.get_parameter_source(name) == typed]
    names = [param.opts[0] for param in context.command.params if param.name in given]
    if names:
        other = "sphere" if experiment == "rod" else "rod"
        belongs = "belongs" if len(names) == 1 else "belong"
        raise click.UsageError(f"{', '.join(names)} {belongs} to --experiment {other}.")
    for name in ("pitch", "crosstalk"):
        if not options["array"] and context.get_parameter_source(name) == typed:
            raise click.UsageError(f"--{name} belongs to --array, which says how many sensors.")
    if options["raster"] and max(len(options["loads"]), 1) * options["repeats"] > 1:
        raise click.UsageError("A raster has one repeat at one load.")
    for name in ("loads", "lubricated_loads"):
        if experiment == "sphere" and len(set(options[name])) < len(options[name]):
            raise click.UsageError(
                "A load of the sphere is given twice: give it once, and --repeats."
            )


def _require_writable_folder(target: Path, *, overwrite: bool) -> None:
    """Prove that the scans can be written in a folder, which need not exist yet."""
    if not target.exists() and not target.is_symlink():
        ensure_writable(target)
        return
    if not target.is_dir():
        raise OutputError(
            f"The output {target} is not a folder.",
            why="An experiment is several scans, each a file of its own.",
            cure="Give the name of a folder; a new one is made.",
        )
    for name in FILES:
        ensure_writable(target / name, overwrite=overwrite)


def _sphere(folder: Path, options: Options, as_json: bool, force: bool) -> None:
    from memscal.extensions.simulation.experiment import simulate_experiment
    from memscal.formats.scan import write_scan

    _require_writable_folder(folder, overwrite=force)
    radius = {name: options[f"sphere_{name}"] for name in ("radius", "radius_uncertainty")}
    sphere: Any = indenter_from("sphere", radius)
    with working("Simulating"):
        settings = _settings(simulate_experiment, options)
        settings["loads"] = options["loads"] or _LOADS
        settings["points"] = options["contacts"]
        made = simulate_experiment(
            **settings,
            sphere=sphere,
            interface=interface_of(options),
            rod_points=options["points"] or 65,
        )
    scans = {folder / f"{name}.h5": scan for name, scan in made.scans.items()}
    with together(folder):
        for path, scan in scans.items():
            write_scan(scan, path, overwrite=force)
        if as_json:
            described = [_described(scan, path) for path, scan in scans.items()]
            emit_json({"schema_version": "1", "synthetic": True, "scans": described})
        else:
            _print_truth(scans, "experiment")
    note("The scans are synthetic: nothing in them was measured.")
    message(f"Written: {', '.join(map(str, scans))}")
