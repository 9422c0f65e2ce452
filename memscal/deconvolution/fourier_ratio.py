r"""Fourier ratio, the paper's method on arrays: lift, divide, normalise, convolve back.

.. math::

    U_{zz} = A\,G \otimes \sigma_{zz}, \qquad
    A\,G = \mathcal F^{-1}\left\{\frac{\mathcal F\{U_{zz}\}}{\mathcal F\{\sigma_{zz}\}}\right\},
    \qquad A = \int A\,G\,dx\,dy

(the paper's Eq. 1 to 3).  :func:`memscal.calibrate` calls these functions; they take radial
profiles from any source.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from memscal.axisymmetry.grids import EvenGrid, FieldGrid, on_grid
from memscal.axisymmetry.hankel import radial_spline, up_to
from memscal.deconvolution.division import (
    DivisionProblem,
    MethodName,
    Regulariser,
    chosen_method,
)
from memscal.errors import FitError, InputError
from memscal.estimation.bayesian import Bayesian
from memscal.model.arrays import (
    ArrayPair,
    FloatArray,
    array_record,
    finite_vector,
    require_increasing,
    require_positive,
)
from memscal.progress import reported

#: A field of more points along half its side takes gigabytes.
_MOST_POINTS = 8192


@array_record
class Field:
    """A field over the plane, about its axis of symmetry; from :func:`lift`.

    Parameters
    ----------
    grid : FieldGrid
        Where its values lie.
    values : ndarray
        Values in the layout of the grid, in the unit of what was lifted.

    Examples
    --------
    >>> import numpy as np
    >>> import memscal
    >>> r = np.linspace(0, 6e-3, 241)
    >>> narrow = memscal.lift(r, np.exp(-((r / 0.6e-3) ** 2)), 0.1e-3, 8e-3)
    >>> wide = memscal.lift(r, np.exp(-((r / 1e-3) ** 2)), 0.1e-3, 8e-3)
    >>> round(1e6 * float(wide.integral) / np.pi, 6), isinstance(wide.grid, memscal.FieldGrid)
    (1.0, True)
    """

    grid: FieldGrid
    values: FloatArray

    def __repr__(self) -> str:
        """Return size and spacing in place of the values."""
        step = (self.x[1] - self.x[0]) * 1e3
        return f"<{type(self).__name__}: {self.y.size} x {self.x.size} points, {step:.4g} mm apart>"

    @property
    def x(self) -> FloatArray:
        """Positions along x, shape (n,), in m."""
        return self.grid.axes[0]

    @property
    def y(self) -> FloatArray:
        """Positions along y, shape (m,), in m."""
        return self.grid.axes[1]

    @property
    def image(self) -> FloatArray:
        """The whole plane, shape (m, n), the axis of symmetry at its central pixel."""
        return self.grid.to_image(self.values)

    @property
    def integral(self) -> float:
        """Integral over the plane, in the unit of the values times m^2."""
        return self.grid.integrate(self.values)

    @property
    def r(self) -> FloatArray:
        """Radii of the profile, shape (p,), in m."""
        return self.x[self.x.size // 2 :]

    @cached_property
    def radial(self) -> FloatArray:
        """Radial profile at :attr:`r`, shape (p,): along an axis, or the mean over directions."""
        return self.grid.radial(self.values)[1]

    @cached_property
    def transform(self) -> FloatArray:
        """Fourier transform, in the layout of the grid and the unit of the values times m^2."""
        return self.grid.forward(self.values)

    def spectrum(self) -> ArrayPair:
        """Return wavenumbers along x, in rad/m, and the modulus of the Fourier transform there."""
        return self.grid.wavenumber[0], np.abs(self.transform[0])


@array_record
class Quotient(Field):
    """The quotient of two fields, A G; from :func:`divide`.

    Parameters
    ----------
    window : ndarray
        What the regularisation leaves of each spectral component, from 0 to 1.

    Examples
    --------
    >>> import numpy as np
    >>> import memscal
    >>> r = np.linspace(0, 6e-3, 241)
    >>> narrow = memscal.lift(r, np.exp(-((r / 0.6e-3) ** 2)), 0.1e-3, 8e-3)
    >>> wide = memscal.lift(r, np.exp(-((r / 1e-3) ** 2)), 0.1e-3, 8e-3)
    >>> quotient = memscal.divide(wide, narrow, weakest=1e-4 * narrow.integral)
    >>> float(quotient.window.max()) <= 1.0
    True
    """

    window: FloatArray


def lift(r: FloatArray, profile: FloatArray, spacing: float, extent: float) -> Field:
    """Lift a radial profile to its axisymmetric field over the plane.

    Parameters
    ----------
    r : ndarray, shape (n,)
        Radii, increasing from zero, in m; four or more.
    profile : ndarray, shape (n,)
        Values there.  An even cubic spline interpolates them; beyond ``r[-1]`` the field is zero.
    spacing : float
        Distance of neighbouring points of the field, in m.
    extent : float
        Half of the field's side, in m: at least the reach of the profile and of the G to be
        found together, so that nothing wraps around.

    Returns
    -------
    Field
        Values of the profile's unit.

    Raises
    ------
    InputError
        If the radii do not increase, a value is not finite, or the spacing does not fit.

    Examples
    --------
    >>> import numpy as np
    >>> r = np.linspace(0, 4e-3, 81)
    >>> stress = lift(r, np.exp(-((r / 1e-3) ** 2)), spacing=0.1e-3, extent=8e-3)
    >>> float(stress.integral / (np.pi * 1e-6)).__round__(6)
    1.0
    """
    r = finite_vector("r", r)
    profile = finite_vector("profile", profile)
    if r.shape != profile.shape:
        raise InputError(f"r and the profile differ in length: {r.size} and {profile.size}.")
    require_increasing("r", r)
    if r[0] < 0:
        raise InputError(f"r begins at {r[0]:g} m.", cure="Give radii from the axis outward.")
    if not 0 < spacing < extent <= _MOST_POINTS * spacing:
        raise InputError(
            f"A field of half side {extent:g} m cannot have points {spacing:g} m apart.",
            cure=f"Give both in m: the extent is one to {_MOST_POINTS} times the spacing.",
        )
    ending = partial(up_to, r[-1], radial_spline(r, profile))
    grid = EvenGrid(int(np.ceil(extent / spacing)) + 1, spacing)
    return Field(grid, on_grid(ending, grid, spacing / 2))


@reported
def divide(
    voltage: Field,
    stress: Field,
    *,
    weakest: float | tuple[float, float],
    method: MethodName | Regulariser = "white-noise",
    options: Mapping[str, Any] | None = None,
) -> Quotient:
    r"""Divide a voltage field by a stress field in Fourier space, with regularisation.

    .. math:: A\,G = \mathcal F^{-1}\{ w\,\mathcal F\{U\} / \mathcal F\{\sigma\} \}

    with the window w of the method: of white noise of amplitude s, a tenth of the weakest
    relevant component, in expectation :math:`w = 1 - \exp(-|\hat\sigma|^2/s^2)`.

    Parameters
    ----------
    voltage : Field
        Voltage less its baseline, about its centre, in V.
    stress : Field
        Base stress on the same grid, in Pa.
    weakest : float or (float, float)
        Modulus of the weakest relevant component of the stress's transform, in N: where the
        voltage's spectrum still stands clear of its noise (the paper's rule).  With a second
        number, that of the voltage's transform, in V m^2; otherwise it is read off where the
        stress's transform first falls to the first, or at the last wavenumber.
    method : str or Regulariser, default "white-noise"
        One of the methods of :func:`memscal.calibrate` that divide fields.
    options : mapping of str to value, optional
        Parameters of the method, such as ``amplitude``.

    Returns
    -------
    Quotient
        A G, in V/Pa/m^2.

    Raises
    ------
    InputError
        If the fields lie on different grids, ``weakest`` is no positive number, or the method
        or one of its options does not exist.

    Examples
    --------
    >>> import memscal, numpy as np
    >>> r = np.linspace(0, 6e-3, 241)
    >>> wide, narrow = (np.exp(-((r / s) ** 2)) for s in (1.0e-3, 0.6e-3))
    >>> voltage, stress = (lift(r, f, 0.1e-3, 8e-3) for f in (wide, narrow))
    >>> a, g = normalise(divide(voltage, stress, weakest=1e-4 * stress.integral))
    >>> round(float(1e3 * memscal.fit_gaussian(g)), 3)  # sqrt((1 - 0.36) / 2) mm
    0.566
    """
    _require_one_grid(voltage, stress)
    regulariser = chosen_method(method, options)
    if isinstance(regulariser, Bayesian):
        raise InputError(
            "Method bayesian divides no fields.",
            why="It takes G from the points of a scan.",
            cure="Use it by memscal.calibrate(scan, method='bayesian').",
        )
    if not isinstance(weakest, tuple):
        relevant = stress.spectrum()[1] > weakest
        last = int(np.argmin(relevant)) if not relevant.all() else -1
        weakest = (weakest, float(voltage.spectrum()[1][last]))
    for modulus in weakest:
        require_positive("weakest relevant component", modulus)
    problem = DivisionProblem(
        voltage.grid, voltage.values, stress.values, *weakest[::-1], transform=stress.transform
    )
    division = regulariser.divide(problem)
    return Quotient(voltage.grid, division.field, division.window)


def normalise(quotient: Field) -> tuple[float, Field]:
    r"""Split A G so that G integrates to one: :math:`A = \int A\,G\,dx\,dy` (the paper's Eq. 3).

    Parameters
    ----------
    quotient : Field
        A G, in V/Pa/m^2.

    Returns
    -------
    float, Field
        A, in V/Pa, and G, in 1/m^2.

    Raises
    ------
    FitError
        If A G does not add up to a positive number.

    Examples
    --------
    >>> import numpy as np
    >>> r = np.linspace(0, 6e-3, 241)
    >>> a, g = normalise(lift(r, np.exp(-((r / 1e-3) ** 2)), 0.1e-3, 8e-3))
    >>> round(a / (np.pi * 1e-6), 6), round(g.integral, 6)
    (1.0, 1.0)
    """
    a = quotient.integral
    if not a > 0:
        raise FitError(
            f"The quotient of the fields adds up to {a:.3g} V/Pa.",
            why="A conversion constant is positive.",
            cure="Look at the deconvolved field; choose another method or less regularisation.",
        )
    return a, Field(quotient.grid, quotient.values / a)


def reconvolve(a: float, g: Field, stress: Field) -> Field:
    r"""Predict the voltage field, :math:`U = A\,(G \otimes \sigma)` (the paper's Eq. 1).

    Parameters
    ----------
    a : float
        A, in V/Pa.
    g : Field
        G, in 1/m^2.
    stress : Field
        Base stress on the same grid, in Pa.

    Returns
    -------
    Field
        Voltage, in V.

    Raises
    ------
    InputError
        If the fields lie on different grids.

    Examples
    --------
    >>> import numpy as np
    >>> r = np.linspace(0, 6e-3, 241)
    >>> stress = lift(r, np.exp(-((r / 0.6e-3) ** 2)), 0.1e-3, 8e-3)
    >>> voltage = lift(r, np.exp(-((r / 1.0e-3) ** 2)), 0.1e-3, 8e-3)
    >>> a, g = normalise(divide(voltage, stress, weakest=1e-4 * stress.integral))
    >>> bool(np.allclose(reconvolve(a, g, stress).radial, voltage.radial, atol=1e-4))
    True
    """
    _require_one_grid(g, stress)
    return replace(stress, values=a * stress.grid.convolve(g.values, stress.values))


def _require_one_grid(first: Field, second: Field) -> None:
    if not all(map(np.array_equal, first.grid.axes, second.grid.axes)):
        raise InputError(
            f"The two fields, {first!r} and {second!r}, lie on different grids.",
            cure="Lift both with one spacing and one extent.",
        )
