r"""Contact that slides on a bonded film: pressures, their shear, and the stress at the base.

With :math:`q = \mu p` along x the stress at the base is, in the film's transfer functions T and N
(:mod:`memscal.mechanics.film_response`) and the angle :math:`\varphi` of the wave vector to x,

.. math::

    \hat\sigma_{zz} = (T - i\mu\cos\varphi\,N)\,\hat p.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from memscal.mechanics.film_response import base_response
from memscal.model.arrays import FloatArray, floats, keyword_array_record
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter
from memscal.model.result import Shown

#: Base stresses are summed over wavenumbers up to this, in 1/h, and seen up to so many thicknesses
#: from the contact: the nearest image of the series, as far away, is below 1e-5 of the peak.
_HIGHEST = 20.0
_REACH = 16.0
#: Wavenumber in 1/h at which the spectrum tells the centroid, to 1e-6 of a thickness.
_LONG_WAVE = 1e-3
#: Places along the line of sliding at which the largest stress is sought.
_SAMPLES = 2001

ComplexArray = NDArray[np.complex128]


class Region(NamedTuple):
    """Where a contact ends along x, and how far it reaches to either side, in m."""

    low: float
    high: float
    half_width: float


@keyword_array_record
class SlidingContact(Shown):
    r"""A rigid indenter that slides on a bonded film, solved; from :func:`memscal.slide`.

    Parameters
    ----------
    film, indenter : ElasticFilm, Indenter
        What slides on what.
    load, depth : float
        Normal load in N, and indentation depth in m.
    friction : float
        Shear along x over pressure: negative where the indenter moves to smaller x on the film,
        and drags it that way.
    x, y : ndarray, shape (n,)
        Centres of square cells, in m from the indenter's lowest point.
    pressure : ndarray, shape (n, n)
        Pressure on each cell (y, x), in Pa.
    convergence : float
        Change of the base stress along the line of sliding from half as many cells across the
        contact, in its largest value; NaN where that was not asked.

    Notes
    -----
    Stresses are in Pa, compression positive.  The pressure's centroid need not lie below the
    indenter's lowest point; that of the base stress lies :math:`\mu h` farther along the shear, by
    the balance of moments.

    Examples
    --------
    >>> import memscal
    >>> film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> contact = memscal.slide(film, memscal.Sphere(radius=128.8e-3), load=1.37, friction=0.3)
    >>> print(f"{contact.surface_centroid * 1e3:.2f}, {contact.base_centroid * 1e3:.2f} mm")
    0.19, 0.79 mm
    """

    film: ElasticFilm
    indenter: Indenter
    load: float
    friction: float
    x: FloatArray
    y: FloatArray
    pressure: FloatArray
    depth: float
    convergence: float = np.nan

    def __repr__(self) -> str:
        """Return what slides, load, friction and depth in place of the pressures."""
        return (
            f"<SlidingContact: {self.indenter.shape}, {self.load:.4g} N, friction "
            f"{self.friction:.4g}, depth {self.depth * 1e6:.4g} um>"
        )

    @cached_property
    def region(self) -> Region:
        """Where the contact ends: smallest and largest x, half width; good to a third of a cell."""
        along = self.pressure.max(axis=0)
        low = _end(self.x[::-1], along[::-1])
        return Region(low, _end(self.x, along), _end(self.y, self.pressure.max(axis=1)))

    @property
    def tangential_load(self) -> float:
        """Force of the indenter on the film along x, in N."""
        return self.friction * self.load

    def interface_pressure(self, x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Return the pressure in Pa at places in m, which are broadcast; zero outside."""
        from scipy.interpolate import interpn

        places = (floats(y), floats(x))
        return floats(
            interpn((self.y, self.x), self.pressure, places, bounds_error=False, fill_value=0.0)
        )

    def base_stress(self, x: ArrayLike, y: ArrayLike = 0.0) -> FloatArray:
        """Return the normal stress at the base in Pa at places in m, which are broadcast.

        It is zero farther than 16 thicknesses from the contact.
        """
        h = self.film.thickness
        reach = np.abs([self.x, self.y]).max() + _REACH * h
        k = np.arange(0.0, _HIGHEST / h, np.pi / reach)
        # The transform is even in ky, and conjugate at -kx.
        weights = np.where(k > 0, 1.0, 0.5) / reach
        amplitudes = np.outer(weights, weights) * self.base_spectrum(k, k[:, None])
        rows = np.cos(np.multiply.outer(y, k)) @ amplitudes
        stress = np.vecdot(np.exp(-1j * np.multiply.outer(x, k)), rows).real
        return np.where(np.maximum(np.abs(x), np.abs(y)) <= reach, stress, 0.0)

    def base_spectrum(self, kx: ArrayLike, ky: ArrayLike) -> ComplexArray:
        r"""Return the transform of the base stress, in N.

        :math:`\int\sigma_{zz}\,e^{-i(k_x x + k_y y)}\,dx\,dy` at wavenumbers in rad/m, which are
        broadcast: the load where both are zero.
        """
        kh = np.hypot(kx, ky) * self.film.thickness
        by_pressure, by_shear = base_response(kh, self.film.poisson_ratio)
        shear = self.friction * np.cos(np.arctan2(ky, kx))
        rows = np.exp(1j * np.multiply.outer(ky, self.y)) @ self.pressure
        pressed = np.vecdot(np.exp(1j * np.multiply.outer(kx, self.x)), rows)
        cell = self.load / self.pressure.sum()
        return np.asarray(cell * pressed * (by_pressure - 1j * shear * by_shear))

    @property
    def surface_centroid(self) -> float:
        """Centroid of the pressure along x, in m."""
        return np.average(self.x, weights=self.pressure.sum(axis=0))

    @property
    def base_centroid(self) -> float:
        """Centroid of the normal stress at the base along x, in m."""
        k = _LONG_WAVE / self.film.thickness
        return float(-np.angle(self.base_spectrum(k, 0.0)) / k)

    @cached_property
    def max_base_stress(self) -> float:
        """Largest normal stress at the base, in Pa."""
        x = np.linspace(self.x[0], self.x[-1], _SAMPLES)
        return float(self.base_stress(x).max())


def _end(places: FloatArray, pressure: FloatArray) -> float:
    """Return where a pressure ends, whose square falls along a line."""
    last = np.flatnonzero(pressure)[-2:]
    return float(np.polyfit(pressure[last] ** 2, places[last], 1)[-1])
