r"""Interface between indenter and film: friction, and the compliance of a rough surface.

A smooth interface that obeys Amontons' law is rigid.  A rough one yields normally as the mean
planes approach, and tangentially, elastically up to a slip length :math:`\ell` of the order of
the rms roughness: :math:`q = -\mu p\,e/\ell` for an elastic displacement :math:`|e| \le \ell`
(Bureau, Caroli and Baumberger, Proc. R. Soc. A 459 (2003) 2787).
"""

from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import gamma, pbdv

from memscal.model.arrays import (
    FloatArray,
    floats,
    keyword_value_record,
    require_non_negative,
    require_positive,
)
from memscal.model.film import ElasticFilm

# Separations, in units of the law's length, between which a law is inverted.
_CLOSEST = -60.0
_FARTHEST = 12.0
# Below this height, in units of the roughness, the moments are summed as a series.
_DEEP = -20.0
# Entries of the table of the moment.
_ENTRIES = 3601


@keyword_value_record
class GreenwoodTripp:
    r"""Normal compliance of a rough film under a smooth indenter.

    Asperities of equal tip radius and Gaussian heights bear the pressure

    .. math::

        p(d) = \tfrac43\,\eta\,E^*\sqrt{\beta}\,\sigma^{3/2}\,F_{3/2}(d/\sigma), \qquad
        F_n(t) = \int_t^\infty (s - t)^n\,\frac{e^{-s^2/2}}{\sqrt{2\pi}}\,ds

    at the separation :math:`d` (Greenwood and Tripp, J. Appl. Mech. 34 (1967) 153).

    Parameters
    ----------
    roughness : float
        Standard deviation :math:`\sigma` of the asperities' heights, in m; 0 is rigid.
    asperity_density : float
        Number :math:`\eta` of asperities per area, in 1/m^2.
    asperity_radius : float
        Radius :math:`\beta` of their tips, in m.

    Examples
    --------
    In the lengths of the original paper, with its parameter mu = 4, the pressure at d = sigma:

    >>> film = ElasticFilm(young_modulus=0.75e6, poisson_ratio=0.5, thickness=1.0)
    >>> law = GreenwoodTripp(roughness=1.0, asperity_density=3.0, asperity_radius=1.0)
    >>> round(1e-6 * float(law.pressure(np.array(1.0), film)), 4)  # in MPa
    0.3027
    """

    roughness: float
    asperity_density: float
    asperity_radius: float

    def __post_init__(self) -> None:
        require_non_negative("roughness of the interface", self.roughness)
        require_positive("asperity density", self.asperity_density, "1/m^2")
        require_positive("asperity radius", self.asperity_radius, "m")

    @property
    def length(self) -> float:
        """The roughness, in m."""
        return self.roughness

    def pressure(self, separation: FloatArray, film: ElasticFilm) -> FloatArray:
        """Return the pressure in Pa at a ``separation`` in m."""
        return floats(self._scale(film) * np.exp(_splines()[0](self._height(separation))))

    def stiffness(self, separation: FloatArray, film: ElasticFilm) -> FloatArray:
        """Return minus the derivative of the pressure by the separation, in Pa/m."""
        slope = _splines()[0](self._height(separation), 1)
        return floats(-self.pressure(separation, film) * slope / self.roughness)

    def separation(self, pressure: FloatArray, film: ElasticFilm) -> FloatArray:
        """Return the separation in m at which the pressure is ``pressure`` in Pa."""
        log_moment, height_of = _splines()
        logarithm = np.log(pressure / self._scale(film))
        height = height_of(logarithm)
        # One step of Newton's method ties the inverse to the law itself.
        height += (logarithm - log_moment(height)) / log_moment(height, 1)
        return floats(self.roughness * np.clip(height, _CLOSEST, _FARTHEST))

    def _height(self, separation: FloatArray) -> FloatArray:
        return np.clip(separation / self.roughness, _CLOSEST, _FARTHEST)

    def _scale(self, film: ElasticFilm) -> float:
        bearing: float = self.asperity_density * self.asperity_radius**0.5 * self.roughness**1.5
        return 4 / 3 * film.contact_modulus * bearing


@keyword_value_record
class ExponentialCompliance:
    r"""Normal compliance :math:`p = p_1\,e^{-d/\lambda}`.

    It is the limit of light pressure of rough surfaces with many scales, where the length
    :math:`\lambda` is of the order of half the rms roughness and :math:`p_1` of the order of the
    modulus (Persson, Phys. Rev. Lett. 99 (2007) 125502).

    Parameters
    ----------
    decay_length : float
        :math:`\lambda`, in m; 0 is rigid.
    reference_pressure : float
        :math:`p_1`, the pressure at which the mean planes meet (d = 0), in Pa.

    Examples
    --------
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> law = ExponentialCompliance(decay_length=1e-6, reference_pressure=1e6)
    >>> float(law.pressure(np.array(0.0), film))
    1000000.0
    """

    decay_length: float
    reference_pressure: float

    def __post_init__(self) -> None:
        require_non_negative("decay length of the interface", self.decay_length)
        require_positive("reference pressure of the interface", self.reference_pressure, "Pa")

    @property
    def length(self) -> float:
        """The decay length, in m."""
        return self.decay_length

    # Both take the film as every law does; this one does not depend on it.
    def pressure(self, separation: FloatArray, film: ElasticFilm) -> FloatArray:  # noqa: ARG002
        """Return the pressure in Pa at a ``separation`` in m."""
        return self.reference_pressure * np.exp(-separation / self.decay_length)

    def stiffness(self, separation: FloatArray, film: ElasticFilm) -> FloatArray:
        """Return minus the derivative of the pressure by the separation, in Pa/m."""
        return self.pressure(separation, film) / self.decay_length

    def separation(self, pressure: FloatArray, film: ElasticFilm) -> FloatArray:  # noqa: ARG002
        """Return the separation in m at which the pressure is ``pressure`` in Pa."""
        return -self.decay_length * np.log(pressure / self.reference_pressure)


NormalLaw = GreenwoodTripp | ExponentialCompliance


@keyword_value_record
class Interface:
    r"""Compliance of the interface between indenter and film; rigid by default.

    Parameters
    ----------
    normal : GreenwoodTripp or ExponentialCompliance, optional
        Law of pressure against the separation of the mean planes.  Depths then count from where
        the mean planes would meet: a light contact, which rests on the highest asperities, has a
        negative one.
    slip_length : float
        Elastic tangential displacement :math:`\ell` at which the interface slips, in m.

    Raises
    ------
    InputError
        If the slip length is negative or not finite.

    Examples
    --------
    >>> Interface(slip_length=1.82e-6).rigid, Interface().rigid
    (False, True)
    """

    normal: NormalLaw | None = None
    slip_length: float = 0.0

    def __post_init__(self) -> None:
        require_non_negative("slip length", self.slip_length)

    @property
    def normal_law(self) -> NormalLaw | None:
        """The normal law, or ``None`` where it is rigid."""
        return self.normal if self.normal and self.normal.length > 0 else None

    @property
    def description(self) -> str:
        """What yields, in words; empty for a rigid interface."""
        compliances = []
        law = self.normal_law
        if isinstance(law, GreenwoodTripp):
            compliances.append(
                f"Greenwood-Tripp law (roughness {law.roughness * 1e6:.4g} um, "
                f"{law.asperity_density * 1e-6:.4g} asperities per mm^2 of radius "
                f"{law.asperity_radius * 1e6:.4g} um)"
            )
        elif law:
            compliances.append(
                f"exponential law (length {law.decay_length * 1e6:.4g} um, "
                f"{law.reference_pressure * 1e-6:.4g} MPa where mean planes meet)"
            )
        if self.slip_length > 0:
            compliances.append(f"slip length {self.slip_length * 1e6:.4g} um")
        return ", ".join(compliances)

    @property
    def rigid(self) -> bool:
        """Whether nothing yields."""
        return not self.normal_law and self.slip_length == 0


@lru_cache(maxsize=1)
def _splines() -> tuple[Any, Any]:
    """Return ln F_3/2 over the height, and the height over it: splines, good to 1e-9 and fast."""
    from scipy.interpolate import CubicSpline

    heights = np.linspace(_CLOSEST, _FARTHEST, _ENTRIES)
    logarithms = np.log(_gaussian_moment(heights))
    return CubicSpline(heights, logarithms), CubicSpline(logarithms[::-1], heights[::-1])


def _gaussian_moment(t: FloatArray) -> FloatArray:
    r"""Return :math:`F_{3/2}(t)`; with a parabolic cylinder function (Gradshteyn 3.462.1)."""
    shallow = np.clip(t, _DEEP, _FARTHEST)
    cylinder, _ = pbdv(-2.5, shallow)
    closed = gamma(2.5) / np.sqrt(2 * np.pi) * np.exp(-(shallow**2) / 4) * cylinder
    # Deep in the surface every asperity touches: the moment of a Gaussian far above its mean,
    # where the cylinder function overflows.
    deep = np.minimum(t, _DEEP)
    first = 3 / 8 / deep**2  # n (n - 1)/2
    second = first * 3 / 16 / deep**2  # (n - 2) (n - 3)/4
    return floats(np.where(t < _DEEP, (-deep) ** 1.5 * (1 + first + second), closed))
