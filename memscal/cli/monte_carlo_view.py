"""Draws of a calibration beside its budget, as a table and as JSON."""

from __future__ import annotations

from typing import Any

from memscal.calibration.monte_carlo import Comparison, MonteCarlo
from memscal.cli.output import finite
from memscal.cli.tables import Table
from memscal.figures.quantities import quantity

__all__ = ["monte_carlo_json", "monte_carlo_notes", "monte_carlo_table"]


def monte_carlo_table(found: MonteCarlo) -> Table:
    """Return each parameter's standard uncertainty by the budget and by draws."""
    rows = []
    for each in found.comparisons:
        shown = quantity(each.name)
        scale = shown.scale
        low, high = (end / scale for end in each.symmetric)
        rows.append(
            (
                f"{shown.words} ({shown.unit})",
                f"{each.first_order / scale:.2g}",
                f"{each.uncertainty / scale:.2g}",
                f"{low:.4g} to {high:.4g}",
                "yes" if each.agrees else "no",
            )
        )
    apart = frozenset(i for i, each in enumerate(found.comparisons) if not each.agrees)
    title = f"What scatters, by {found.draws} draws of {_listed(found.sources)} (seed {found.seed})"
    head = ("", "u by the budget", "u of the draws", "95 % interval", "agrees")
    return Table(title, head, rows, apart)


def monte_carlo_notes(found: MonteCarlo) -> list[str]:
    """Return what the numbers rest on, and why draws and budget disagree."""
    apart = (each for each in found.comparisons if not each.agrees)
    return [*found.messages, *(f"{quantity(each.name).words}: {each.reason}" for each in apart)]


def monte_carlo_json(found: MonteCarlo) -> dict[str, Any]:
    """Return the comparison of every parameter."""
    return {
        "draws": found.draws,
        "seed": found.seed,
        "sources": list(found.sources),
        "agrees": found.agrees,
        "parameters": {each.name: _one(each) for each in found.comparisons},
        "messages": list(found.messages),
    }


def _one(each: Comparison) -> dict[str, Any]:
    unit, scale = quantity(each.name).unit, quantity(each.name).scale
    return {
        "value": finite(each.value / scale),
        "mean": finite(each.mean / scale),
        "standard_uncertainty": finite(each.uncertainty / scale),
        "sampling_error": finite(each.sampling_error / scale),
        "interval_95": [finite(end / scale) for end in each.symmetric],
        "shortest_interval_95": [finite(end / scale) for end in each.shortest],
        "first_order": finite(each.first_order / scale),
        "stated": finite(each.stated / scale),
        "unit": unit.replace("²", "^2"),
        "agrees": each.agrees,
        "reason": each.reason,
    }


def _listed(sources: tuple[str, ...]) -> str:
    words = [source.replace("_", " ") for source in sources]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
