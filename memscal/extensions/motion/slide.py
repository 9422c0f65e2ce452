r"""Contact of an indenter that slides on a bonded film: the entry point, and its solution.

Under full sliding the shear is :math:`q = \mu p` along x everywhere, so that only the pressure is
unknown.  With the film's transfer functions W and X (:mod:`memscal.mechanics.film_response`) the
surface is depressed by

.. math::

    \hat w = \frac{1-\nu}{Gk} (W + i\mu\cos\varphi\,X)\,\hat p,

:math:`\varphi` being the angle between wave vector and x.  Where there is pressure the film lies on
the indenter; elsewhere it lies below.  Both hold at the centres of square cells, and the pressure
has no shorter waves than they resolve.  The influence of one cell is summed over a period of which
nothing is seen in the contact, for it falls off as :math:`e^{-0.74 r/h}` or faster, and is applied
by zero-padded FFT.

The coupling X, which makes the influence unsymmetric, is part of every step: in a set of cells in
contact pressure and depth are solved for by GMRES, and the set is corrected (cells in tension
leave, cells that would pass through the indenter enter) until it stays, after two to six steps.
An antisymmetric influence does no work: the problem is as definite as that without friction.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.fft import fftfreq, irfft2, next_fast_len, rfft2, rfftfreq
from scipy.sparse.linalg import LinearOperator, gmres

from memscal.errors import ConvergenceError, DomainError, InputError
from memscal.extensions.motion.sliding_contact import Region, SlidingContact
from memscal.mechanics.film_response import corrections, half_space_coupling
from memscal.mechanics.indent import indent
from memscal.model.arrays import ArrayPair, FloatArray, floats
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter, Rod
from memscal.parallel import single_threaded

#: Cells across the window, until the base stress changes by less than this share of its peak.
_CELLS = (32, 64, 128, 256, 512)
_CHANGE = 5e-4
_FEWEST = 8
_MOST_FRICTION = 5.0
#: A smaller contact, in thicknesses, is that of a half-space.
_LEAST_RADIUS = 0.05
#: The window is so much wider than the contact from which it starts, or that it cuts off.
_MARGIN = 1.1
#: Sets of cells in contact that are tried, tolerance in depths, and vectors that GMRES keeps.
_SETS = 60
_TOLERANCE = 1e-6
_KEPT = 60
#: Images of a cell are so much farther away than the window is wide, in thicknesses.
_BETWEEN_IMAGES = 10.0
#: In place of k = 0, where the compliance has a limit, in rad/h over 2 pi.
_SMALLEST = 1e-4


@single_threaded()
def slide(
    film: ElasticFilm,
    indenter: Indenter,
    *,
    load: float,
    friction: float,
    direction: float = 1.0,
    points: int | None = None,
) -> SlidingContact:
    r"""Slide a rigid indenter over a bonded film.

    The shear is :math:`q = \mu p` in the whole contact, along the way of the indenter.  Elasticity
    is linear, whatever the film's law.

    Parameters
    ----------
    film, indenter : ElasticFilm, Indenter
        The film, bonded to a rigid base, and a Sphere, Cone or Profile.
    load : float
        Normal load in N.
    friction : float
        Shear over pressure :math:`\mu`, from 0 to 5.
    direction : float
        +1 where the indenter moves to larger x on the film, -1 to smaller.
    points : int, optional
        Cells across the contact, in each direction.  By default 32, doubled until the base stress
        changes by less than 5e-4 of its largest, 512 at the most; ``convergence`` states by how
        much it did.

    Returns
    -------
    SlidingContact
        Pressure, depth, and the normal stress at the base.

    Raises
    ------
    InputError
        If an argument makes no sense, or the indenter is a rod.
    DomainError
        If the contact outgrows the indenter's known face or is far smaller than the film is thick,
        or the indenter would pass through the film.
    ConvergenceError
        If the contact does not settle.

    Examples
    --------
    >>> import memscal
    >>> film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> contact = memscal.slide(film, memscal.Sphere(radius=128.8e-3), load=1.37, friction=0.3)
    >>> print(f"{contact.tangential_load:.3f} N, largest {contact.max_base_stress / 1e3:.1f} kPa")
    0.411 N, largest 68.5 kPa
    """
    if isinstance(indenter, Rod):
        raise InputError(
            "A rod is given, but only indenters with a smooth face slide here.",
            why="At a rod's edge the pressure has no largest value, and where the film slides "
            "over the edge depends on how sharp that is.",
            cure="Give a Sphere, Cone or Profile.",
        )
    if not 0 <= friction <= _MOST_FRICTION or abs(direction) != 1:
        raise InputError(
            f"The friction is {friction:g}, and the direction {direction:g}.",
            cure=f"Give shear over pressure, from 0 to {_MOST_FRICTION:g}, and +1 or -1.",
        )
    if points is not None and (points < _FEWEST or points % 1):
        raise InputError(f"{points:g} points are asked for.", cure=f"Give {_FEWEST} or more.")
    radius = indent(film, indenter, load=load, strain="linear").contact_radius
    if radius < _LEAST_RADIUS * film.thickness:
        raise DomainError(
            f"The contact has a radius of {radius * 1e6:.3g} um on a film of "
            f"{film.thickness * 1e6:.4g} um, which is a half-space to it.",
            cure="Give more load, or a thinner film.",
        )
    solve = partial(solve_sliding, film, indenter, load, direction * friction)
    contact = solve(Region(-radius, radius, radius), (points or _CELLS[0]) // 2)
    for cells in [points] if points else _CELLS:
        finer = solve(contact.region, cells)
        change = abs(finer.base_stress(finer.x) - contact.base_stress(finer.x)).max()
        contact = replace(finer, convergence=change / finer.max_base_stress)
        if contact.convergence < _CHANGE:
            break
    if np.abs(contact.region).max() > indenter.extent:
        raise DomainError(
            f"Under {load:g} N the film reaches beyond the {indenter.shape}'s known face, of a "
            f"radius of {indenter.extent * 1e3:.4g} mm.",
            cure="Give the face farther out, or less load.",
        )
    return contact


def solve_sliding(
    film: ElasticFilm,
    indenter: Indenter,
    load: float,
    friction: float,
    start: Region,
    cells: int = _CELLS[0],
) -> SlidingContact:
    """Return the contact on so many cells across a window, without its convergence.

    ``friction`` is the shear along x over the pressure, of either sign; ``start`` the region of a
    contact like it: the window is wider by a tenth.
    """
    h = film.thickness
    low, high, half_width = start
    step = _MARGIN / cells * max(high - low, 2 * half_width)
    y = step * np.arange((1 - cells) / 2, cells / 2)
    x = y + (low + high) / 2
    # Beyond what is known of it the face is level: what gets there is refused.
    heights = indenter.height(np.minimum(np.hypot.outer(y, x), indenter.extent))
    influence = _influence(step / h, cells, film.poisson_ratio, friction)
    # Pressures times h/E, which is a length.
    total = load * h / (film.young_modulus * step**2)
    pressure, depth = _balanced(heights, influence, total)
    solved = SlidingContact(
        film=film,
        indenter=indenter,
        load=load,
        friction=friction,
        x=x,
        y=y,
        pressure=film.young_modulus / h * pressure,
        depth=depth,
    )
    if pressure[0].any() or pressure[:, [0, -1]].any():
        # The window cuts off a part of the contact.
        wider = Region(*np.multiply(_MARGIN, start))
        return solve_sliding(film, indenter, load, friction, wider, cells)
    return solved


def _balanced(heights: FloatArray, influence: FloatArray, total: float) -> tuple[FloatArray, float]:
    """Return pressures of a total on the cells of a window that an indenter touches, and depth."""
    cells = len(heights)
    padded = influence.shape
    waves = rfft2(influence)
    inside = heights < heights[0].min()  # a disc

    def pressed(unknown: FloatArray) -> ArrayPair:
        """Return pressures by depth and those inside, and how far they depress the film below."""
        pressure = np.zeros_like(heights)
        pressure[inside] = unknown[1:]
        depressed = irfft2(waves * rfft2(pressure, padded), padded)
        return pressure, depressed[:cells, :cells] - unknown[0]

    def balance(unknown: FloatArray) -> FloatArray:
        return np.append(unknown[1:].mean(), pressed(unknown)[1][inside])

    for _ in range(_SETS):
        sides = np.append(total / inside.sum(), -heights[inside])
        operator = LinearOperator((sides.size, sides.size), balance)
        unknown, _ = gmres(operator, sides, rtol=_TOLERANCE / 10, restart=_KEPT)
        pressure, depressed = pressed(unknown)
        passing = depressed + heights < -_TOLERANCE * unknown[0]
        lying = np.where(inside, pressure > 0, passing)
        if np.array_equal(lying, inside):
            return pressure, unknown[0]
        inside = lying
    raise ConvergenceError(
        "The sliding contact did not settle.",
        cure="Give more points, or less friction.",
    )


def _influence(step: float, cells: int, poisson_ratio: float, friction: float) -> FloatArray:
    """Depression by a pressure on the first cell and its shear, at lags up to ``cells``."""
    count = next_fast_len(2 * cells + int(_BETWEEN_IMAGES / step))
    along_x = rfftfreq(count, step)
    frequency = np.hypot.outer(fftfreq(count, step), along_x)
    frequency[0, 0] = _SMALLEST
    normal, coupling, _ = corrections(2 * np.pi * frequency, poisson_ratio)
    by_shear = friction * along_x / frequency * (half_space_coupling(poisson_ratio) + coupling)
    # (1 - nu)/G in units of 1/E.
    spectrum = (1 - poisson_ratio**2) / np.pi / frequency * (1 + normal + 1j * by_shear)
    lags = np.r_[0:cells, -cells:0]
    return floats(irfft2(spectrum, (count, count))[np.ix_(lags, lags)])
