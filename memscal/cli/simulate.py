"""``memscal simulate``: a synthetic scan whose truth is known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from memscal.cli.failures import DONE, debug_option
from memscal.cli.kernel_options import kernel_from, kernel_options, require_one_kernel
from memscal.cli.options import (
    FILE,
    Quantity,
    film_from,
    film_options,
    force_option,
    indenter_from,
    json_option,
    radius_options,
    si,
)
from memscal.cli.output import emit_json, message, note
from memscal.cli.targets import prove_writable

if TYPE_CHECKING:
    from memscal.model.scan import Scan

__all__ = ["command"]

#: The paper's film as the virtual laboratory has it, in the units of the command line.
FILM = {
    "young-modulus": 2.2,
    "poisson-ratio": 0.5,
    "thickness": 2.0,
    "young-modulus-uncertainty": 0.1,
    "poisson-ratio-uncertainty": 0.005,
    "thickness-uncertainty": 0.02,
}

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
"""


@click.command("simulate", epilog=EXAMPLES)
@click.option(
    "-o",
    "--output",
    type=FILE,
    default=Path("synthetic_scan.h5"),
    show_default=True,
    metavar="SCAN",
    help="Scan to write (memscal-scan).",
)
@kernel_options
@click.option(
    "--load",
    "loads",
    type=Quantity("N"),
    multiple=True,
    default=(1.0,),
    show_default=True,
    help="Normal load, in N. Repeated: one scan at each.",
)
@radius_options(default=0.25, uncertainty=0.0025)
@film_options(defaults=FILM)
@click.option(
    "--half-range",
    type=Quantity("mm"),
    default=8.0,
    show_default=True,
    help="Positions run from minus to plus this, in mm.",
)
@click.option(
    "--points",
    type=click.IntRange(min=2, max=4096),
    default=65,
    show_default=True,
    help="Positions along each axis.",
)
@click.option(
    "--repeats",
    type=click.IntRange(min=1, max=4096),
    default=1,
    show_default=True,
    help="Repeats at each load.",
)
@click.option("--raster", is_flag=True, help="Scan a square instead of a line.")
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
@json_option
@force_option
@debug_option
def command(output: Path, as_json: bool, force: bool, **given: Any) -> int:
    """Make a synthetic scan from a known apparatus function.

    The base stress of a frictionless rod on the bonded film is convolved with the apparatus
    function; noise, an offset and a drift are added. The file is labelled as synthetic and holds
    its truth. What the options do not say is the paper's.
    """
    require_one_kernel(given)
    if given["raster"] and len(given["loads"]) * given["repeats"] > 1:
        raise click.UsageError("A raster has one repeat at one load.")
    prove_writable([output], force=force)
    scan = _simulate(given)

    from memscal.formats.scan import write_scan

    write_scan(scan, output, overwrite=force)
    _tell(scan, output, as_json)
    return DONE


def _simulate(given: Mapping[str, Any]) -> Scan:
    from memscal.laboratory.rod_scan import simulate
    from memscal.model.indenter import Rod

    film, rod = film_from(given), indenter_from("rod", given)
    assert isinstance(rod, Rod)
    loads = given["loads"]
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


def _tell(scan: Scan, output: Path, as_json: bool) -> None:
    truth = dict(scan.synthetic or {})
    if as_json:
        emit_json(
            {
                "schema_version": "1",
                "scan": str(output),
                "synthetic": True,
                "kind": scan.kind,
                "shape": list(scan.u_zz.shape),
                "truth_si": truth,
            }
        )
    else:
        from memscal.cli.tables import Table, emit_tables
        from memscal.figures.quantities import quantity

        rows = [("kind", scan.kind), ("points", " x ".join(str(n) for n in scan.u_zz.shape))]
        for name, value in truth.items():
            if isinstance(value, str):
                rows.append((name.replace("_", " "), value))
            elif name == "seed":
                rows.append((name, f"{value:g}"))
            else:
                shown = quantity(name, "V" if name == "noise" else "")
                words = "Gaussian width" if name == "gaussian_sigma" else shown.words
                rows.append((words, f"{value / shown.scale:.6g} {shown.unit}"))
        emit_tables(
            Table("Synthetic scan (calculated, not measured) and its truth", ("", ""), rows)
        )
    note("The scan is synthetic: nothing in it was measured.")
    message(f"Written: {output}")
