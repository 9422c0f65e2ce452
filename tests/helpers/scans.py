"""Scans and their steps, shared by the tests of estimation and calibration."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import memscal
from memscal.estimation.points import ScanPoints, measured_points
from memscal.estimation.profile import ProfileEstimate, estimate_profile
from memscal.estimation.reference import reference_spectrum
from memscal.model.scan import Scan
from memscal.simulation.rod_scan import PAPER_FILM, PAPER_ROD

CONVERSION = 1e-7
SIGMA = 561e-6
RING = memscal.GaussianMixture((1.3, -0.3), (0.6e-3, 0.3e-3))
TAILS = memscal.GaussianMixture((0.75, 0.25), (0.5e-3, 1.0e-3))

# Inputs without uncertainty, so that what is left in a budget is noise alone.
EXACT_FILM = replace(
    PAPER_FILM,
    young_modulus_uncertainty=None,
    poisson_ratio_uncertainty=None,
    thickness_uncertainty=None,
)
EXACT_ROD = replace(PAPER_ROD, radius_uncertainty=None)


def simulated(**options: Any) -> Scan:
    """Simulate a scan whose film, rod and load are exact."""
    exact = {"film": EXACT_FILM, "rod": EXACT_ROD, "load_uncertainty": None}
    return memscal.simulate(**(exact | options))


def estimated(scan: Scan) -> ProfileEstimate:
    """Estimate the profile of a scan with the rod's own solution as reference."""
    points: ScanPoints = measured_points(scan)
    contact = memscal.indent(scan.film, scan.indenter, load=scan.load)
    return estimate_profile(points, reference_spectrum(contact, points, scan.film.thickness))


def as_points(scan: Scan, seed: int = 0) -> Scan:
    """Return the same readings as single points, in random order."""
    order = np.random.default_rng(seed).permutation(scan.u_zz.size)
    x, y = (positions.ravel()[order] for positions in scan.positions)
    along = y if scan.direction == "y" else x
    names = ("u_zz", "u_zz_errors", "normal_load", "normal_load_errors")
    values = {name: getattr(scan, name) for name in names if getattr(scan, name) is not None}
    if scan.x_errors is not None:
        values["x_errors"] = np.broadcast_to(scan.x_errors, scan.u_zz.shape)
    changes = {name: array.ravel()[order] for name, array in values.items()}
    changes |= {"x": along, "y": y} if scan.planar else {"x": along}
    return replace(scan, **changes, repeat=scan.passes.ravel()[order], channels={})


def plane_error(r: np.ndarray, found: np.ndarray, truth: np.ndarray) -> float:
    """Relative L2 error over the plane, for a radial function on even radii."""
    return float(np.sqrt(np.sum(r * (found - truth) ** 2) / np.sum(r * truth**2)))
