"""No division at all: the apparatus function that the scan's points make most credible."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from memscal.deconvolution.problem import Division, DivisionProblem
from memscal.errors import InputError

__all__ = ["Evidence"]


@dataclass(frozen=True, kw_only=True)
class Evidence:
    r"""Posterior mean of A G, given the scan's points, their noise, and a prior about a Gaussian.

    The radial profile of a scan is estimated in data space before any field is divided: the best
    Gaussian, and departures from it whose shape, smoothness and strength are weighed by evidence
    (:mod:`memscal.estimation.evidence`).  The fields of the other methods are made of that
    estimate's convolution with the reference; this method takes the estimate itself, so that
    nothing is lost to a window, and beyond the resolved band the prior takes over.

    Parameters
    ----------
    nonnegative : bool
        Take the most credible G that is nowhere negative.
    monotone : bool
        Take the most credible G that nowhere rises with the radius.  A ring does: whether a
        constraint contradicts the scan is what the check ``reconvolution`` tells.
    """

    nonnegative: bool = False
    monotone: bool = False
    name: ClassVar[str] = "evidence"
    assumes: ClassVar[str] = "G is a Gaussian, or departs from one smoothly."
    fails: ClassVar[str] = (
        "Detail finer than a third of G's width that the film hides is not found, only allowed for."
    )

    @property
    def constrained(self) -> bool:
        """Whether a constraint was asked for."""
        return self.nonnegative or self.monotone

    def divide(self, problem: DivisionProblem) -> Division:
        """Take the posterior mean; its window is open everywhere."""
        if problem.posterior is None:
            raise InputError(
                "Method evidence was given fields without the scan that they came from.",
                cure="Use it by memscal.calibrate(scan, method='evidence').",
            )
        profile, field = problem.posterior(self.nonnegative, self.monotone)
        return Division(field, np.ones(problem.voltage_spectrum.shape), profile)
