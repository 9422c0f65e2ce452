"""``memscal design``: the uncertainties to expect of a scan that is not made yet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from memscal.cli.failures import DONE, debug_option
from memscal.cli.options import (
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
from memscal.cli.output import FigurePath, emit_json, message, note, prove_writable
from memscal.cli.simulate import FILM

if TYPE_CHECKING:
    from memscal.planning.expected import Design

    _WishType = click.ParamType[tuple[str, float]]
else:  # generic since click 8.2 only
    _WishType = click.ParamType

__all__ = ["command", "tell"]

_VARIED = ("step", "half-range", "repeats")

EXAMPLES = """\b
Examples:
  memscal design
  memscal design --step 0.5 --half-range 10 --repeats 4 --noise 1
  memscal design --load 0.5 --noise-voltage 0.05 --figure design.png
  memscal design --noise 1 --want A=1.3% --vary step
  memscal design --thickness-uncertainty 0.005 --want sigma=1.2% --vary repeats --json
  memscal design --disc-radius 800 --sigma 300 --want resolved=4.5 --vary repeats
"""


class _Wish(_WishType):
    """What is wanted: ``sigma=1%``, or ``resolved=4`` in rad/mm."""

    name = "wish"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, float]:
        """Read name and number; the name is the library's to judge."""
        if isinstance(value, tuple):
            return value
        name, found, text = str(value).partition("=")
        percent = text.strip().endswith("%")
        try:
            number = float(text.strip().removesuffix("%"))
        except ValueError:
            found = ""
            number = 0.0
        if not found:
            self.fail(f"{value!r} is no wish: write sigma=1% or resolved=4 (rad/mm).", param, ctx)
        name = name.strip()
        if percent == (name == "resolved"):
            unit = "in rad/mm, without %" if percent else "in percent: write the %"
            self.fail(f"{value!r}: {name} is wanted {unit}.", param, ctx)
        return name, si(number, -2) if percent else si(number, 3)


@click.command("design", epilog=EXAMPLES)
@kernel_options
@click.option(
    "--load",
    type=Quantity("N"),
    default=1.0,
    show_default=True,
    help="Normal load, in N.",
)
@click.option(
    "--load-uncertainty",
    type=Quantity("percent", open_low=False),
    default=1.0,
    show_default=True,
    help="Standard uncertainty (k = 1) of the load, in percent.",
)
@radius_options(default=0.25, uncertainty=0.0025)
@film_options(defaults=FILM)
@click.option(
    "--step",
    type=Quantity("mm"),
    default=0.25,
    show_default=True,
    help="Distance of neighbouring positions, in mm.",
)
@click.option(
    "--half-range",
    type=Quantity("mm"),
    default=8.0,
    show_default=True,
    help="Positions run from minus to plus this, in mm.",
)
@click.option(
    "--repeats",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="How often the line is scanned.",
)
@click.option(
    "--noise",
    type=Quantity("percent"),
    default=0.5,
    show_default=True,
    help="Standard deviation of one voltage, in percent of the signal with the rod right above "
    "the sensor.",
)
@click.option(
    "--noise-voltage",
    type=Quantity("mV"),
    help="The same in mV, in place of --noise.",
)
@click.option(
    "--centre",
    type=Quantity("mm", low=-float("inf")),
    default=0.0,
    show_default=True,
    help="Expected position of the sensor along the scan, in mm.",
)
@click.option(
    "--method",
    default="bayesian",
    show_default=True,
    help="Method of memscal calibrate with which the scan would be evaluated.",
)
@click.option(
    "--want",
    "wishes",
    type=_Wish(),
    multiple=True,
    metavar="WISH",
    help="What to reach by --vary: A=1%, sigma=1% or fwhm=5% at most, relative standard "
    "uncertainty, or resolved=4 at least, in rad/mm. May be repeated: all of them.",
)
@click.option(
    "--vary",
    type=click.Choice(_VARIED),
    help="What to vary for --want: the coarsest step, shortest range or fewest repeats is found.",
)
@click.option(
    "--figure",
    "figures",
    type=FigurePath(),
    multiple=True,
    metavar="FILE",
    help="Figure of the expected result (.png, .svg or .pdf). May be repeated.",
)
@json_option
@force_option
@debug_option
def command(
    figures: tuple[Path, ...],
    wishes: tuple[tuple[str, float], ...],
    vary: str | None,
    as_json: bool,
    force: bool,
    **given: Any,
) -> int:
    """Predict the uncertainties of a calibration before its scan is made.

    Without simulation: from the Fisher information of the planned scan and the prior of the
    estimate, with the uncertainties of film, rod and load. What the options do not say is the
    paper's. With --want and --vary, the least scan that reaches what is wanted.
    """
    require_one_kernel(given)
    if bool(wishes) != (vary is not None):
        raise click.UsageError("--want and --vary go together: what to reach, and by what.")
    prove_writable(figures, force=force)
    planned = _designed(given, dict(wishes), vary)
    _draw(planned, vary, figures, force=force)

    tell(planned, dict(wishes), as_json=as_json)
    for path in figures:
        message(f"Written: {path}")
    return DONE


def _designed(given: dict[str, Any], wishes: dict[str, float], vary: str | None) -> Design:
    from memscal.model.indenter import Rod
    from memscal.planning.design import design

    rod = indenter_from("rod", given)
    assert isinstance(rod, Rod)
    return design(
        film=film_from(given),
        rod=rod,
        kernel=kernel_from(given),
        conversion_constant=si(given["conversion_constant"], -3),
        load=given["load"],
        load_uncertainty=si(given["load_uncertainty"], -2),
        step=si(given["step"], -3),
        half_range=si(given["half_range"], -3),
        repeats=given["repeats"],
        noise=si(given["noise"], -2),
        noise_voltage=si(given["noise_voltage"], -3),
        centre=si(given["centre"], -3),
        method=given["method"],
        want=wishes,
        vary=None if vary is None else vary.replace("-", "_"),
    )


def _draw(planned: Design, vary: str | None, figures: tuple[Path, ...], *, force: bool) -> None:
    if not figures:
        return
    from memscal.figures.design import design_figure
    from memscal.figures.style import save_figure

    figure = design_figure(planned, vary="step" if vary is None else vary.replace("-", "_"))
    for path in figures:
        save_figure(figure, path, overwrite=force)


#: Parameter, its name in words, its symbol, its unit, and how many of it an SI unit has.
_SHOWN = (
    ("conversion_constant", "conversion constant A", "A", "mV/Pa", 1e3),
    ("gaussian_sigma", "Gaussian width sigma", "sigma", "mm", 1e3),
    ("fwhm", "full width at half maximum", "FWHM", "mm", 1e3),
)
#: Contributions below this share of the largest are rounding to a reader.
_NEGLIGIBLE = 5e-3
_WORDS = {
    "noise": "noise",
    "regularisation": "what the film hides of G",
    "window": "what the window hides of G",
    "thickness": "film thickness",
    "poisson_ratio": "Poisson's ratio",
    "rod_radius": "rod radius",
    "young_modulus": "Young's modulus",
}
_HIDDEN = (
    "G beyond the resolved band is the prior's: its uncertainty there does not scatter from scan "
    "to scan, and repeats do not show it."
)


def tell(planned: Design, wishes: Mapping[str, float], *, as_json: bool) -> None:
    """Print the design as tables or as one JSON object."""
    if as_json:
        emit_json(_object(planned, wishes))
    else:
        from memscal.cli.output import emit_tables
        from memscal.summaries.table import Table

        emit_tables(
            Table(_title(planned), ("", ""), _plan_rows(planned)),
            Table(
                "Expected, with standard uncertainties (k = 1)",
                ("", "value", "uncertainty", "relative"),
                _rows(planned),
            ),
            Table("Contributions, in percent", *_contributions(planned)),
        )
    note(_HIDDEN)


def _title(planned: Design) -> str:
    return f"A planned scan (nothing was measured), for method {planned.method}"


def _plan_rows(planned: Design) -> list[tuple[str, str]]:
    plan = planned.plan
    return [
        ("positions", f"{plan.positions}, every {plan.step * 1e3:.4g} mm"),
        ("half range", f"{plan.half_range * 1e3:.4g} mm"),
        ("repeats", f"{plan.repeats}"),
        ("load", f"{plan.load:.4g} N"),
        ("largest signal", f"{plan.signal * 1e3:.4g} mV"),
        (
            "noise of a voltage",
            f"{plan.point_noise * 1e3:.3g} mV ({plan.point_noise / plan.signal * 100:.3g} %)",
        ),
    ]


def _rows(planned: Design) -> list[tuple[str, str, str, str]]:
    rows = []
    for name, words, _, unit, scale in _SHOWN:
        value, error = planned.parameters[name], planned.parameters.uncertainty(name)
        share = planned.relative_uncertainty(name)
        rows.append((words, f"{value * scale:.4g} {unit}", f"{error * scale:.2g}", _percent(share)))
    g, error = planned.g[0] * 1e-6, planned.g_errors[0] * 1e-6
    rows.append(("G at the axis", f"{g:.4g} 1/mm^2", f"{error:.2g}", _percent(error / abs(g))))
    band = planned.resolved_wavenumber
    detail = f"detail of {6.283185 / band * 1e3:.3g} mm"
    rows.append(("resolved up to", f"{band * 1e-3:.4g} rad/mm", detail, ""))
    return rows


def _percent(share: float) -> str:
    return f"{share * 100:.3g} %"


def _contributions(planned: Design) -> tuple[list[str], list[list[str]]]:
    """Return head and rows: a source in each, for A and both widths."""
    shares = {
        name: {s: u / abs(planned.parameters[name]) for s, u in planned.budget[name].items()}
        for name, *_ in _SHOWN
    }
    largest = {name: max(parts.values()) for name, parts in shares.items()}
    sources = [
        source
        for source in shares["conversion_constant"]
        if any(shares[name].get(source, 0.0) > _NEGLIGIBLE * largest[name] for name in shares)
    ]
    rows = [
        [
            _WORDS.get(source, source.replace("_", " ")),
            *(_cell(shares[name].get(source, 0.0), largest[name]) for name in shares),
        ]
        for source in sources
    ]
    return ["source", *(symbol for _, _, symbol, _, _ in _SHOWN)], rows


def _cell(share: float, largest: float) -> str:
    return f"{share * 100:.2g}" if share > _NEGLIGIBLE * largest else "0"


def _object(planned: Design, wishes: Mapping[str, float]) -> dict[str, Any]:
    plan = planned.plan
    return {
        "schema_version": "1",
        "planned": True,
        "method": planned.method,
        "plan": {
            "positions": plan.positions,
            "step": _quantity(plan.step * 1e3, "mm"),
            "half_range": _quantity(plan.half_range * 1e3, "mm"),
            "repeats": plan.repeats,
            "load": _quantity(plan.load, "N"),
            "largest_signal": _quantity(plan.signal * 1e3, "mV"),
            "noise": _quantity(plan.point_noise * 1e3, "mV"),
        },
        "wanted_si": dict(wishes),
        "expected": {name: _expected(planned, name, unit, s) for name, _, _, unit, s in _SHOWN},
        "g_at_axis": {
            **_quantity(planned.g[0] * 1e-6, "1/mm^2"),
            "uncertainty": planned.g_errors[0] * 1e-6,
        },
        "resolved_wavenumber": _quantity(planned.resolved_wavenumber * 1e-3, "rad/mm"),
    }


def _expected(planned: Design, name: str, unit: str, scale: float) -> dict[str, Any]:
    return {
        **_quantity(planned.parameters[name] * scale, unit),
        "uncertainty": planned.parameters.uncertainty(name) * scale,
        "relative_uncertainty": planned.relative_uncertainty(name),
        "budget": {source: part * scale for source, part in planned.budget[name].items()},
    }


def _quantity(value: float, unit: str) -> dict[str, Any]:
    return {"value": float(value), "unit": unit}
