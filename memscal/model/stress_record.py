"""Measured stress as it is kept in a file: profiles with their covariance, and where from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from memscal.model.checks import QualityCheck
from memscal.model.film import ElasticFilm
from memscal.model.indenter import RoundIndenter
from memscal.model.provenance import Process, SourceFile
from memscal.model.scan import StressSensor
from memscal.model.validation import FloatArray, freeze_arrays

__all__ = ["StressRecord", "StressRecordProfile"]


@dataclass(frozen=True, eq=False)
class StressRecordProfile:
    """The measured stress of one load.

    Parameters
    ----------
    load : float
        Nominal load, in N.
    load_uncertainty : float or None
        Its standard uncertainty, common to all loads of a scan, in N.
    lubrication : str
        ``"dry"``, ``"lubricated"`` or empty.
    scan : int
        Which of the scans it comes from, counted from zero.
    r, x, y : ndarray, shape (n,)
        Distance from the centre, by which they are sorted, and position, in m.
    s_zz : ndarray, shape (n,)
        Measured stress, in Pa, positive in compression.
    covariances : mapping of str to ndarray, shape (n, n)
        Its covariance by source, in Pa^2.
    force, maximum : float
        Total force, in N, and stress on the axis, in Pa.
    budget : mapping of str to mapping of str to float
        Standard uncertainties of ``force`` and ``maximum`` by source, in N and Pa.
    centre, centre_uncertainty : ndarray, shape (2,)
        Centre of the profile, in m.
    baseline, baseline_uncertainty : float
        Baseline in the middle of the scan, in V.
    contact_radius : float
        Of the frictionless contact at the nominal load, in m.
    """

    load: float
    load_uncertainty: float | None
    lubrication: str
    scan: int
    r: FloatArray
    x: FloatArray
    y: FloatArray
    s_zz: FloatArray
    covariances: Mapping[str, FloatArray]
    force: float
    maximum: float
    budget: Mapping[str, Mapping[str, float]]
    centre: FloatArray
    centre_uncertainty: FloatArray
    baseline: float
    baseline_uncertainty: float
    contact_radius: float

    def __post_init__(self) -> None:
        freeze_arrays(self, "r", "x", "y", "s_zz", "centre", "centre_uncertainty")

    @property
    def covariance(self) -> FloatArray:
        """Covariance of ``s_zz``, all sources together, in Pa^2."""
        return np.asarray(np.sum(list(self.covariances.values()), axis=0))

    @property
    def s_zz_errors(self) -> FloatArray:
        """Standard uncertainty of ``s_zz``, in Pa."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def uncertainty(self, quantity: str) -> float:
        """Return the standard uncertainty of ``"force"`` (N) or ``"maximum"`` (Pa)."""
        return float(np.linalg.norm(list(self.budget[quantity].values())))


@dataclass(frozen=True, eq=False)
class StressRecord:
    """Everything that a file of measured stress (memscal-stress) holds.

    Parameters
    ----------
    profiles : tuple of StressRecordProfile
        One for each load of each scan.
    film, indenter, sensor
        Carried over from the first scan.
    conversion_constant, conversion_constant_uncertainty : float
        A, by which the voltages were divided, in V/Pa.
    checks : tuple of QualityCheck
        Quality checks.
    overridden : tuple of str
        Mismatches of artifact and scan that were accepted.
    artifact : SourceFile or None
        The file of the apparatus function.
    scans : tuple of SourceFile
        The files of the scans; empty where one was not read from a file.
    process : Process
        What was done, with what.
    """

    profiles: tuple[StressRecordProfile, ...]
    film: ElasticFilm
    indenter: RoundIndenter
    sensor: StressSensor
    conversion_constant: float
    conversion_constant_uncertainty: float
    checks: tuple[QualityCheck, ...]
    overridden: tuple[str, ...]
    artifact: SourceFile | None
    scans: tuple[SourceFile, ...]
    process: Process

    @property
    def passed(self) -> bool:
        """Whether every quality check passed."""
        return all(check.passed for check in self.checks)
