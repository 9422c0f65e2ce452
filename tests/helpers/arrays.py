"""Arrays of sensors of which everything is known, and what an independent layer makes them read."""

from dataclasses import replace
from functools import cache

import numpy as np

from memscal.axisymmetry.hankel import Wavenumbers, hankel_transform
from memscal.axisymmetry.kernels import gaussian_transfer, gaussian_transfer_slope
from memscal.extensions.arrays.array_data import ALL, ArrayReadings, KernelModes
from memscal.extensions.arrays.sensor_array import SensorArray
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.model.checks import QualityCheck
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.instrument import LoadCell
from memscal.model.provenance import Process

FILM = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
ROD = Rod(radius=0.25e-3)
SIGMA = 561e-6
A = 40e-9  # V/Pa


def layout(rows: int, columns: int, pitch: float = 2e-3) -> np.ndarray:
    """Places of a grid about the origin, (rows columns, 2), in m."""
    y, x = np.mgrid[:rows, :columns]
    places = np.stack([x.ravel(), y.ravel()], axis=1).astype(float)
    return pitch * (places - places.mean(axis=0))


def near(places: np.ndarray) -> np.ndarray:
    """Which pairs are neighbours, (n, n)."""
    apart = np.hypot(*(places[:, None] - places).T)
    np.fill_diagonal(apart, np.inf)
    return apart < 1.3 * apart.min()


@cache
def _rod() -> Contact:
    return indent(FILM, ROD, load=1.0)


def rod_stress(k: np.ndarray) -> np.ndarray:
    """Transform of the base stress under the rod, over its load, at wavenumbers in rad/m."""
    r = np.linspace(0.0, 40e-3, 4001)
    return hankel_transform(r, _rod().base_stress(r), k)


def known_array(
    rows: int,
    columns: int,
    *,
    pitch: float = 2e-3,
    crosstalk: float = 0.01,
    noise: float = 0.01,
    sigma: float = SIGMA,
    uncertainty: float = 0.0,
) -> SensorArray:
    """An array of Gaussian G; noise in parts of the largest reading at 1 N, uncertainty of ln A."""
    places = layout(rows, columns, pitch)
    n = len(places)
    neighbours = near(places)
    k = Wavenumbers.covering(20 / FILM.thickness, 40e-3).k
    peak = A * 1.0 / FILM.thickness**2
    parameters = 3 * n + neighbours.sum()
    root = np.zeros((parameters, n))
    root[:n] = uncertainty * np.eye(n)
    none = np.zeros(0)
    nothing = np.zeros((n, 0))
    centres = places.copy()
    if rows == 1:
        centres[:, 1] = np.nan
    return SensorArray(
        sensors=tuple(f"T{i:02d}" for i in range(n)),
        used=np.ones(n, bool),
        conversion_constants=np.full(n, A),
        centres=centres,
        crosstalk=np.where(neighbours, crosstalk, np.eye(n)),
        estimated=neighbours,
        gaussian_sigmas=np.full(n, sigma),
        baselines=np.zeros(n),
        noise=(noise * peak) ** 2 * np.eye(n),
        k=k,
        kernels=gaussian_transfer(k, sigma)[None],
        modes=KernelModes(np.zeros((0, k.size)), np.zeros(0, np.intp)),
        reference=rod_stress(k),
        root=root,
        effects={},
        film=FILM,
        indenter=ROD,
        load=1.0,
        readings=ArrayReadings(none, none, none, nothing, nothing, nothing),
        process=Process.of_now(),
    )


def full_array(rows=2, columns=3, *, points=50, seed=0, **changes):
    """Return an array that states everything, with one dead sensor."""
    rng = np.random.default_rng(seed)
    array = known_array(rows, columns)
    n = rows * columns
    used = np.arange(n) != n - 1
    # One width of all, and one of the first sensor's own.
    slope = SIGMA * gaussian_transfer_slope(array.k, SIGMA)
    modes = KernelModes(np.stack([slope, slope / 2]), np.array([ALL, 0]))
    parameters = 3 * n + len(array.pairs) + 2
    place = rng.uniform(-5e-3, 5e-3, (2, points))
    u = rng.normal(scale=1e-3, size=(3, n, points))
    stated = {
        "used": used,
        "conversion_constants": np.where(used, array.conversion_constants, np.nan),
        "modes": modes,
        "root": 1e-3 * rng.normal(size=(parameters, 7)),
        "effects": {"load": np.full(parameters, -0.01), "thickness": rng.normal(size=parameters)},
        "readings": ArrayReadings(*place, np.ones(points), *u),
        "noise": 1e-12 * (np.eye(n) + 0.5),
        "baseline_uncertainties": np.full(n, 1e-5),
        "layout": layout(rows, columns) + 1e-5,
        "layout_uncertainty": 2e-5,
        "reading_high": np.full(n, 1.0),
        "checks": (QualityCheck("dead_taxels", 1.0, 0.0, False, "One is dead."),),
        "failing": {"dead_taxels": ("T05",)},
        "load_cell": LoadCell(name="cell", serial_number="7"),
        "start_time": "2026-01-02T03:04:05Z",
    }
    return replace(array, **(stated | changes))
