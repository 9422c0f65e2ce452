"""Monte Carlo draws of a calibration as a table, a mapping and a data frame."""

from memscal.extensions.monte_carlo.monte_carlo import BudgetComparison, MonteCarlo
from memscal.model.arrays import Values
from memscal.model.quantities import estimated_quantity
from memscal.summaries.declared import DataFrame, plain
from memscal.summaries.table import Table, texts_of

_KEYS = {
    "uncertainty": "standard_uncertainty",
    "symmetric": "interval_95",
    "shortest": "shortest_interval_95",
}
"""Names in JSON of what a comparison holds, where they differ."""


def tables(result: MonteCarlo) -> list[Table]:
    """Return each parameter's standard uncertainty by the budget and by draws."""
    rows = []
    for comparison in result.comparisons:
        quantity = estimated_quantity(comparison.name).read_in(result.reading)
        scale = quantity.scale
        low, high = comparison.symmetric
        row = [
            f"{quantity.words} ({quantity.unit})",
            f"{comparison.first_order / scale:.2g}",
            f"{comparison.uncertainty / scale:.2g}",
            f"{low / scale:.4g} to {high / scale:.4g}",
            "yes" if comparison.agrees else "no",
        ]
        rows.append(row)
    *others, last = (source.replace("_", " ") for source in result.sources)
    sources = f"{', '.join(others)} and {last}" if others else last
    title = f"What scatters, by {result.draws} draws of {sources} (seed {result.seed})"
    head = ("", "u by the budget", "u of the draws", "95 % interval", "agrees")
    disagreeing = frozenset(i for i, c in enumerate(result.comparisons) if not c.agrees)
    return [Table(title, head, rows, disagreeing)]


def mapping(result: MonteCarlo) -> Values:
    """Return the comparison of every parameter."""
    return {
        "draws": result.draws,
        "seed": result.seed,
        "sources": list(result.sources),
        "agrees": result.agrees,
        "parameters": {c.name: _comparison_json(c, result) for c in result.comparisons},
        "messages": texts_of(result.messages),
    }


def _comparison_json(comparison: BudgetComparison, result: MonteCarlo) -> Values:
    quantity = estimated_quantity(comparison.name).read_in(result.reading)
    values = {
        _KEYS.get(name, name): plain(number, quantity.scale)
        for name, number in vars(comparison).items()
        if name not in ("name", "reason")
    }
    return {
        **values,
        "unit": quantity.unit_text,
        "agrees": comparison.agrees,
        "reason": comparison.reason,
    }


def frame(result: MonteCarlo) -> DataFrame:
    """Return the drawn parameters, one row for each draw that could be calibrated."""
    import pandas as pd

    names = [comparison.name for comparison in result.comparisons]
    quantities = [estimated_quantity(name).read_in(result.reading) for name in names]
    return pd.DataFrame(result.samples, columns=[f"{q.name} ({q.si_unit})" for q in quantities])
