"""Table of neo-Hookean rods: base stress and depth against load, made by docs/rod_table.py.

Columns of growing depth stand at values of Poisson's ratio and of the rod's radius over the film's
thickness h; each holds the stiffness, the load over G h d with the depth d, and the transforms of
the base's normal stress and shear over the load.  A rod between the columns is found by polynomials
through the four nearest in the logarithms of stiffness and radius, one between depths by cubic
splines over the cube root of the depth: the contact grows around a rounded edge as its square.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from memscal.axisymmetry.hankel import Wavenumbers, up_to
from memscal.errors import InputError
from memscal.mechanics.contact import Contact
from memscal.model.arrays import Arrays, FloatArray, array_record
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod

FILE = Path(__file__).with_name("rods.npz")
#: Columns that a polynomial goes through; relative error of the base stress and of the depth.
_STENCIL = 4
_ACCURACY = 2e-3
#: Shares of the depth at which the load is integrated to the work.
_STEPS = np.linspace(0.0, 1.0, 65)


@array_record
class TabulatedField:
    """Base stress of a rod by its transforms (N) at wavenumbers (rad/m), and nothing else."""

    k: FloatArray
    transforms: FloatArray  # (2, k): of the normal stress, and of order one of the shear
    radius: float

    def spectrum(self, k: FloatArray, order: int) -> FloatArray:
        """Return the transform of normal stress or traction at ``k`` (rad/m), in N."""
        from scipy.interpolate import CubicSpline

        # Even in k, or odd.
        ends: Any = ((2, 0.0) if order else (1, 0.0), "not-a-knot")
        return up_to(self.k[-1], CubicSpline(self.k, self.transforms[order], bc_type=ends), k)

    def base(self, r: FloatArray, order: int) -> FloatArray:
        """Return normal stress or outward traction at the base in Pa."""
        nodes = Wavenumbers.covering(self.k[-1], np.max(r, initial=self.radius))
        return nodes.synthesise(self.spectrum(nodes.k, order), r, order=order)

    def _absent(self, *_: Any, **__: Any) -> NoReturn:
        raise InputError(
            "The table of rods holds the stress at the base alone.",
            cure="Press the rod by memscal.indent, which solves the whole film.",
        )

    surface = pressure = shear = pressure_transform = shear_transform = _absent
    half_space_integrals = _absent


def tabulated_rod(film: ElasticFilm, rod: Rod, load: float, *, sticking: bool) -> Contact | None:
    """Return a rod on a neo-Hookean film under a load (N); ``None`` outside the table."""
    from scipy.optimize import brentq

    column = _column(film.poisson_ratio, rod.radius / film.thickness, sticking=sticking)
    if not column or load > largest_tabulated_load(film, rod, sticking=sticking):
        return None
    rows, deepest = column
    scale = film.shear_modulus * film.thickness**2
    depth = brentq(lambda d: _load(rows, d) - load / scale, 0.0, deepest, xtol=1e-12)
    transforms = rows(np.cbrt(depth))[1:].reshape(2, -1) * load
    inside = TabulatedField(base_wavenumbers(film), transforms, rod.radius)
    loads = _load(rows, _STEPS * depth) * scale
    work = float(np.trapezoid(loads, _STEPS * depth * film.thickness))
    return Contact(
        film=film,
        indenter=rod,
        load=load,
        depth=depth * film.thickness,
        contact_radius=rod.radius,
        stick_radius=rod.radius if sticking else 0.0,
        friction=math.inf if sticking else 0.0,
        loading="",
        backend="fem",
        convergence=_ACCURACY,
        steps=1,
        discretisation="interpolation in the table of rods",
        traction=inside,
        inside=inside,
        elastic_energy=work,
        work=work,
        dissipated_energy=0.0,
        strain="finite",
    )


def base_wavenumbers(film: ElasticFilm) -> FloatArray:
    """Return the wavenumbers (rad/m) of a rod's base stress in the table."""
    return _table()["kh"] / film.thickness


def largest_tabulated_load(film: ElasticFilm, rod: Rod, *, sticking: bool) -> float:
    """Return the load (N) at which the table ends for a rod; 0 outside the table."""
    column = _column(film.poisson_ratio, rod.radius / film.thickness, sticking=sticking)
    scale = film.shear_modulus * film.thickness**2
    return float(_load(*column)) * scale if column else 0.0


_Rows = Callable[[Any], Any]
"""Of the cube root of the depth: log of load over depth, spectra of stress and shear over load."""


def _load(rows: _Rows, depth: Any) -> Any:
    """Return loads in units of G h^2 at depths over the thickness."""
    return np.exp(rows(np.cbrt(depth))[..., 0]) * depth


@lru_cache(maxsize=1)
def _table() -> Arrays:
    with np.load(FILE) as file:
        table = {name: file[name].astype(np.float64) for name in file.files}
    table["table"][..., 0] = np.log(table["table"][..., 0])
    return table


@lru_cache(maxsize=256)
def _column(poisson: float, radius: float, *, sticking: bool) -> tuple[_Rows, float] | None:
    """Interpolate between the columns: a rod and its deepest depth; ``None`` outside the table."""
    from scipy.interpolate import CubicSpline

    table = _table()
    ratios = table["poisson_ratio"]
    radii = table["radius"]
    depths = table["depth"]
    if not (ratios[0] <= poisson <= ratios[-1] and radii[0] <= radius <= radii[-1]):
        return None
    columns = table["table"][0 if sticking else 1]
    # How many depths each column has; the rod's ends where the first of its neighbours does.
    reached = np.isfinite(columns[..., 0]).sum(axis=-1)
    # The interval of each axis that the rod lies in.
    i = np.searchsorted(ratios[1:-1], poisson, side="right")
    j = np.searchsorted(radii[1:-1], radius, side="right")
    ends = reached[i : i + 2, j : j + 2].min(axis=1)
    count = ends[_polynomial(tuple(ratios[i : i + 2]), poisson) != 0].min()
    if count < _STENCIL:
        return None
    rows = []
    for n in range(count):
        at_ratios = {}
        for m in range(ratios.size):
            nodes = _nearest(np.flatnonzero(reached[m] > n), j)
            if {j, j + 1} <= set(nodes):
                weights = _polynomial(tuple(np.log(radii[nodes])), np.log(radius))
                at_ratios[m] = weights @ columns[m, nodes, n]
        chosen = _nearest(at_ratios, i)
        weights = _polynomial(tuple(ratios[chosen]), poisson)
        rows.append(weights @ [at_ratios[m] for m in chosen])
    flat: Any = ((1, np.zeros(columns.shape[-1])), "not-a-knot")
    return CubicSpline(np.cbrt(depths[:count]), rows, bc_type=flat), float(depths[count - 1])


def _nearest(nodes: Any, place: Any) -> list[int]:
    """Return up to four of the nodes around the interval after a place."""
    order = sorted(nodes, key=lambda node: abs(node - place - 0.5))
    return sorted(order[:_STENCIL])


@lru_cache(maxsize=256)
def _polynomial(nodes: tuple[float, ...], x: float) -> FloatArray:
    """Weights of values at nodes in the polynomial through them, at ``x``."""
    weights = []
    for i, node in enumerate(nodes):
        others = np.delete(nodes, i)
        weights.append(np.prod((x - others) / (node - others)))
    return np.array(weights)
