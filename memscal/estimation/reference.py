"""The reference stress of a calibration: where it comes from, and its transform."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers, hankel_transform
from memscal.errors import InputError
from memscal.estimation.points import ScanPoints
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, RoundIndenter
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.model.validation import FloatArray

__all__ = [
    "reference_contact",
    "reference_profile",
    "reference_sensitivities",
    "reference_spectrum",
    "require_calibration_rod",
]

#: The film passes nothing of exp(-kh) beyond this: 2e-9 of the load.
_LARGEST_KH = 20.0
#: A table that ends inside the scan must have decayed to this share of its maximum.
_DECAYED = 1e-3


def require_calibration_rod(scan: Scan) -> None:
    """Refuse an indenter that cannot calibrate.

    Raises
    ------
    InputError
        If the indenter is no rod, or is wider than the film is thick.
    """
    if not isinstance(scan.indenter, Rod):
        raise InputError(
            f"The scan was made with a {scan.indenter.shape}, but a calibration needs a rod.",
            why="Only a contact smaller than the film's thickness is independent of friction and "
            "linear in load.",
            cure="Calibrate with a rod scan, then apply the apparatus function to this scan.",
        )
    diameter, thickness = 2 * scan.indenter.radius, scan.film.thickness
    if diameter > thickness:
        raise InputError(
            f"The rod is {diameter * 1e3:g} mm wide, but the film is only "
            f"{thickness * 1e3:g} mm thick.",
            why="The stress at the base then depends on friction under the rod, and carries too "
            "little fine detail to resolve the apparatus function.",
            cure="Use a rod narrower than the film is thick; check /entry/indenter/radius.",
        )


def reference_contact(film: ElasticFilm, indenter: RoundIndenter, load: float) -> Contact:
    """Solve the rod of a scan, frictionless: friction changes its base stress by about 1e-3."""
    return indent(film, indenter, load=load)


def reference_profile(
    scan: Scan, reference: StressProfile | Contact | None
) -> StressProfile | Contact:
    """Choose the reference: the one given, the scan's own, or the rod's solution."""
    if reference is not None:
        return reference
    if scan.reference is not None:
        return scan.reference
    return reference_contact(scan.film, scan.indenter, scan.load)


def reference_spectrum(
    reference: StressProfile | Contact, points: ScanPoints, thickness: float
) -> RadialSpectrum:
    """Transform of the reference per newton, on nodes that serve every distance of the scan.

    Parameters
    ----------
    reference : StressProfile or Contact
        The base stress.
    points : ScanPoints
        Where the scan was measured.
    thickness : float
        Film thickness, in m: it bounds the wavenumbers that reach the base.

    Raises
    ------
    InputError
        If a table ends inside the scan before its stress has decayed, or carries no force.
    """
    span = float(np.hypot(np.ptp(points.x), np.ptp(points.y)))
    # Fields are lifted to squares that reach one span from the centre, to their corners.
    corner = 1.5 * span
    wavenumbers = Wavenumbers.covering(_LARGEST_KH / thickness, corner)
    if isinstance(reference, Contact):
        return RadialSpectrum(wavenumbers, reference.base_spectrum(wavenumbers.k) / reference.load)
    _require_coverage(reference, span)
    values = hankel_transform(reference.r, reference.sigma_zz, wavenumbers.k) / reference.load
    if values[0] <= 0:
        raise InputError(
            "The stress of the reference adds up to a pull, not a push.",
            why="Normal stress is positive in compression.",
            cure="Change the sign of sigma_zz in the reference.",
        )
    return RadialSpectrum(wavenumbers, values)


def _require_coverage(profile: StressProfile, span: float) -> None:
    needed = span / 2
    tail = abs(float(profile.sigma_zz[-1])) / float(np.abs(profile.sigma_zz).max())
    if profile.r[-1] < needed and tail > _DECAYED:
        raise InputError(
            f"The reference ends at r = {profile.r[-1] * 1e3:.4g} mm with {tail:.1%} of its "
            f"maximum left, but the scan reaches {needed * 1e3:.4g} mm from its middle.",
            why="The stress beyond the table would be missing from every distant point.",
            cure="Extend the reference to where it has decayed, or leave it out to compute it.",
        )
    first = float(profile.r[0])
    if first > 0.1 * needed:
        raise InputError(
            f"The reference begins at r = {first * 1e3:.4g} mm.",
            why="The stress on the axis, its largest, is missing.",
            cure="Give the reference from r = 0 outward.",
        )


def reference_sensitivities(scan: Scan, reference: RadialSpectrum) -> Mapping[str, FloatArray]:
    r"""Change of the reference's transform by one standard uncertainty of each source.

    The rod's solution is varied by its thickness, Poisson's ratio and radius, by centred
    differences (one-sided at nu = 1/2); for a reference from elsewhere, the relative change is
    taken over.  At a given load the base stress of a linear film does not depend on Young's
    modulus: its contribution is zero, and is stated.

    Returns
    -------
    mapping of str to ndarray, shape of ``reference.values``
        By source, for the sources whose uncertainty is stated.
    """
    film, rod, k = scan.film, scan.indenter, reference.wavenumbers.k

    def transform(new_film: ElasticFilm, new_rod: RoundIndenter) -> FloatArray:
        return reference_contact(new_film, new_rod, scan.load).base_spectrum(k)

    centre = transform(film, rod)
    changes: dict[str, FloatArray] = {}
    if film.young_modulus_uncertainty is not None:
        changes["young_modulus"] = np.zeros_like(k)
    if u := film.thickness_uncertainty:
        upper = transform(replace(film, thickness=film.thickness + u), rod)
        lower = transform(replace(film, thickness=film.thickness - u), rod)
        changes["thickness"] = (upper - lower) / 2
    if u := film.poisson_ratio_uncertainty:
        nu = film.poisson_ratio
        above, below = min(nu + u, 0.5), max(nu - u, 0.0)
        upper = transform(replace(film, poisson_ratio=above), rod)
        lower = transform(replace(film, poisson_ratio=below), rod)
        changes["poisson_ratio"] = (upper - lower) * u / (above - below)
    if u := rod.radius_uncertainty:
        upper = transform(film, replace(rod, radius=rod.radius + u))
        lower = transform(film, replace(rod, radius=max(rod.radius - u, rod.radius / 2)))
        changes["rod_radius"] = (upper - lower) / 2
    scale = reference.values / centre
    return {source: change * scale for source, change in changes.items()}
