r"""Contacts of a sphere that share nothing with the package: Galerkin in a cylinder.

Pressure and shear are linear between evenly spaced radii.  A cylinder with a smooth wall far away
has modes :math:`J_0(kr)` and :math:`J_1(kr)`, which the film answers one by one
(:func:`helpers.outside.answers`); gaps and slips are tested by the same linear functions.  Load
rises in steps, each with its conditions of Signorini and Amontons.  Lengths are in thicknesses,
stresses in shear moduli, displacements in h^2/R, so that one path serves every film and sphere.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from helpers.outside import FILM, World, answers
from scipy.interpolate import RectBivariateSpline
from scipy.special import j0, j1, jn_zeros

from memscal import LoadCell, Scan, Sphere
from memscal.model.arrays import FloatArray

WALL = 12.0
MODES = 1200
STEP = 0.02
REACH = 2.8
"""Radius of the cylinder, number of modes, spacing and end of the radii that may touch."""
SMALLEST_LOAD = 2.0
LARGEST_LOAD = 100.0
STEPS = 240
#: Wavenumbers at which the base stress is tabulated, and the smaller of two Poisson's ratios.
Q = np.linspace(0.0, 20.0, 401)
COMPRESSIBLE = 0.48

SPHERE = Sphere(radius=128.8e-3, radius_uncertainty=0.5e-3)
LOADS = (0.34, 0.69, 1.37, 2.75)
NOISE = 0.005
POSITION = 10e-6
SCATTER = 0.02
LOAD = 0.01
"""Noise over the largest signal, errors of each position (m), each load and all loads."""
#: Loads through which the voltage is a parabola.
AROUND = (0.95, 1.0, 1.05)


@cache
def hats() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Radii (n,), points (m,) and weights (n, m) of integrals over the linear functions."""
    radii = np.arange(0.0, REACH + STEP / 2, STEP)
    places, shares = np.polynomial.legendre.leggauss(10)
    points = (radii[:-1, None] + STEP * (1 + places) / 2).ravel()
    values = np.maximum(1 - np.abs(radii[:, None] - points) / STEP, 0.0)
    return radii, points, values * points * np.tile(shares, radii.size - 1) * STEP / 2


def transforms(q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Transforms of order zero and one of the linear functions, (n, wavenumbers)."""
    _, points, weights = hats()
    phase = np.multiply.outer(points, q)
    return weights @ j0(phase), weights @ j1(phase)


def compliances(nu: float) -> FloatArray:
    """Tested displacements (outward, down) by tractions (shear, pressure), (2, 2, n, n)."""
    q = np.append(0.0, jn_zeros(1, MODES)) / WALL
    norm = WALL**2 / 2 * j0(q * WALL) ** 2
    surface, _ = answers(nu, q)
    orders = transforms(q)[::-1]
    return np.array(
        [[orders[i] * surface[:, i, j] / norm @ orders[j].T for j in range(2)] for i in range(2)]
    )


def pressed(friction: float, nu: float) -> tuple[FloatArray, FloatArray]:
    """Loads (s,) of a path and its tractions, (s, 2, n): outward shear and pressure."""
    radii, points, weights = hats()
    by = compliances(nu)
    n = radii.size
    area = weights.sum(axis=1)
    height = weights @ (points**2 / 2)
    touching = radii < 3 * STEP
    slides = np.zeros(n)  # the way of the shear that slides
    before = np.zeros(n)
    found = []
    loads = LARGEST_LOAD * np.linspace(0.0, 1.0, STEPS + 1)[1:] ** 2
    identity = np.eye(n)
    for load in loads:
        for _ in range(80):
            # Rows: tangential, normal, load; unknown: shear, pressure, depth.
            matrix = np.zeros((2 * n + 1, 2 * n + 1))
            right = np.zeros(2 * n + 1)
            sticks = touching & (slides == 0)
            sticks[0] = False
            matrix[:n, :n] = np.where(sticks[:, None], by[0, 0], identity)
            matrix[:n, n:-1] = np.where(
                sticks[:, None], by[0, 1], -np.diag(slides * friction * (radii > 0))
            )
            right[:n] = np.where(sticks, before, 0.0)
            matrix[n:-1, :n] = touching[:, None] * by[1, 0]
            matrix[n:-1, n:-1] = np.where(touching[:, None], by[1, 1], identity)
            matrix[n:-1, -1] = -1.0 * touching * area
            right[n:-1] = -1.0 * touching * height
            matrix[-1, n:-1] = 2 * np.pi * area
            right[-1] = load
            shear, pressure, depth = np.split(np.linalg.solve(matrix, right), [n, 2 * n])
            slip = (by[0, 0] @ shear + by[0, 1] @ pressure - before) / area
            gap = (by[1, 0] @ shear + by[1, 1] @ pressure + height) / area - depth
            touches = pressure - gap / STEP > 0
            wanted = shear - slip / STEP
            slid = np.where(np.abs(wanted) > friction * pressure, np.sign(wanted), 0.0)
            slid[~touches] = 0.0
            same = np.array_equal(touches, touching) and np.array_equal(slid[1:], slides[1:])
            touching = touches
            slides = slid
            if same:
                break
        else:
            raise RuntimeError(f"no contact at {load:g} with friction {friction:g}")
        before = by[0, 0] @ shear + by[0, 1] @ pressure
        found.append([shear, pressure])
    return loads, np.array(found)


@cache
def table(friction: float, nu: float) -> list[RectBivariateSpline]:
    """Base shear and normal stress per newton, along roots of scaled loads and Q."""
    loads, tractions = pressed(friction, nu)
    zero, one = transforms(Q)
    _, base = answers(nu, Q)
    by_order = np.stack([tractions[:, 0] @ one, tractions[:, 1] @ zero], axis=-1)
    stress = 2 * np.pi * np.einsum("qij,sqj->isq", base, by_order) / loads[:, None]
    kept = loads > SMALLEST_LOAD
    return [RectBivariateSpline(np.sqrt(loads[kept]), Q, each[kept]) for each in stress]


@dataclass(frozen=True)
class Pressed(World):
    """What contacts of a sphere were truly made with; ``radius`` is the sphere's."""

    radius: float = SPHERE.radius
    young_modulus: float = FILM.young_modulus
    friction: float = 0.0
    gain: float = 1.0

    def base(self, k: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Transforms of normal stress and shear at the base per newton, at wavenumbers (n,)."""
        modulus = self.young_modulus / (2 * (1 + self.poisson_ratio))
        scaled = self.load * self.load_scale * self.radius / (modulus * self.thickness**3)
        # Linear in Poisson's ratio between two of them.
        share = (0.5 - self.poisson_ratio) / (0.5 - COMPRESSIBLE)
        stresses = np.zeros((2, k.size))
        for nu, weight in ((0.5, 1 - share), (COMPRESSIBLE, share)):
            for stress, spline in zip(stresses, table(self.friction, nu), strict=True):
                stress += weight * spline(scaled**0.5, k * self.thickness)[0]
        return stresses[1], stresses[0]


def contacts(world: Pressed, seed: int, lubrication: str) -> Scan:
    """Return a scan of the paper's loads, as a user would import it, of FILM and SPHERE."""
    rng = np.random.default_rng([seed, lubrication == "lubricated"])
    x = np.linspace(-8e-3, 8e-3, 33)
    shape = (len(LOADS), x.size)
    u = np.zeros(shape)
    for row, load in zip(u, LOADS, strict=True):
        moved = x + rng.normal(0.0, POSITION, x.size)
        around = [replace(world, load=share * load).voltages(moved) for share in AROUND]
        parabola = np.polyfit(AROUND, around, 2)
        share = 1 + rng.normal(0.0, SCATTER, x.size)
        row[:] = world.gain * ((parabola[0] * share + parabola[1]) * share + parabola[2])
    noise = NOISE * u.max()
    loads = np.repeat(np.array(LOADS)[:, None], x.size, axis=1)
    return Scan(
        x=x,
        u_zz=u + rng.normal(0.0, noise, shape),
        u_zz_errors=np.full(shape, noise),
        x_errors=np.full(x.size, POSITION),
        normal_load=loads,
        normal_load_errors=SCATTER * loads,
        load=LOADS[0],
        load_uncertainty=LOAD * LOADS[0],
        indenter=SPHERE,
        film=FILM,
        load_cell=LoadCell(),
        lubrication=lubrication,
    )
