"""Measured stress as its file holds it."""

from __future__ import annotations

import platform

import numpy as np
import scipy

from memscal.formats.timestamp import timestamp
from memscal.measurement.measured_stress import MeasuredProfile, MeasuredStress
from memscal.model.provenance import Process
from memscal.model.stress_record import StressRecord, StressRecordProfile
from memscal.version import __version__

__all__ = ["stress_record"]


def stress_record(measured: MeasuredStress) -> StressRecord:
    """Return what a file of measured stress holds, with where it comes from."""
    first, known = measured.scans[0], measured.apparatus
    sources = tuple(scan.source for scan in measured.scans if scan.source is not None)
    return StressRecord(
        profiles=tuple(
            _profile(profile, measured.scan_of(profile)) for profile in measured.profiles
        ),
        film=first.film,
        indenter=first.indenter,
        sensor=first.sensor,
        conversion_constant=known.conversion_constant,
        conversion_constant_uncertainty=known.parameters.uncertainty("conversion_constant"),
        checks=measured.checks,
        overridden=measured.overridden,
        artifact=measured.artifact,
        scans=sources if len(sources) == len(measured.scans) else (),
        process=Process(
            program="memscal",
            version=__version__,
            date=timestamp(),
            configuration=measured.configuration,
            environment={
                "python": platform.python_version(),
                "numpy": np.__version__,
                "scipy": scipy.__version__,
            },
            messages=measured.messages,
        ),
    )


def _profile(profile: MeasuredProfile, scan: int) -> StressRecordProfile:
    return StressRecordProfile(
        load=profile.load,
        load_uncertainty=profile.part.scan.load_uncertainty,
        lubrication=profile.lubrication,
        scan=scan,
        r=profile.r,
        x=profile.x,
        y=profile.y,
        s_zz=profile.s_zz,
        covariances=profile.covariances,
        force=profile.force,
        maximum=profile.maximum,
        budget={"force": profile.force_budget, "maximum": profile.maximum_budget},
        centre=profile.centre,
        centre_uncertainty=profile.centre_uncertainty,
        baseline=profile.baseline,
        baseline_uncertainty=profile.baseline_uncertainty,
        contact_radius=profile.contact_radius,
    )
