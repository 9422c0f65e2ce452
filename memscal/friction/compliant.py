r"""Base stresses of a sphere on a film whose interface yields, along the length of its law.

With friction the interface yields sideways before it slips (:func:`elasto_plastic_family`);
lubricated, it yields under pressure (:func:`normal_compliance_family`).  Both laws have one free
length, whose bounded coordinate has :math:`h^2/R` at its middle: twice the height to which the
sphere rises over a film's thickness, and the scale of the film's own displacements.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.friction.assembly import STRONGER, FamilySetup, parameter_values
from memscal.friction.cache import CacheFolder
from memscal.friction.family import ProfileFamily
from memscal.mechanics.interface import ExponentialCompliance, GreenwoodTripp, Interface
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter

__all__ = ["SLIP_LENGTHS", "elasto_plastic_family", "normal_compliance_family"]

SLIP_LENGTHS = (0.0, 0.15e-6, 0.5e-6, 1.5e-6, 4e-6, 1e-5, 3e-5, 1e-4, 4e-4, math.inf)
"""Slip lengths in m, from the rigid interface to the one that bears no shear."""

#: Lengths of a normally compliant interface in units of the film's roughness.
_LENGTHS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0)
#: Roughness in m where a film states none.
_USUAL_ROUGHNESS = 2e-6
#: Greenwood and Tripp's surfaces: asperity density times radius times roughness, and the ratio
#: of radius and roughness.
_ASPERITIES = 0.05
_SLENDERNESS = 100.0
#: Pressure at which mean planes meet, in units of the contact's modulus (exponential law): so
#: light that no contact rests above them, and no depth is zero.
_MEETING = 1e-6


def elasto_plastic_family(
    film: ElasticFilm,
    indenter: Indenter,
    loads: ArrayLike,
    *,
    friction: float,
    slip_lengths: Sequence[float] = SLIP_LENGTHS,
    reach: float,
    cache: CacheFolder = None,
    workers: int = 1,
) -> ProfileFamily:
    r"""Return the base stresses for a range of slip lengths at a given friction coefficient.

    The interface yields elastically before it slips: :math:`q = -\mu p\,e/\ell` for
    :math:`|e| \le \ell` (see :class:`memscal.Interface`).  Loading is incremental.

    Parameters
    ----------
    film, indenter, loads, reach, cache, workers
        As for :func:`memscal.friction.amontons.amontons_family`.
    friction : float
        The macroscopic coefficient :math:`\mu`, positive and finite.
    slip_lengths : sequence of float
        Slip lengths :math:`\ell` in m, increasing.  0 is the rigid interface at that friction;
        ``inf`` bears no shear, as the contact without friction.

    Returns
    -------
    ProfileFamily
        Its values are the slip lengths.

    Raises
    ------
    InputError, DomainError, ConvergenceError
        As there; and if the friction is not positive and finite.

    Examples
    --------
    The softer the interface, the nearer to the contact without friction:

    >>> import numpy as np
    >>> from memscal.model.indenter import Sphere
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> family = elasto_plastic_family(
    ...     film, Sphere(radius=128.8e-3), [0.34], friction=1.6, reach=8e-3,
    ...     slip_lengths=[0, 6e-6, math.inf],
    ... )
    >>> maxima = family.wavenumbers.synthesise(family.spectra[:, 0].T, np.array(0.0))
    >>> (maxima / 1e3).round(1)
    array([30.9, 29.9, 27.7])
    """
    setup = FamilySetup.of(film, indenter, loads, reach=reach, cache=cache, workers=workers)
    values = parameter_values("slip lengths", slip_lengths)
    if not 0 < friction < math.inf:
        raise InputError(
            f"The macroscopic friction coefficient is {friction:g}.",
            why="A slip length says at which displacement the shear reaches friction times "
            "pressure: without friction, or with an unlimited one, it says nothing.",
            cure="Give the coefficient at which the indenter slides, such as 1.6.",
        )
    paths = [
        setup.path(friction=0.0)
        if math.isinf(length)
        else setup.path(friction=float(friction), interface=Interface(slip_length=float(length)))
        for length in values
    ]
    return setup.family(
        paths,
        name="elasto-plastic",
        loading="incremental",
        values=values,
        scale=_natural_length(setup),
        a_length=True,
        notes=(f"Macroscopic friction coefficient {friction:g}.",),
    )


def normal_compliance_family(
    film: ElasticFilm,
    indenter: Indenter,
    loads: ArrayLike,
    *,
    lengths: Sequence[float] | None = None,
    law: str = "exponential",
    reach: float,
    cache: CacheFolder = None,
    workers: int = 1,
) -> ProfileFamily:
    r"""Return the base stresses without friction for a range of normal compliances.

    Parameters
    ----------
    film, indenter, loads, reach, cache, workers
        As for :func:`memscal.friction.amontons.amontons_family`.
    lengths : sequence of float, optional
        The law's length in m, increasing and finite; 0 is the rigid interface.  By default up to
        eight times the film's roughness (2 um where it states none).
    law : str
        ``"exponential"``: :math:`p = p_1 e^{-d/\lambda}`, with the length :math:`\lambda`.  The
        pressure :math:`p_1` only shifts the depth: the base stress does not depend on it.
        ``"greenwood-tripp"``: asperities with the length :math:`\sigma`, their roughness; fixed
        are :math:`\eta\beta\sigma = 0.05` and :math:`\beta/\sigma = 100`.

    Returns
    -------
    ProfileFamily
        Its values are the lengths.

    Raises
    ------
    InputError, DomainError, ConvergenceError
        As there; and if a length is not finite or the law is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> from memscal.model.indenter import Sphere
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> family = normal_compliance_family(
    ...     film, Sphere(radius=128.8e-3), [0.34], lengths=[0, 2e-6], reach=8e-3
    ... )
    >>> maxima = family.wavenumbers.synthesise(family.spectra[:, 0].T, np.array(0.0))
    >>> (maxima / 1e3).round(1)
    array([27.7, 25.5])
    """
    setup = FamilySetup.of(film, indenter, loads, reach=reach, cache=cache, workers=workers)
    if law not in ("exponential", "greenwood-tripp"):
        raise InputError(f'law is {law!r}, but it is "exponential" or "greenwood-tripp".')
    if lengths is None:
        unit = film.roughness_rms or _USUAL_ROUGHNESS
        lengths = [share * unit for share in _LENGTHS]
    values = parameter_values("lengths of the normal compliance", lengths)
    if math.isinf(values[-1]):
        raise InputError(
            "A length of the normal compliance is infinite: such a film bears no load."
        )
    paths, stronger = (
        [setup.path(friction=0.0, interface=_normal(law, film, float(v), s)) for v in values]
        for s in (1.0, STRONGER)
    )
    return setup.family(
        paths,
        name="normal-compliance",
        loading="",
        values=values,
        scale=_natural_length(setup),
        a_length=True,
        stronger=stronger if law == "greenwood-tripp" else None,
        notes=(_NORMAL_NOTES[law],),
    )


_NORMAL_NOTES = {
    "exponential": "Exponential law; the length is free.  Depths count from a pressure of "
    f"{_MEETING:g} times the contact modulus; the base stress does not depend on it.",
    "greenwood-tripp": "Greenwood-Tripp law; the roughness is free, density times radius times "
    f"roughness is {_ASPERITIES:g}, and the radius is {_SLENDERNESS:g} times the roughness.",
}


def _normal(law: str, film: ElasticFilm, length: float, strength: float) -> Interface:
    if length == 0:
        return Interface()
    if law == "exponential":
        meeting = _MEETING * film.contact_modulus
        return Interface(
            normal=ExponentialCompliance(decay_length=length, reference_pressure=meeting)
        )
    radius = _SLENDERNESS * length
    density = strength * _ASPERITIES / (radius * length)
    return Interface(
        normal=GreenwoodTripp(roughness=length, asperity_density=density, asperity_radius=radius)
    )


def _natural_length(setup: FamilySetup) -> float:
    """Return h^2/R, in m."""
    return setup.film.thickness**2 / setup.indenter.radius
