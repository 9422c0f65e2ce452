r"""Sliding contacts of a sphere that share nothing with the package: collocation on a square grid.

Pressure :math:`p` and shear :math:`\mu p` along x act on a film that is solved wavenumber by
wavenumber (:func:`helpers.outside.answers`); where they act is found by solving for all cells at
once.  Lengths are in thicknesses, stresses in shear moduli times h/R, as every film has them.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from helpers.outside import DEEP, SIGMA, A, answers
from scipy.interpolate import CubicSpline

from memscal import ElasticFilm, Scan, Sphere

STEP = 0.06
CELLS = 400
REACH = 1.3
"""Spacing of the grid, its cells along each axis, and what may touch over Hertz's radius."""
#: Wavenumbers of the base stress, of a period of 32 thicknesses.
PERIOD = 32.0
Q = 2 * np.pi / PERIOD * np.arange(-80, 81)
#: Loads between which contacts are interpolated, over the nominal one.
AROUND = np.array([0.8, 1.0, 1.2])

NOISE = 0.005 / 5**0.5
"""Noise over the largest signal: of means of five readings of 0.5 %."""

SPHERE = Sphere(radius=128.8e-3)
FILM = ElasticFilm(
    young_modulus=2.2e6,
    poisson_ratio=0.5,
    thickness=2e-3,
    law="linear",
    young_modulus_uncertainty=0.1e6,
    thickness_uncertainty=20e-6,
)


@cache
def film():
    """Depression times q, and normal base stress, by (shear, pressure), along q."""
    q = np.linspace(0.0, DEEP, 801)
    surface, base = answers(FILM.poisson_ratio, q)
    return CubicSpline(q, surface[:, 1] * q[:, None]), CubicSpline(q, base[:, 1])


def by_pressure(which, friction, qx, qy):
    """Depression (0) or base stress (1) per pressure with its shear, complex."""
    q = np.hypot(qx, qy)
    shear, pressure = np.moveaxis(film()[which](np.minimum(q, DEEP)), -1, 0)
    found = pressure + 1j * friction * shear * qx / np.maximum(q, 1e-9)
    if which:
        return np.where(q < DEEP, found, 0.0)
    return found / np.maximum(q, 1e-4)


@cache
def contact(load, friction):
    """Places (n,) and forces (n,) of the cells that touch under a load."""
    q = 2 * np.pi * np.fft.fftfreq(CELLS, STEP)
    influence = np.fft.ifft2(by_pressure(0, friction, q[:, None], q)).real
    edge = REACH * (load * 3 / 8) ** (1 / 3)
    axis = np.arange(-int(edge / STEP), int(edge / STEP) + 1)
    i, j = (index.ravel() for index in np.meshgrid(axis, axis[axis >= 0], indexing="ij"))
    apart = i[:, None] - i
    by = influence[apart, j[:, None] - j]
    by = by + np.where(j > 0, influence[apart, j[:, None] + j], 0.0)
    area = STEP**2 * np.where(j > 0, 2.0, 1.0)
    height = STEP**2 * (i**2 + j**2) / 2
    touching = height < edge**2 / 4
    for _ in range(60):
        some = np.flatnonzero(touching)
        matrix = np.zeros((some.size + 1, some.size + 1))
        matrix[:-1, :-1] = by[np.ix_(some, some)]
        matrix[:-1, -1] = -1.0
        matrix[-1, :-1] = area[some]
        *solved, depth = np.linalg.solve(matrix, np.append(-height[some], load))
        pressure = np.zeros(i.size)
        pressure[some] = solved
        touches = np.where(touching, pressure > 0, by @ pressure + height < depth)
        if np.array_equal(touches, touching):
            return i[some] * STEP, j[some] * STEP, (pressure * area)[some]
        touching = touches
    raise RuntimeError(f"no contact at {load:g} with friction {friction:g}")


@cache
def stresses(load, friction):
    """Transforms (loads, Q, Q) of the base stress over the load, complex."""
    found = []
    base = by_pressure(1, friction, Q[:, None], Q)
    for share in AROUND:
        x, y, force = contact(share * load, friction)
        # Both halves are alike.
        waves = (np.exp(-1j * np.outer(Q, x)) * force) @ np.cos(np.outer(y, Q))
        found.append(base * waves / (share * load))
    return np.array(found)


@dataclass(frozen=True)
class Slid:
    """How a sphere slid, and what is true of the film and the load that FILM states."""

    friction: float = 0.0
    load: float = 1.37
    load_scale: float = 1.0
    young_modulus: float = FILM.young_modulus
    thickness: float = FILM.thickness

    def scaled(self, load, young_modulus, thickness):
        """A load in units of the contact's."""
        shear_modulus = young_modulus / (2 * (1 + FILM.poisson_ratio))
        return load * SPHERE.radius / (shear_modulus * thickness**3)

    def voltages(self, x, direction=1):
        """Voltages (n,) of a Gaussian sensor by positions of the sphere from it, in V."""
        nominal = self.scaled(self.load, FILM.young_modulus, FILM.thickness)
        load = self.load * self.load_scale
        share = self.scaled(load, self.young_modulus, self.thickness) / nominal
        # A parabola through three loads.
        three = stresses(nominal, self.friction)
        weights = [np.prod((share - AROUND[o]) / (a - AROUND[o])) for a, o in _OTHERS]
        k = Q / self.thickness
        kernel = np.exp(-((np.hypot.outer(k, k) * SIGMA) ** 2) / 2)
        across = (np.tensordot(weights, three, 1) * kernel).sum(axis=1)
        waves = np.exp(-1j * direction * np.outer(x, k)) @ across
        return A * load * waves.real / (PERIOD * self.thickness) ** 2


_OTHERS = [(a, np.arange(AROUND.size) != i) for i, a in enumerate(AROUND)]


def sliding_scan(
    slid,
    seed,
    directions=(1,),
    *,
    backlash=0.0,
    share=NOISE,
    **stated,
):
    """Return a scan of passes in directions whose positions differ by a backlash, in m."""
    rng = np.random.default_rng(seed)
    x = np.linspace(-10e-3, 10e-3, 201)
    centre = 0.14e-3 + backlash / 2 * np.array(directions)
    u = np.array([slid.voltages(x - c, d) for c, d in zip(centre, directions, strict=True)])
    size = share * u.max()
    u = u + rng.normal(0.0, size, u.shape)
    return Scan(
        x=x,
        u_zz=u,
        u_zz_errors=np.full(u.shape, size),
        sliding_direction=np.array(directions),
        motion="sliding",
        load=slid.load,
        load_uncertainty=0.01 * slid.load,
        indenter=SPHERE,
        film=FILM,
        **stated,
    )
