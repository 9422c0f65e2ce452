"""Putting a calibration's results together as an apparatus function."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import scipy

from memscal.apparatus import ApparatusFunction
from memscal.calibration.solution import Solution
from memscal.calibration.uncertainty import Results
from memscal.estimation.forward import unit_gaussian
from memscal.formats.timestamp import timestamp
from memscal.mechanics.contact import Contact
from memscal.model.apparatus import (
    ApparatusField,
    ApparatusRadial,
    Reconvolution,
    TransferFunction,
)
from memscal.model.checks import Message, QualityCheck
from memscal.model.provenance import Process
from memscal.model.scan import StressSensor
from memscal.model.validation import FloatArray
from memscal.version import __version__

__all__ = ["assemble"]


def assemble(
    solution: Solution,
    results: Results,
    checks: tuple[QualityCheck, ...],
    messages: tuple[Message, ...],
    configuration: Mapping[str, Any],
) -> ApparatusFunction:
    """Return the apparatus function with everything that its artifact stores."""
    scan, stress = solution.scan, solution.stress
    reference = stress.profile() if isinstance(stress, Contact) else stress
    return ApparatusFunction(
        field=_field(solution, results),
        radial_profile=_radial(solution, results),
        transfer=_transfer(solution, results),
        reconvolution=_reconvolution(solution),
        parameters=results.parameters,
        checks=checks,
        film=scan.film,
        indenter=scan.indenter,
        sensor=_sensor(solution),
        load=scan.load,
        reference=reference,
        process=Process(
            program="memscal",
            version=__version__,
            date=timestamp(),
            configuration={
                **configuration,
                "grid": dict(solution.choice.reasons),
                "relevant_wavenumber_rad_per_mm": solution.band.relevant * 1e-3,
                **_further_scans(solution),
            },
            environment={
                "python": platform.python_version(),
                "numpy": np.__version__,
                "scipy": scipy.__version__,
            },
            messages=messages,
            input_scan=scan.source,
            input_reference=reference.source,
        ),
        budget=results.budget,
    )


def _sensor(solution: Solution) -> StressSensor:
    """The sensor, by the channel that was calibrated: a scan's own is the normal one."""
    channel, sensor = solution.estimate.points.channel, solution.scan.sensor
    return sensor if channel == "zz" else replace(sensor, channel=channel)


def _further_scans(solution: Solution) -> dict[str, Any]:
    """Where the scans beside the first came from."""
    sources = [scan.source for scan in solution.scans[1:]]
    if not sources:
        return {}
    listed = [
        None if s is None else {"file_name": s.file_name, "sha256": s.sha256} for s in sources
    ]
    return {"further_scans": listed}


def _field(solution: Solution, results: Results) -> ApparatusField:
    g = solution.deconvolution.g
    errors = np.sqrt(np.diag(results.radial_covariance))
    radius = np.hypot.outer(g.y, g.x)
    return ApparatusField(g.x, g.y, g.image, np.interp(radius, g.r, errors))


def _radial(solution: Solution, results: Results) -> ApparatusRadial:
    g = solution.deconvolution.g
    covariance = results.radial_covariance
    gaussian = unit_gaussian(g.r, solution.estimate.gaussian.sigma)
    errors = np.sqrt(np.diag(covariance))
    with_a = results.cross_covariance[:, results.parameters.names.index("conversion_constant")]
    scale = errors * results.parameters.uncertainty("conversion_constant")
    correlation = np.divide(with_a, scale, out=np.zeros_like(with_a), where=scale > 0)
    return ApparatusRadial(g.r, g.radial, errors, gaussian, covariance, correlation)


def _transfer(solution: Solution, results: Results) -> TransferFunction:
    fields, deconvolution = solution.fields, solution.deconvolution
    a, quotient = deconvolution.conversion_constant, deconvolution.quotient
    k, modulus = fields.along_axis(np.abs(fields.grid.transfer(quotient.values)) / a)
    window = fields.along_axis(quotient.window)[1]
    return TransferFunction(k, modulus, results.transfer_errors, window, solution.band.resolved)


def _reconvolution(solution: Solution) -> Reconvolution:
    estimate = solution.estimate
    points = estimate.points
    # A raster is shown against the distance from the centre: a line has a side, a plane has not.
    along = points.x if points.free[0, 0] else points.y
    place = estimate.distance if points.planar or points.scans > 1 else along
    if points.scans > 1 and estimate.model.order:
        # A shear has a side, too.
        place = estimate.offset[estimate.model.axis]
    order = np.argsort(place, kind="stable")

    def sorted_(values: FloatArray) -> FloatArray:
        return np.asarray(values[order])

    return Reconvolution(
        x=sorted_(place),
        u_zz=sorted_(points.u),
        u_zz_errors=sorted_(estimate.noise),
        u_zz_predicted=sorted_(solution.deconvolution.predicted),
        u_zz_gaussian=sorted_(estimate.gaussian.predicted),
        residual=sorted_(points.u - solution.deconvolution.predicted),
    )
