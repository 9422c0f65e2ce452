r"""How base-stress transforms change with the properties of film and indenter.

A film is linear, and over a contact a sphere is a paraboloid :math:`r^2/2R` but for
:math:`r^2/4R^2` of its height (2e-4 at a contact radius of 3.5 mm under a sphere of 129 mm).  The
contact then has few scales.  With an interface that yields over a length :math:`\ell`, at pressures
in proportion to :math:`sE`,

.. math::

    \sigma(r) = \frac{E h}{R}\, f\!\left(\frac rh;\ \frac{PR}{Eh^3},\ \frac{\ell R}{h^2},\
    \frac{sR}{h},\ \mu, \nu\right),

so that all derivatives but that by Poisson's ratio follow from those by load, wavenumber, length
and strength, which are known:

.. math::

    \frac{\partial\hat\sigma}{\partial\ln E} &= \hat\sigma
        - \frac{\partial\hat\sigma}{\partial\ln P}, \\
    \frac{\partial\hat\sigma}{\partial\ln R} &= -\hat\sigma
        + \frac{\partial\hat\sigma}{\partial\ln P}
        + \frac{\partial\hat\sigma}{\partial\ln\ell}
        + \frac{\partial\hat\sigma}{\partial\ln s}, \\
    \frac{\partial\hat\sigma}{\partial\ln h} &= 3\hat\sigma
        + \frac{\partial\hat\sigma}{\partial\ln k}
        - 3\frac{\partial\hat\sigma}{\partial\ln P}
        - 2\frac{\partial\hat\sigma}{\partial\ln\ell}
        - \frac{\partial\hat\sigma}{\partial\ln s}.

The strength counts for asperities alone (Greenwood and Tripp): a slip length has none, and that of
an exponential law only shifts the depth.  At :math:`k = 0`, where :math:`\hat\sigma = P`, all of
them vanish: the base bears the load.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere
from memscal.model.validation import FloatArray

__all__ = ["LogDerivatives", "poisson_ratios", "scaled_changes"]

#: Smaller steps of Poisson's ratio would show the rings' placing beside the change.
_SMALLEST_STEP = 0.01


@dataclass(frozen=True, eq=False)
class LogDerivatives:
    """Transforms and their derivatives by logarithms, arrays of one shape, in N.

    Parameters
    ----------
    spectra : ndarray
        The transforms.
    load, wavenumber : ndarray
        Derivatives by load and wavenumber.
    length, strength : ndarray
        Derivatives by the length over which the interface yields and by the strength of its law;
        zero for a rigid interface.
    """

    spectra: FloatArray
    load: FloatArray
    wavenumber: FloatArray
    length: FloatArray
    strength: FloatArray


def scaled_changes(
    film: ElasticFilm, indenter: Sphere, by: LogDerivatives
) -> Mapping[str, FloatArray]:
    """Return the changes by one standard uncertainty that follow from the scales of a contact.

    Parameters
    ----------
    film, indenter
        Their stated uncertainties count; what is not stated is left out.
    by : LogDerivatives
        Transforms and what is known of their derivatives.

    Returns
    -------
    mapping of str to ndarray, in N
        ``"young_modulus"``, ``"thickness"`` and ``"indenter_radius"``, as far as stated.

    Examples
    --------
    A transform that is in proportion to the load does not depend on Young's modulus:

    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3,
    ...                    young_modulus_uncertainty=2.2e5)
    >>> one, nothing = np.ones(3), np.zeros(3)
    >>> by = LogDerivatives(one, load=one, wavenumber=nothing, length=nothing, strength=nothing)
    >>> scaled_changes(film, Sphere(radius=0.1288), by)
    {'young_modulus': array([0., 0., 0.])}
    """
    stiffer = by.spectra - by.load
    derivatives = {
        "young_modulus": stiffer,
        "thickness": 3 * stiffer + by.wavenumber - 2 * by.length - by.strength,
        "indenter_radius": -stiffer + by.length + by.strength,
    }
    stated = {
        "young_modulus": (film.young_modulus, film.young_modulus_uncertainty),
        "thickness": (film.thickness, film.thickness_uncertainty),
        "indenter_radius": (indenter.radius, indenter.radius_uncertainty),
    }
    return {
        source: np.asarray(derivatives[source] * (uncertainty / value))
        for source, (value, uncertainty) in stated.items()
        if uncertainty is not None
    }


def poisson_ratios(film: ElasticFilm) -> tuple[float, float] | None:
    """Return the two Poisson's ratios whose difference shows its influence.

    ``None`` where its uncertainty is not stated or zero.  An incompressible film is at the end of
    the range: the difference is then one-sided.
    """
    if not (u := film.poisson_ratio_uncertainty):
        return None
    step = max(u, _SMALLEST_STEP)
    return min(film.poisson_ratio + step, 0.5), max(film.poisson_ratio - step, 0.0)
