r"""What a calibrated sensor measured: the stress at the base of a film, load by load.

.. math::

    S_{zz}(r) = \frac{U_{zz} - b - d\,\xi}{A} = (G \otimes \sigma_{zz})(r)

It is the base stress as the sensor blurs it, to be compared with calculated stress blurred by the
same G.  Baseline b, drift d and centre are those of the restored stress (:mod:`.restoration`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import Any

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.measurement.restoration import Restoration
from memscal.measurement.single_loads import SingleLoad
from memscal.model.checks import Message, QualityCheck
from memscal.model.notation import format_measured
from memscal.model.provenance import SourceFile
from memscal.model.scan import Scan
from memscal.model.validation import FloatArray

__all__ = ["MeasuredProfile", "MeasuredStress"]


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredProfile:
    """The measured stress of one load, from the centre outward.

    Parameters
    ----------
    part : SingleLoad
        What was measured.
    restoration : Restoration
        The base stress that explains it; its scan is the part brought to the nominal load.
    x, y, r : ndarray, shape (n,)
        Positions and their distance from the centre, by which they are sorted, in m.  Repeats at
        one position are averaged by their weights.
    s_zz : ndarray, shape (n,)
        Stress there, in Pa, positive in compression.
    covariances : mapping of str to ndarray, shape (n, n)
        Its covariance by source, in Pa^2: ``noise`` (electronic, of loads and of positions),
        ``conversion_constant``, ``centre``, ``baseline`` (with drift; what centre and baseline
        share is the centre's).
    maximum : float
        Stress on the axis, in Pa: the restored stress blurred by G.
    maximum_budget : mapping of str to float
        Its standard uncertainty by source, in Pa.
    electronic_noise : ndarray, shape of ``part.scan.u_zz``
        Electronic noise of each voltage, in V: as stated, or as found.
    contact_radius : float
        Of the frictionless contact at the nominal load, in m.
    noise_found : bool
        Whether the electronic noise was found from the scatter.
    """

    part: SingleLoad
    restoration: Restoration
    x: FloatArray
    y: FloatArray
    r: FloatArray
    s_zz: FloatArray
    covariances: Mapping[str, FloatArray]
    maximum: float
    maximum_budget: Mapping[str, float]
    electronic_noise: FloatArray
    contact_radius: float
    noise_found: bool

    def __repr__(self) -> str:
        """Return load, force and maximum in place of arrays."""
        force = format_measured(self.force, self.force_uncertainty, "N")
        top = format_measured(self.maximum * 1e-3, self.maximum_uncertainty * 1e-3, "kPa")
        return f"<MeasuredProfile: {self.part.label}, force {force}, maximum {top}>"

    @property
    def label(self) -> str:
        """Load and lubrication in words."""
        return self.part.label

    @property
    def load(self) -> float:
        """Nominal load, in N."""
        return self.part.load

    @property
    def lubrication(self) -> str:
        """``"dry"``, ``"lubricated"`` or empty."""
        return self.part.lubrication

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of ``s_zz``, all sources together, in Pa^2."""
        return np.asarray(np.sum(list(self.covariances.values()), axis=0))

    @property
    def s_zz_errors(self) -> FloatArray:
        """Standard uncertainty of ``s_zz``, in Pa."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def force(self) -> float:
        """Integral of the stress over the plane, in N."""
        return self.restoration.force

    @property
    def force_uncertainty(self) -> float:
        """Standard uncertainty of :attr:`force`, in N."""
        return self.restoration.force_uncertainty

    @property
    def force_budget(self) -> Mapping[str, float]:
        """Standard uncertainty of the force by source, in N."""
        return self.restoration.force_budget

    @property
    def maximum_uncertainty(self) -> float:
        """Standard uncertainty of :attr:`maximum`, in Pa."""
        return float(np.linalg.norm(list(self.maximum_budget.values())))

    @property
    def centre(self) -> FloatArray:
        """Centre (x0, y0) of the profile, in m; zero where a line does not tell."""
        return self.restoration.centre

    @property
    def centre_uncertainty(self) -> FloatArray:
        """Standard uncertainty of :attr:`centre`, in m."""
        return self.restoration.centre_uncertainty

    @property
    def baseline(self) -> float:
        """Baseline in the middle of the scan, in V."""
        return self.restoration.baseline

    @property
    def baseline_uncertainty(self) -> float:
        """Standard uncertainty of :attr:`baseline`, in V."""
        return self.restoration.baseline_uncertainty


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredStress:
    """The measured stress of all loads of one or several scans.

    Parameters
    ----------
    profiles : tuple of MeasuredProfile
        In the order of the scans, each from its smallest load up.
    apparatus : ApparatusFunction
        What it was measured with.
    scans : tuple of Scan
        What was measured; each names its file.
    checks : tuple of QualityCheck
        Those of each profile, numbered from one, then those of all together.
    messages : tuple of Message
        What a user should know.
    overridden : tuple of str
        Mismatches of artifact and scan that were accepted.
    configuration : mapping
        Options of the procedure.
    artifact : SourceFile, optional
        The file of the apparatus function, where it was read from one.
    parts : tuple of int
        How many profiles each scan has.
    """

    profiles: tuple[MeasuredProfile, ...]
    apparatus: ApparatusFunction
    scans: tuple[Scan, ...]
    checks: tuple[QualityCheck, ...]
    messages: tuple[Message, ...]
    overridden: tuple[str, ...]
    configuration: Mapping[str, Any]
    artifact: SourceFile | None = None
    parts: tuple[int, ...] = ()

    def __repr__(self) -> str:
        """Return the loads and the state of the checks."""
        failed = [check.name for check in self.checks if not check.passed]
        state = f"failed: {', '.join(failed)}" if failed else "all checks passed"
        loads = "; ".join(profile.label for profile in self.profiles)
        return f"<MeasuredStress: {loads}; {state}>"

    @property
    def passed(self) -> bool:
        """Whether every quality check passed."""
        return all(check.passed for check in self.checks)

    def scan_of(self, profile: MeasuredProfile) -> int:
        """Return which of the scans a profile comes from, counted from zero."""
        number = self.profiles.index(profile)
        return int(np.searchsorted(np.cumsum(self.parts), number, side="right"))

    def save(self, path: str | PathLike[str], *, overwrite: bool = False) -> None:
        """Write the measured stress to a file (memscal-stress).

        Two measurements of the same files with the same options give the same bytes while
        ``SOURCE_DATE_EPOCH`` is set.

        Raises
        ------
        OutputError
            If the file exists and ``overwrite`` is false, or cannot be written.
        """
        from memscal.formats.stress import write_stress
        from memscal.measurement.record import stress_record

        write_stress(stress_record(self), path, overwrite=overwrite)
