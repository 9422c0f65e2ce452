"""The design of a calibration: a planned scan, and the uncertainties to expect of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from memscal.deconvolution.problem import Regulariser
from memscal.deconvolution.registry import create_regulariser
from memscal.model.apparatus import ParameterSet
from memscal.model.validation import FloatArray, freeze_arrays
from memscal.planning.expectation import expected_calibration
from memscal.planning.plan import Plan

__all__ = ["Design", "evaluate"]


@dataclass(frozen=True, eq=False, repr=False)
class Design:
    """A planned scan and what it would find, with standard uncertainties (k = 1).

    Parameters
    ----------
    plan : Plan
        The scan.
    method : str
        How it would be evaluated.
    parameters : ParameterSet
        What a calibration states, in expectation: ``conversion_constant`` (V/Pa),
        ``gaussian_sigma``, ``fwhm`` (m) and more, with their joint covariance.
    budget : mapping
        Standard uncertainty of A and of the widths by source, in SI units.  ``noise`` scatters
        from scan to scan; ``regularisation`` is what no repeated scan would show: the shapes of G
        that the film hides.
    r, g, g_errors : ndarray, shape (n,)
        G to expect, in 1/m^2, at radii in m.
    k, transfer, transfer_errors : ndarray, shape (m,)
        Its transfer function at wavenumbers in rad/m.
    resolved_wavenumber : float
        Up to which the scan would determine G, in rad/m.
    """

    plan: Plan
    method: str
    parameters: ParameterSet
    budget: Mapping[str, Mapping[str, float]]
    r: FloatArray
    g: FloatArray
    g_errors: FloatArray
    k: FloatArray
    transfer: FloatArray
    transfer_errors: FloatArray
    resolved_wavenumber: float

    def __post_init__(self) -> None:
        freeze_arrays(self, "r", "g", "g_errors", "k", "transfer", "transfer_errors")

    def __repr__(self) -> str:
        """Return the plan and its main numbers in place of arrays."""
        shares = ", ".join(
            f"u({symbol})/{symbol} = {self.relative_uncertainty(name):.2%}"
            for symbol, name in (("A", "conversion_constant"), ("sigma", "gaussian_sigma"))
        )
        return (
            f"<Design of {self.plan.positions} positions every {self.plan.step * 1e3:.4g} mm, "
            f"{self.plan.repeats} repeat{'s' if self.plan.repeats > 1 else ''}: {shares}>"
        )

    def relative_uncertainty(self, name: str) -> float:
        """Return the standard uncertainty of a parameter over its value.

        Raises
        ------
        InputError
            If there is no such parameter.
        """
        return abs(self.parameters.uncertainty(name) / self.parameters[name])

    def largest_source(self, name: str) -> str:
        """Return the source that contributes most to a budgeted parameter."""
        parts = self.budget[name]
        return max(parts, key=lambda source: parts[source])


def evaluate(plan: Plan, method: str | Regulariser = "evidence", seed: int = 0) -> Design:
    """Return what to expect of a plan.

    Parameters
    ----------
    plan : Plan
        The scan.
    method : str or Regulariser
        How it is evaluated.
    seed : int
        Seed of methods that draw random numbers.

    Raises
    ------
    InputError, FitError
        If the plan cannot be calibrated with.
    """
    regulariser = create_regulariser(method, seed=seed) if isinstance(method, str) else method
    expected = expected_calibration(plan, regulariser)
    solution, results = expected.solution, expected.results
    deconvolution, fields = solution.deconvolution, solution.fields
    transfer = fields.grid.transfer(deconvolution.quotient.values)
    k, modulus = fields.along_axis(np.abs(transfer))
    return Design(
        plan=plan,
        method=regulariser.name,
        parameters=results.parameters,
        budget=results.budget,
        r=deconvolution.g.r,
        g=deconvolution.g.radial,
        g_errors=np.sqrt(np.diag(results.radial_covariance)),
        k=k,
        transfer=modulus / deconvolution.conversion_constant,
        transfer_errors=results.transfer_errors,
        resolved_wavenumber=solution.band.resolved,
    )
