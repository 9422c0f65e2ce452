"""Table of rods at finite strain (a stub, until the table is made)."""

from __future__ import annotations

import pickle
from dataclasses import dataclass

import numpy as np

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import InputError
from memscal.mechanics.contact import Contact
from memscal.mechanics.film_response import RingTraction
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod


@dataclass(frozen=True, eq=False)
class TabulatedField:
    """Base stress of a rod by its transforms (N) at wavenumbers."""

    k: FloatArray
    normal: FloatArray
    shear: FloatArray

    def base_spectrum(self, k: FloatArray) -> FloatArray:
        from scipy.interpolate import CubicSpline

        return np.where(
            np.abs(k) <= self.k[-1],
            CubicSpline(self.k, self.normal)(np.minimum(k, self.k[-1])),
            0.0,
        )

    def base_shear_spectrum(self, k: FloatArray) -> FloatArray:
        from scipy.interpolate import CubicSpline

        return np.where(
            np.abs(k) <= self.k[-1], CubicSpline(self.k, self.shear)(np.minimum(k, self.k[-1])), 0.0
        )

    def base_normal(self, r: FloatArray) -> FloatArray:
        nodes = Wavenumbers.covering(self.k[-1], max(float(np.max(r)), 1e-3))
        return nodes.synthesise(self.base_spectrum(nodes.k), r)

    def base_shear(self, r: FloatArray) -> FloatArray:
        nodes = Wavenumbers.covering(self.k[-1], max(float(np.max(r)), 1e-3))
        return nodes.synthesise(self.base_shear_spectrum(nodes.k), r, order=1)

    def depression(self, r: FloatArray) -> FloatArray:
        raise InputError("x")

    outward = depression


def tabulated_rod(film: ElasticFilm, rod: Rod, load: float, *, sticking: bool) -> Contact | None:
    with open(f"/tmp/stub_{'stick' if sticking else 'slide'}.pkl", "rb") as f:
        rows = pickle.load(f)
    p = load / (film.shear_modulus * film.thickness**2) * (2.2e6 / 3 * 4e-6)
    loads = np.array([row[0] for row in rows])
    if not p <= loads[-1]:
        return None
    from scipy.interpolate import PchipInterpolator as S

    depth = (
        float(S(np.append(0, loads), np.append(0, [row[1] for row in rows]))(p))
        * film.thickness
        / 2e-3
    )
    normal = S(loads, np.array([row[3] for row in rows]))(max(p, loads[0])) * load
    shear = S(loads, np.array([row[4] for row in rows]))(max(p, loads[0])) * load
    k = rows[0][2] * 2e-3 / film.thickness
    a = rod.radius
    return Contact(
        film=film,
        indenter=rod,
        load=load,
        depth=depth,
        contact_radius=a,
        stick_radius=a if sticking else 0.0,
        friction=np.inf if sticking else 0.0,
        loading="",
        backend="fem",
        convergence=2e-3,
        steps=1,
        discretisation="table",
        traction=RingTraction(np.array([0, a]), np.zeros(2), np.zeros(2)),
        inside=TabulatedField(k, normal, shear),
        elastic_energy=0.0,
        work=None,
        dissipated_energy=None,
        strain="finite",
    )
