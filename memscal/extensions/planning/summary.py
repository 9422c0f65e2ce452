"""A planned scan as tables, mapping and arrays, as ``memscal design`` prints it."""

import math

from memscal.extensions.planning.design import Design
from memscal.model.arrays import Values
from memscal.model.quantities import ESTIMATED, MM, MV, PER_MM, PER_MM2, Quantity, measured
from memscal.model.records import RADIAL, TRANSFER
from memscal.summaries import declared
from memscal.summaries.table import Table, percent

PLAN = (
    Quantity("positions", "number", "positions"),
    Quantity("step", "length", "step"),
    Quantity("half_range", "length", "half range"),
    Quantity("repeats", "number", "repeats"),
    Quantity("load", "force", "load", "P"),
    Quantity("signal", "voltage", "largest signal", label="largest_signal"),
    Quantity("point_noise", "voltage", "noise of a voltage", label="noise"),
)

EXPECTED = (*measured(Quantity("g_at_axis", "per area", "G at the axis")), TRANSFER.quantities[-1])
"""What a planned scan is expected to give beside its parameters."""

#: Words and symbol of the parameters that are shown.
_SHOWN = {
    "conversion_constant": ("conversion constant A", "A"),
    "gaussian_sigma": ("Gaussian width sigma", "sigma"),
    "fwhm": ("full width at half maximum", "FWHM"),
}
#: Contributions below this share of the largest are shown as zero.
_NEGLIGIBLE = 5e-3
_WORDS = {
    "regularisation": "what the film hides of G",
    "window": "what the window hides of G",
    "misfit": "misfit of the Gaussian",
    "thickness": "film thickness",
    "poisson_ratio": "Poisson's ratio",
    "young_modulus": "Young's modulus",
}
_QUANTITIES = (
    *RADIAL.quantities[:3],
    *TRANSFER.quantities[:1],
    Quantity("transfer", "dimensionless", "transfer function of G", axes=("k",)),
    Quantity("transfer_errors", "dimensionless", "standard uncertainty of it", axes=("k",)),
)


def tables(planned: Design) -> list[Table]:
    """Return the plan, the expected parameters, and the sources of their uncertainties."""
    plan = planned.plan
    noise = f"{plan.point_noise / MV:.3g} mV ({plan.point_noise / plan.signal * 100:.3g} %)"
    shown = {
        "positions": f"{plan.positions}, every {plan.step / MM:.4g} mm",
        "half_range": f"{plan.half_range / MM:.4g} mm",
        "repeats": f"{plan.repeats}",
        "load": f"{plan.load:.4g} N",
        "signal": f"{plan.signal / MV:.4g} mV",
        "point_noise": noise,
    }
    rows = [(q.words, shown[q.name]) for q in PLAN if q.name in shown]
    title = f"A planned scan (nothing was measured), for method {planned.method}"
    head = ("", "value", "uncertainty", "relative")
    return [
        Table(title, ("", ""), rows),
        Table("Expected, with standard uncertainties (k = 1)", head, _expected_rows(planned)),
        _contributions_table(planned),
    ]


def _expected_rows(planned: Design) -> list[tuple[str, str, str, str]]:
    rows = []
    for name, (words, _) in _SHOWN.items():
        shown = ESTIMATED[name]
        value = f"{planned.parameters[name] / shown.scale:.4g} {shown.unit}"
        error = f"{planned.parameters.uncertainty(name) / shown.scale:.2g}"
        rows.append((words, value, error, percent(planned.relative_uncertainty(name))))
    g = planned.g[0] / PER_MM2
    u = planned.g_errors[0] / PER_MM2
    rows.append(("G at the axis", f"{g:.4g} 1/mm^2", f"{u:.2g}", percent(u / abs(g))))
    band = planned.resolved_wavenumber / PER_MM
    detail = f"detail of {2 * math.pi / band:.3g} mm"
    rows.append(("resolved up to", f"{band:.4g} rad/mm", detail, ""))
    return rows


def _contributions_table(planned: Design) -> Table:
    shares = {}
    for name in _SHOWN:
        value = abs(planned.parameters[name])
        shares[name] = {source: u / value for source, u in planned.budget[name].items()}
    rows = []
    for source in shares["conversion_constant"]:
        cells = []
        for budget in shares.values():
            share = budget.get(source, 0.0)
            counts = share > _NEGLIGIBLE * max(budget.values())
            cells.append(f"{share * 100:.2g}" if counts else "0")
        if any(cell != "0" for cell in cells):
            rows.append([_WORDS.get(source, source.replace("_", " ")), *cells])
    head = ("source", *(symbol for _, symbol in _SHOWN.values()))
    return Table("Contributions, in percent", head, rows)


def mapping(planned: Design) -> Values:
    """Return the object of ``design --json``; the contract fixes its form."""
    axis = {"g_at_axis": planned.g[0], "g_at_axis_uncertainty": planned.g_errors[0]}
    wanted = {}
    for name, value in planned.want.items():
        wanted[name] = {"value": value, "unit": "1"}
        if name == "resolved":
            wanted[name] = {"value": value / PER_MM, "unit": "rad/mm"}
    expected = {
        name: {
            **declared.parameter_json(planned.parameters, name),
            "relative_uncertainty": planned.relative_uncertainty(name),
            "budget": declared.plain(planned.budget[name], ESTIMATED[name].scale),
        }
        for name in _SHOWN
    }
    return {
        "schema_version": "1",
        "planned": True,
        "method": planned.method,
        "plan": declared.members(PLAN, planned.plan),
        "wanted": wanted,
        "expected": expected,
        **declared.members(EXPECTED, planned, **axis),
    }


def dataset(planned: Design) -> declared.Dataset:
    """Return G along r and its transfer function along k, with standard uncertainties."""
    return declared.labelled_dataset(_QUANTITIES, vars(planned))


def frame(planned: Design) -> declared.DataFrame:
    """Return one row for each radius at which G is expected."""
    return declared.data_frame(_QUANTITIES[:3], vars(planned))


def correlated(planned: Design) -> Values:
    """Return the expected parameters with their joint covariance."""
    return declared.correlated_parameters(planned.parameters)
