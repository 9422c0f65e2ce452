"""What is really there in a synthetic experiment, against what its files state."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, Sphere

__all__ = ["Reality", "drawn"]


@dataclass(frozen=True, kw_only=True)
class Reality:
    """The true film, indenters and loads.

    Parameters
    ----------
    film, rod, sphere
        What is pressed on what.
    rod_load_scale, load_scale : float
        True loads of the rod, and of the sphere, relative to what is stated.
    """

    film: ElasticFilm
    rod: Rod
    sphere: Sphere
    rod_load_scale: float = 1.0
    load_scale: float = 1.0


def drawn(stated: Reality, load_uncertainty: float, seed: int) -> Reality:
    r"""Draw what is really there from what is stated, each with its standard uncertainty.

    All are normal and independent; a Poisson's ratio :math:`\nu` above 0.5 is reflected to
    :math:`1 - \nu`, because no film is more than incompressible.  What has no stated uncertainty
    stays as it is.

    Parameters
    ----------
    stated : Reality
        The nominal values, with their uncertainties.
    load_uncertainty : float
        Relative standard uncertainty of each common factor of the loads.
    seed : int
        Seed.

    Raises
    ------
    InputError
        If a value is drawn that no film and no indenter has, because its uncertainty is large.

    Examples
    --------
    >>> film = ElasticFilm(young_modulus=2e6, poisson_ratio=0.5, thickness=2e-3,
    ...                    poisson_ratio_uncertainty=0.01)
    >>> stated = Reality(film=film, rod=Rod(radius=0.25e-3), sphere=Sphere(radius=0.1288))
    >>> drawn(stated, 0.0, 1).film.poisson_ratio < 0.5, drawn(stated, 0.0, 1).film.thickness
    (True, 0.002)
    """
    rng = np.random.default_rng(seed)

    def around(value: float, uncertainty: float | None) -> float:
        # Drawn in any case: a source that is not stated moves no other.
        return value + (uncertainty or 0.0) * float(rng.standard_normal())

    film, rod, sphere = stated.film, stated.rod, stated.sphere
    modulus = around(film.young_modulus, film.young_modulus_uncertainty)
    ratio = around(film.poisson_ratio, film.poisson_ratio_uncertainty)
    thickness = around(film.thickness, film.thickness_uncertainty)
    return Reality(
        film=replace(
            film,
            young_modulus=modulus,
            poisson_ratio=0.5 - abs(0.5 - ratio),
            thickness=thickness,
        ),
        rod=replace(rod, radius=around(rod.radius, rod.radius_uncertainty)),
        sphere=replace(sphere, radius=around(sphere.radius, sphere.radius_uncertainty)),
        rod_load_scale=around(1.0, load_uncertainty),
        load_scale=around(1.0, load_uncertainty),
    )
