r"""How base-stress transforms change with the properties of film and indenter.

A film is linear, and over a contact a sphere is a paraboloid :math:`r^2/2R` but for
:math:`r^2/4R^2` of its height (2e-4 at a contact radius of 3.5 mm under a sphere of 129 mm).  The
contact then has few scales.  With an interface that yields over a length :math:`\ell`,

.. math::

    \sigma(r) = \frac{E h}{R}\, f\!\left(\frac rh;\ \frac{PR}{Eh^3},\ \frac{\ell R}{h^2},\
    \mu, \nu\right),

so that all derivatives but that by Poisson's ratio follow from those by load, wavenumber and
length, which are known:

.. math::

    \frac{\partial\hat\sigma}{\partial\ln E} &= \hat\sigma
        - \frac{\partial\hat\sigma}{\partial\ln P}, \\
    \frac{\partial\hat\sigma}{\partial\ln R} &= -\hat\sigma
        + \frac{\partial\hat\sigma}{\partial\ln P}
        + \frac{\partial\hat\sigma}{\partial\ln\ell}, \\
    \frac{\partial\hat\sigma}{\partial\ln h} &= 3\hat\sigma
        + \frac{\partial\hat\sigma}{\partial\ln k}
        - 3\frac{\partial\hat\sigma}{\partial\ln P}
        - 2\frac{\partial\hat\sigma}{\partial\ln\ell}.

At :math:`k = 0`, where :math:`\hat\sigma = P`, all of them vanish: the base bears the load.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere
from memscal.model.validation import FloatArray

__all__ = ["poisson_ratios", "scaled_changes"]

#: Smaller steps of Poisson's ratio would show the rings' placing beside the change.
_SMALLEST_STEP = 0.01


def scaled_changes(
    film: ElasticFilm,
    indenter: Sphere,
    spectra: FloatArray,
    by_load: FloatArray,
    by_wavenumber: FloatArray,
    by_length: FloatArray,
) -> Mapping[str, FloatArray]:
    """Return the changes by one standard uncertainty that follow from the scales of a contact.

    Parameters
    ----------
    film, indenter
        Their stated uncertainties count; what is not stated is left out.
    spectra, by_load, by_wavenumber, by_length : ndarray, one shape
        Transforms and their derivatives by the logarithms of load, wavenumber and of the length
        over which the interface yields (zero for a rigid one), in N.

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
    >>> scaled_changes(film, Sphere(radius=0.1288), one, one, nothing, nothing)
    {'young_modulus': array([0., 0., 0.])}
    """
    derivatives = {
        "young_modulus": spectra - by_load,
        "thickness": 3 * spectra + by_wavenumber - 3 * by_load - 2 * by_length,
        "indenter_radius": -spectra + by_load + by_length,
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
