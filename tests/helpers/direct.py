r"""Scans whose voltages share nothing with the analysis but the film: direct convolution.

The base stress, by a film of any law, is that of the finite elements.  Convolved with a radial
G it is at distance R

.. math::

    \int_0^\infty G(q)\,q \int_0^{2\pi} \sigma(\sqrt{R^2 + q^2 - 2Rq\cos\theta})\,d\theta\,dq :

the inner integral is the same for all G, the outer one has panels narrower than any blur.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from helpers.scans import CENTRE, CONVERSION, EXACT_FILM, EXACT_ROD, SENSOR
from scipy.interpolate import make_interp_spline

import memscal
from memscal.model.arrays import FloatArray

HALF_RANGE = 8e-3
PANEL = 0.05e-3
NODES = 8
OUTERMOST = 10e-3
"""Panels of the radius of G and where it ends, in m; Gauss nodes of each."""
ANGLES = 96
LOADS = (0.1, 0.3, 1.0)
RATIO = 0.5
"""Loads at which base stresses are solved, in N; C2/C1 of Mooney-Rivlin films."""
TABLE = np.arange(0.0, 20e-3, 25e-6)


@dataclass(frozen=True)
class Tapered:
    """G that falls to zero at a radius (m): a cone, a paraboloid, as (1 - (r/a)^power)."""

    radius: float
    power: float

    def radial(self, r: FloatArray) -> FloatArray:
        """G at radii ``r`` (m), in 1/m^2."""
        height = (self.power + 2) / (self.power * np.pi * self.radius**2)
        return np.asarray(height * np.clip(1 - (r / self.radius) ** self.power, 0.0, None))


Kernel = memscal.RadialKernel | Tapered


@lru_cache
def quadrature() -> tuple[FloatArray, FloatArray]:
    """Radii (m), and weights (m^2) that integrate a radial function over the plane."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    starts = np.arange(0.0, OUTERMOST - PANEL / 2, PANEL)[:, None]
    radius = (starts + PANEL * (nodes + 1) / 2).ravel()
    return radius, 2 * np.pi * radius * np.tile(weights * PANEL / 2, starts.size)


@lru_cache
def base_stresses(radius: float, law: str) -> dict[float, FloatArray]:
    """Base stress (Pa) along TABLE at each of LOADS, on a film whose mesh is of its own radius."""
    other = {"mooney_rivlin_ratio": RATIO} if law == "mooney-rivlin" else {}
    rod = memscal.Rod(radius=radius)
    film = replace(EXACT_FILM, law=law, **other)
    if law == "linear":
        stress = memscal.indent(film, rod, load=1.0, backend="fem").base_stress(TABLE)
        return {load: load * stress for load in LOADS}
    contacts = memscal.indent(film, rod, load=LOADS, friction=np.inf, film_radius=21e-3)
    return {load: c.base_stress(TABLE) for load, c in zip(LOADS, contacts, strict=True)}


def spline_across(radius: float, law: str, load: float) -> Callable[[FloatArray], FloatArray]:
    """Base stress (Pa) by the distance from the axis (m), smooth on it."""
    stress = base_stresses(radius, law)[load]
    even = np.append(-TABLE[:0:-1], TABLE), np.append(stress[:0:-1], stress)
    return make_interp_spline(*even, k=5)


@lru_cache
def mean_stress(points: int, centre: float, load: float, radius: float, law: str) -> FloatArray:
    """Base stress, averaged over circles about each position of the scan, in Pa."""
    at = spline_across(radius, law, load)
    q = quadrature()[0][:, None]
    cosine = np.cos((np.arange(ANGLES) + 0.5) * np.pi / ANGLES)
    distances = np.abs(np.linspace(-HALF_RANGE, HALF_RANGE, points) - centre)
    rows = [at(np.sqrt(R**2 + q**2 - 2 * R * q * cosine)).mean(axis=1) for R in distances]
    return np.array(rows)


@lru_cache
def voltages(kernel: Kernel, points: int, centre: float, *pressed) -> FloatArray:
    """Voltages without noise, baseline and drift, in V; load, rod and law as of mean_stress."""
    q, weights = quadrature()
    share = weights * kernel.radial(q)
    # The quadrature resolves G: nothing of it is lost.
    assert abs(share.sum() - 1) < 1e-9
    return np.asarray(CONVERSION * (mean_stress(points, centre, *pressed) @ share))


def direct_scan(
    kernel: Kernel,
    *,
    noise: float,
    seed=0,
    points=65,
    repeats=1,
    centre: float = CENTRE,
    baseline=0.01,
    drift=0.005,
    state_noise=True,
    load=1.0,
    radius: float = EXACT_ROD.radius,
    law="linear",
) -> memscal.Scan:
    """Scan as ``memscal.simulate`` does, with the same noise for a seed, by direct convolution.

    ``noise``, ``baseline`` and ``drift`` are shares of the largest signal.
    """
    x = np.linspace(-HALF_RANGE, HALF_RANGE, points)
    signal = voltages(kernel, points, centre, load, radius, law)
    top = float(signal.max())
    clean = signal + top * (baseline + 0.5 * drift * x / HALF_RANGE)
    shape = (repeats, points) if repeats > 1 else (points,)
    u = clean + np.random.default_rng(seed).normal(0.0, noise * top, (repeats, points))
    shares = {"noise": noise, "baseline": baseline, "drift": drift}
    return memscal.Scan(
        x=x,
        u_zz=u.reshape(shape),
        u_zz_errors=np.full(shape, noise * top) if state_noise and noise > 0 else None,
        load=load,
        indenter=replace(EXACT_ROD, radius=radius),
        film=EXACT_FILM,
        sensor=SENSOR,
        synthetic={"centre": centre, "conversion_constant": CONVERSION, "seed": float(seed)}
        | {name: share * top for name, share in shares.items()},
    )
