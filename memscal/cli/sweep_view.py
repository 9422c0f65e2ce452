"""A sweep over the noise amplitude as a table and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from memscal.calibration.sweep import Sweep
from memscal.cli.output import finite
from memscal.cli.tables import Table
from memscal.model.quantities import MM, MV
from memscal.model.validation import FloatArray

__all__ = ["sweep_json", "sweep_table"]


def sweep_table(sweep: Sweep) -> Table:
    """Return every second amplitude: the exact expectation, and the middle draw of the seeds."""
    power = _power(sweep.conversion_constant / MV)
    scale = MV * 10.0**power
    rows = []
    for i in range(0, sweep.amplitude.size, 2):
        a, width = sweep.conversion_constant[i] / scale, sweep.gaussian_sigma_deconvolved[i] / MM
        rows.append(
            (
                f"{sweep.amplitude[i]:.3g}",
                _number(a, ".4f"),
                _number(width, ".4f"),
                _number(100 * sweep.relative_rms[i], ".3g"),
                _draws(sweep.seed_conversion_constant[i] / scale, ".4f"),
                _draws(sweep.seed_gaussian_sigma[i] / MM, ".4f"),
                _draws(100 * sweep.seed_relative_rms[i], ".3g"),
            )
        )
    count = sweep.seed_relative_rms.shape[1]
    title = (
        "Dependence on the noise amplitude (1 is the rule's choice): the expectation, and the "
        f"median of {count} draws"
    )
    head = ("amplitude", f"A (1e{power} mV/Pa)", "σ(G) (mm)", "rms (%)")
    return Table(title, (*head, "A, draws", "σ(G), draws", "rms, draws"), rows)


def sweep_json(sweep: Sweep) -> dict[str, Any]:
    """Return the whole sweep: lists over amplitudes, and lists of draws within them."""
    return {
        "amplitude": _listed(sweep.amplitude, 1.0),
        "conversion_constant": _series(
            sweep.conversion_constant, sweep.seed_conversion_constant, MV, "mV/Pa"
        ),
        "gaussian_sigma_deconvolved": _series(
            sweep.gaussian_sigma_deconvolved, sweep.seed_gaussian_sigma, MM, "mm"
        ),
        "relative_rms": _series(sweep.relative_rms, sweep.seed_relative_rms, 1.0, "1"),
    }


def _series(expected: FloatArray, draws: FloatArray, scale: float, unit: str) -> dict[str, Any]:
    return {
        "values": _listed(expected, scale),
        "draws": [_listed(row, scale) for row in draws],
        "unit": unit,
    }


def _listed(values: FloatArray, scale: float) -> list[float | None]:
    return [finite(float(value) / scale) for value in values]


def _power(values: FloatArray) -> int:
    """Return the power of ten to name in the head in place of a row of zeros."""
    known = np.abs(values[np.isfinite(values) & (values != 0)])
    return int(np.floor(np.log10(np.median(known)))) if known.size else 0


def _draws(values: FloatArray, form: str) -> str:
    known = values[np.isfinite(values)]
    return _number(float(np.median(known)), form) if known.size else "-"


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if np.isfinite(value) else "-"
