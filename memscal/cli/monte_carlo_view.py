"""Draws of a calibration beside its budget, as a table and as JSON."""

from __future__ import annotations

import os
from typing import Any

from memscal.calibration.monte_carlo import Comparison, MonteCarlo, monte_carlo
from memscal.calibration.procedure import Calibration
from memscal.cli.output import finite, show_messages, texts_of
from memscal.cli.progress import working
from memscal.cli.tables import Table
from memscal.model.checks import Message
from memscal.model.quantities import estimated_quantity

__all__ = ["drawn_with_progress", "monte_carlo_json", "monte_carlo_table"]

#: Processes that share the draws, where there are as many cores.
_MOST_WORKERS = 8


def drawn_with_progress(calibration: Calibration, draws: int, seed: int) -> MonteCarlo:
    """Draw in processes, say how far it is, and tell what the numbers rest on."""
    # Starting a process takes about as long as forty draws of a line.
    workers = max(1, min(os.cpu_count() or 1, _MOST_WORKERS, draws // 40))
    with working(f"Drawing {draws} scans") as show:
        drawn = monte_carlo(
            calibration,
            draws=draws,
            seed=seed,
            workers=workers,
            progress=lambda done, _: show(f"Drawing {draws} scans: {done} calibrated"),
        )
    disagreements = [
        Message("disagreement", f"{estimated_quantity(c.name).words}: {c.reason}")
        for c in drawn.comparisons
        if not c.agrees
    ]
    show_messages([*drawn.messages, *disagreements])
    return drawn


def monte_carlo_table(found: MonteCarlo) -> Table:
    """Return each parameter's standard uncertainty by the budget and by draws."""
    rows = []
    for each in found.comparisons:
        shown = estimated_quantity(each.name)
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


def monte_carlo_json(found: MonteCarlo) -> dict[str, Any]:
    """Return the comparison of every parameter."""
    return {
        "draws": found.draws,
        "seed": found.seed,
        "sources": list(found.sources),
        "agrees": found.agrees,
        "parameters": {each.name: _one(each) for each in found.comparisons},
        "messages": texts_of(found.messages),
    }


def _one(each: Comparison) -> dict[str, Any]:
    shown = estimated_quantity(each.name)
    unit, scale = shown.unit, shown.scale
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
