"""Base stresses of a sphere on a film under Amontons friction, along the friction coefficient."""

from __future__ import annotations

import math
from collections.abc import Sequence

from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.friction.assembly import FamilySetup, parameter_values
from memscal.friction.cache import CacheFolder
from memscal.friction.family import FRICTION_SCALE, ProfileFamily
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter

__all__ = ["FRICTIONS", "amontons_family"]

FRICTIONS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 1.0, math.inf)
"""Friction coefficients between which profiles are interpolated to 1e-3 of their maximum."""


def amontons_family(
    film: ElasticFilm,
    indenter: Indenter,
    loads: ArrayLike,
    *,
    friction: Sequence[float] = FRICTIONS,
    loading: str = "incremental",
    reach: float,
    cache: CacheFolder = None,
    workers: int = 1,
    order: int = 0,
) -> ProfileFamily:
    r"""Return the base stresses of a sphere on a film for a range of friction coefficients.

    Parameters
    ----------
    film : ElasticFilm
        The film; its stated uncertainties become ``changes`` of the family.
    indenter : Sphere
        The sphere.
    loads : array_like, shape (L,)
        Loads in N.
    friction : sequence of float
        Amontons' coefficients, increasing from 0 or above; the last may be ``inf``.
    loading : str
        ``"incremental"`` or ``"total"``: see :func:`memscal.indent`.
    reach : float
        Largest distance from the axis at which stresses will be asked for, in m.
    cache : path, optional
        Folder in which families are kept from one run to the next; without it nothing is written.
    workers : int
        Processes that share the work; the result is the same to rounding.
    order : int
        Zero for the normal stress at the base; one for its shear, which a tangential channel sees.

    Returns
    -------
    ProfileFamily

    Raises
    ------
    InputError
        If the indenter is no sphere, or an argument makes no sense.
    DomainError
        If a load lies outside what the model holds for.
    ConvergenceError
        If a contact does not settle.

    Examples
    --------
    >>> import numpy as np
    >>> from memscal.model.indenter import Sphere
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> family = amontons_family(
    ...     film, Sphere(radius=128.8e-3), [0.34], friction=[0, math.inf], reach=8e-3
    ... )
    >>> maxima = family.wavenumbers.synthesise(family.spectra[:, 0].T, np.array(0.0))
    >>> (maxima / 1e3).round(1)
    array([27.7, 30.9])
    """
    setup = FamilySetup.of(
        film, indenter, loads, reach=reach, cache=cache, workers=workers, order=order
    )
    values = parameter_values("friction coefficients", friction)
    if loading not in ("incremental", "total"):
        raise InputError(f'loading is {loading!r}, but it is "incremental" or "total".')
    paths = [setup.path(friction=float(mu), loading=loading) for mu in values]
    return setup.family(
        paths, name="amontons", loading=loading, values=values, scale=FRICTION_SCALE
    )
