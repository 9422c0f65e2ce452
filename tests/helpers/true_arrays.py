r"""What arrays of sensors read, by a forward calculation that shares nothing with the package.

The film is that of :mod:`helpers.outside`: four differential equations of its depth at each
wavenumber.  A contact with the load P and the shear Q makes at R from it, at an angle from Q,

.. math::

    \frac{1}{2\pi}\int \hat p\,\hat G\,[P\,T\,J_0(kR) + Q\cos\varphi\,S\,J_1(kR)]\,k\,dk

with the transform :math:`\hat p` of its traction, 1 at k = 0.  A rod has the pressure of a flat
punch on a half-space (right to 3e-5 at an eighth of the thickness), a sphere one that is found by
Galerkin's method; shear has the shape of the pressure.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from helpers.arrays import SIGMA, A, layout, near
from helpers.outside import DEEP, FILM, answers
from scipy.interpolate import CubicSpline
from scipy.special import gamma, j0, j1, jv

from memscal import Rod, Scan, Sphere
from memscal.model.arrays import FloatArray

ROD = Rod(radius=0.25e-3)
THICKNESS = FILM.thickness
POISSON = FILM.poisson_ratio
SHEAR_MODULUS = FILM.young_modulus / (2 * (1 + POISSON))
#: Distances at which a stress is tabulated, in m, and nodes of each integral over k.
TABLE = np.linspace(0.0, 80e-3, 801)
NODES = 800


def gaussian(k: FloatArray) -> FloatArray:
    """Transform of the paper's G."""
    return np.exp(-((k * SIGMA) ** 2) / 2)


def disc(k: FloatArray) -> FloatArray:
    """Transform of a disc of 1 mm, blurred by 0.2 mm."""
    return 2 * j1(k * 1e-3) / (k * 1e-3) * np.exp(-((k * 0.2e-3) ** 2) / 2)


def tails(k: FloatArray) -> FloatArray:
    """Transform of a G with a tenth of its sensitivity in tails."""
    return 0.9 * np.exp(-((k * 0.5e-3) ** 2) / 2) + 0.1 * np.exp(-((k * 1.2e-3) ** 2) / 2)


KERNELS = {"gaussian": gaussian, "disc": disc, "tails": tails}


@lru_cache
def layer(nu: float) -> CubicSpline:
    """Normal stress at the base by outward shear and by pressure, by k times thickness."""
    depths = np.linspace(0.0, DEEP, 401)
    _, base = answers(nu, depths)
    return CubicSpline(depths, base[:, 1])


@lru_cache
def wavenumbers(thickness: float) -> tuple[FloatArray, FloatArray]:
    """Gauss nodes in rad/m, and weights of integrals over k dk / 2 pi."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    k = DEEP / thickness * (nodes + 1) / 2
    return k, weights * DEEP / thickness / 2 * k / (2 * np.pi)


def cap(power: float, k: FloatArray) -> FloatArray:
    """Integral of (1 - r^2)^power J0(kr) r over the unit disc."""
    return 2**power * gamma(power + 1) * jv(power + 1, k) / k ** (power + 1)


@dataclass(frozen=True)
class Caps:
    """Contacts of spheres without friction: sums of (1 - r^2/a^2)^(n + 1/2)."""

    radii: FloatArray  # (a,): in thicknesses
    loads: FloatArray  # (a,): in G h^2
    shares: FloatArray  # (a, n): of the load

    @classmethod
    @lru_cache
    def of(cls, nu: float, sphere: float, count: int = 6) -> "Caps":
        """Press a sphere, of a radius in thicknesses, so that each test function sees its shape."""
        depths = np.linspace(0.0, DEEP, 401)
        surface, _ = answers(nu, depths)
        compliance = CubicSpline(depths, depths * surface[:, 1, 1])
        edges = np.linspace(0.0, 400.0, 401)
        nodes, weights = np.polynomial.legendre.leggauss(8)
        k = (edges[:-1, None] + (nodes + 1) / 2).ravel()
        dk = np.tile(weights / 2, edges.size - 1)
        # The first one tests alone: its pressure would be infinite at the edge.
        powers = np.arange(count + 1) - 0.5
        forms = np.stack([cap(power, k) for power in powers])
        volumes = 1 / (2 * powers + 2)
        angle, weight = np.polynomial.legendre.leggauss(40)
        angle = np.pi / 4 * (angle + 1)
        measure = np.pi / 4 * weight * np.sin(angle) * np.cos(angle) ** (2 * powers[:, None] + 1)
        radii = np.linspace(0.02, min(2.5, 0.7 * sphere), 60)
        found = []
        for a in radii:
            height = sphere - np.sqrt(sphere**2 - (a * np.sin(angle)) ** 2)
            flexible = a * compliance(np.minimum(k / a, DEEP)) * dk
            displaced = forms * flexible @ forms[1:].T
            system = np.column_stack([displaced, -volumes])
            found.append(np.linalg.solve(system, -measure @ height)[:-1])
        loads = np.array(found) * volumes[1:] * 2 * np.pi * radii[:, None] ** 2
        return cls(radii, loads.sum(axis=1), loads / loads.sum(axis=1)[:, None])

    def transform(self, load: float, k: FloatArray) -> FloatArray:
        """Transform of the pressure under a scaled load, at k in units of 1/h."""
        a = float(CubicSpline(self.loads, self.radii)(load))
        shares = CubicSpline(self.radii, self.shares)(a)
        powers = np.arange(shares.size) + 0.5
        return sum(
            share * (2 * power + 2) * cap(power, k * a)
            for share, power in zip(shares, powers, strict=True)
        )


@dataclass(frozen=True)
class TrueArray:
    """An array as it truly is, n sensors; and the film and the load that a scan was made with."""

    centres: FloatArray  # (n, 2), in m
    conversion_constants: FloatArray  # (n,), in V/Pa
    crosstalk: FloatArray  # (n, n), 1 on the diagonal
    kernel: Callable[[FloatArray], FloatArray] = gaussian
    wider: FloatArray | None = None  # (n,): widths of each G over those of the kernel
    thickness: float = THICKNESS
    poisson_ratio: float = POISSON
    load: float = 1.0  # N: of the scan

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names, T00 and so on."""
        return tuple(f"T{i:02d}" for i in range(len(self.centres)))

    def readings(
        self,
        places: FloatArray,
        forces: FloatArray | float,
        *,
        shears: FloatArray | float = 0.0,
        indenter: Rod | Sphere | None = ROD,
    ) -> FloatArray:
        """Readings (t, n) in V of contacts at (t, 2) in m, of forces (t,) and shears (t, 2) in N.

        Without noise and baselines; a point where there is no indenter.
        """
        forces = np.broadcast_to(forces, len(places))
        away = self.centres - places[:, None]
        distance = np.hypot(*np.moveaxis(away, -1, 0))
        shears = np.broadcast_to(shears, (len(places), 2))
        pushed = np.sum(shears[:, None] * away, axis=-1) / np.maximum(distance, 1e-12)
        widths = np.ones(len(self.centres)) if self.wider is None else self.wider
        seen = np.zeros_like(distance)
        for width in np.unique(widths):
            some = widths == width
            by_shear, by_load = self.stress(indenter, forces, distance[:, some], width)
            seen[:, some] = forces[:, None] * by_load + pushed[:, some] * by_shear
        return (seen * self.conversion_constants) @ self.crosstalk.T

    def stress(
        self, indenter: Rod | Sphere | None, forces: FloatArray, distance: FloatArray, width: float
    ) -> FloatArray:
        """Stress per newton by shear and by load, (2, t, n), that sensors of a width see."""
        k, weights = wavenumbers(self.thickness)
        film = layer(self.poisson_ratio)(k * self.thickness) * [-1.0, 1.0]
        film *= (weights * self.kernel(k * width))[:, None]

        def at(r, force):
            waves = np.multiply.outer(r, k)
            spectrum = film * self.pressure(indenter, force)[:, None]
            return np.stack([j1(waves) @ spectrum[:, 0], j0(waves) @ spectrum[:, 1]])

        if isinstance(indenter, Sphere):
            rows = zip(distance, forces, strict=True)
            return np.stack([at(r, force) for r, force in rows], axis=1)
        return CubicSpline(TABLE, at(TABLE, 1.0), axis=1)(distance)

    def pressure(self, indenter: Rod | Sphere | None, force: float) -> FloatArray:
        """Transform of the pressure under a force, 1 at k = 0."""
        k, _ = wavenumbers(self.thickness)
        if indenter is None:
            return np.ones_like(k)
        if isinstance(indenter, Rod):
            return np.sin(k * indenter.radius) / (k * indenter.radius)
        caps = Caps.of(self.poisson_ratio, indenter.radius / self.thickness)
        return caps.transform(force / (SHEAR_MODULUS * self.thickness**2), k * self.thickness)


def true_array(
    rows: int = 1,
    columns: int = 10,
    *,
    pitch: float = 2e-3,
    crosstalk: float = 0.01,
    kernel: str = "gaussian",
    own: float = 0.0,
    gains: float = 0.05,
    misplaced: float = 20e-6,
    inputs: float = 0.01,
    seed: int = 0,
) -> TrueArray:
    """Draw an array: relative scatter of A, of the widths and of film and load; places in m."""
    rng = np.random.default_rng([39, seed])
    places = layout(rows, columns, pitch)
    n = len(places)
    centres = places + misplaced * rng.normal(size=(n, 2))
    if rows == 1:
        centres[:, 1] = 0.0
    return TrueArray(
        centres=centres,
        conversion_constants=A * (1 + gains * rng.normal(size=n)),
        crosstalk=np.eye(n) + crosstalk * near(places),
        kernel=KERNELS[kernel],
        wider=1 + own * rng.normal(size=n) if own else None,
        thickness=THICKNESS * (1 + inputs * rng.normal()),
        load=1 + inputs * rng.normal(),
    )


@dataclass(frozen=True, eq=False)
class Errors:
    """What keeps the scan of an array from being ideal; shares of the largest reading."""

    noise: float = 0.005
    common: float = 0.5  # share of the noise's variance that all sensors have in common
    baseline: float = 0.02
    drift: float = 0.01
    place: float = 0.0  # m: of each press, stated
    load: float = 0.0  # relative, of each press, stated
    dead: tuple[int, ...] = ()
    ceiling: dict[int, float] = field(default_factory=dict)  # by sensor, of its largest reading
    missing: float = 0.0  # share of the readings


def simulated_scan(
    rows: int = 1,
    columns: int = 10,
    *,
    step: float | None = None,
    beyond: float = 3.0,
    repeats: int = 1,
    raster: bool | None = None,
    errors: Errors = Errors(),
    stated: float = 0.01,
    seed: int = 0,
    **drawn,
) -> tuple[Scan, TrueArray]:
    """Return a scan of an array, and the truth: a line over a row, else a raster.

    It ends ``beyond`` thicknesses from the last sensors; steps of 0.25 mm, of a raster 0.5 mm.
    Thickness and load are drawn with the relative uncertainty that is stated; ``drawn`` is what
    :func:`true_array` takes.
    """
    true = true_array(rows, columns, inputs=stated, seed=seed, **drawn)
    raster = rows > 1 if raster is None else raster
    step = step or (0.5e-3 if raster else 0.25e-3)
    places = layout(rows, columns, drawn.get("pitch", 2e-3))
    ends = np.abs(places).max(axis=0) + beyond * THICKNESS
    counts = np.rint(ends / step).astype(int)
    x, y = (step * np.arange(-count, count + 1) for count in counts)
    if not raster:
        y = np.zeros(repeats)
    across, along = np.meshgrid(y, x, indexing="ij")
    at = np.stack([along, across], axis=-1)
    rng = np.random.default_rng([40, seed])
    u = disturbed(true, at.reshape(-1, 2), errors, rng).T.reshape(-1, *along.shape)
    if not raster and repeats == 1:
        u = u[:, 0]
    shape = u.shape[1:]
    top = np.nanmax(u)
    return Scan(
        sensors=true.sensors,
        layout=places,
        layout_uncertainty=drawn.get("misplaced", 20e-6),
        x=x,
        y=y if raster else None,
        u_zz=u,
        u_zz_errors=np.full(u.shape, errors.noise * top) if errors.noise else None,
        x_errors=np.full(x.size, errors.place) if errors.place else None,
        normal_load=np.ones(shape) if errors.load else None,
        normal_load_errors=np.full(shape, errors.load) if errors.load else None,
        load=1.0,
        load_uncertainty=stated or None,
        indenter=ROD,
        rod_friction=0.0,
        film=replace(FILM, thickness_uncertainty=stated * THICKNESS),
    ), true


def disturbed(true: TrueArray, places: FloatArray, errors: Errors, rng) -> FloatArray:
    """Readings (t, n) of presses at (t, 2), with all that went wrong."""
    count = len(places)
    n = len(true.centres)
    pressed = places + errors.place * rng.normal(size=count)[:, None] * [1.0, 0.0]
    u = true.readings(pressed, true.load * (1 + errors.load * rng.normal(size=count)))
    u[:, list(errors.dead)] = 0.0
    top = u.max()
    time = np.linspace(-0.5, 0.5, count)[:, None]
    u += top * (errors.baseline * rng.normal(size=n) + errors.drift * time * rng.normal(size=n))
    u += top * noise(rng, (count, n), errors)
    for sensor, share in errors.ceiling.items():
        u[:, sensor] = np.minimum(u[:, sensor], share * u[:, sensor].max())
    u[rng.random(u.shape) < errors.missing] = np.nan
    return u


def noise(rng, shape: tuple[int, int], errors: Errors) -> FloatArray:
    """Noise of each frame and sensor, some of it common to all sensors."""
    alone = np.sqrt(1 - errors.common) * rng.normal(size=shape)
    return errors.noise * (alone + np.sqrt(errors.common) * rng.normal(size=(shape[0], 1)))


def simulated_frames(
    true: TrueArray, count: int, *, seed: int = 0, most_shear: float = 0.0, **other
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return frames (t, n) with noise, their places (t, 2) and forces (t,), all drawn.

    Contacts of 0.5 to 2 N within the array, with shears up to ``most_shear`` of the force;
    ``other``: the indenter, or fields of :class:`Errors`.
    """
    indenter = other.pop("indenter", ROD)
    errors = Errors(**other)
    rng = np.random.default_rng([41, seed])
    inside = np.abs(true.centres).max(axis=0)
    places = rng.uniform(-1, 1, (count, 2)) * inside
    forces = np.exp(rng.uniform(np.log(0.5), np.log(2.0), count))
    turned = rng.uniform(0, 2 * np.pi, count)
    size = most_shear * forces * np.sqrt(rng.uniform(size=count))
    shears = size[:, None] * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    u = true.readings(places, forces, shears=shears, indenter=indenter)
    top = true.readings(true.centres, 1.0).max()
    return u + top * noise(rng, u.shape, errors), places, forces
