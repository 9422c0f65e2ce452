r"""Rod scans by a forward calculation that shares nothing with the package, perturbed as real ones.

The film is solved for each wavenumber as a system of four ordinary differential equations in its
depth, for displacements and tractions :math:`y = (U, W, T, S)`, by the matrix exponential; it may
slide on its base.  The rod has the pressure of a flat punch on a half-space (Boussinesq): where its
radius is an eighth of the film's thickness the base stress is right to 3e-5.  The voltage is a
double Fourier sum over the plane, so that G and the line may be anything.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from scipy.signal import lfilter
from scipy.special import j1

from memscal import ElasticFilm, LoadCell, Rod, Scan
from memscal.model.arrays import FloatArray

A = 1e-7
"""Conversion constant of every scan, in V/Pa."""
SIGMA = 0.561e-3
HALF_RANGE = 8e-3
PERIOD = 64e-3
"""Length of the plane's Fourier sums, in m, and their largest wavenumber, in rad/m."""
LARGEST = 12.5e3
DEEP = 25.0
HALF_SPACE = 12.0
"""Wavenumbers times thickness from which on nothing reaches the base, or comes back from there."""
_DEPTHS = 401


@dataclass(frozen=True)
class Part:
    """A part of G of a weight: an elliptic Gaussian of widths along x and y, or a disc, in m."""

    weight: float = 1.0
    width: tuple[float, float] = (SIGMA, SIGMA)
    centre: tuple[float, float] = (0.0, 0.0)
    disc: float | None = None

    def transform(self, kx: FloatArray, ky: FloatArray) -> FloatArray:
        """Fourier transform, complex where the part lies beside the origin."""
        if self.disc is not None:
            ka = np.maximum(np.hypot(kx, ky) * self.disc, 1e-12)
            shape = 2 * j1(ka) / ka
        else:
            shape = np.exp(-((kx * self.width[0]) ** 2 + (ky * self.width[1]) ** 2) / 2)
        phase = np.exp(-1j * (kx * self.centre[0] + ky * self.centre[1]))
        return np.asarray(self.weight * shape * phase)


@dataclass(frozen=True)
class World:
    """What a scan was truly made with; what it states is that of the paper's film and rod."""

    load: float = 0.05  # N
    radius: float = 0.25e-3  # m
    thickness: float = 2e-3  # m
    poisson_ratio: float = 0.5
    base_slip: float = 0.0  # share of the difference to a base that slides freely
    parts: Sequence[Part] = field(default=(Part(),))
    line_offset: float = 0.0  # m
    stage_scale: float = 1.0  # true over stated positions
    load_scale: float = 1.0  # true over stated load
    parabola: float = 0.0  # edge to centre over the largest signal
    cosine: float = 0.0  # amplitude of one period over the scan, over the largest signal
    step: float = 0.0  # of the baseline at x = 3 mm, over the largest signal
    gain_curvature: float = 0.0  # b in U (1 - b U / largest U)
    shear_sensitivity: float = 0.0  # length in m, of the divergence of the base shear
    lag: float = 0.0  # m, along the scan

    def voltages(self, x: FloatArray, *, y=0.0, along="x") -> FloatArray:
        """Voltages (n,) without noise at stated positions along a line, in V."""
        k, modulus, places = plane()
        kx, ky = np.meshgrid(k, k, indexing="ij")
        normal, shear = self.base(modulus)
        stress = (normal - self.shear_sensitivity * modulus * shear)[places]
        g = sum(part.transform(kx, ky) for part in self.parts)
        spectrum = A * self.load * self.load_scale * stress * g / PERIOD**2
        if along == "y":
            spectrum = spectrum.T
        across = spectrum @ np.exp(1j * k * (self.line_offset + y))
        across = across / (1 + 1j * k * self.lag)
        true = self.stage_scale * x
        signal = (np.exp(1j * np.multiply.outer(true, k)) @ across).real
        top = np.abs(signal).max()
        signal = signal * (1 - self.gain_curvature * signal / top)
        edge = np.abs(x).max()
        baseline = self.parabola * (x / edge) ** 2 + self.cosine * np.cos(np.pi * x / edge)
        return signal + top * (baseline + self.step * (x > 3e-3))

    def base(self, k: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Transforms of normal stress and shear at the base per newton, at wavenumbers (n,)."""
        ka = np.maximum(k * self.radius, 1e-12)
        punch = np.sin(ka) / ka
        q = k * self.thickness
        inside = np.where(q < DEEP, punch, 0.0)
        parts = np.zeros((k.size, 2))
        for share, slides in ((1 - self.base_slip, False), (self.base_slip, True)):
            if share:
                parts += share * layer(self.poisson_ratio, slides=slides)(np.minimum(q, DEEP))
        return inside * parts[:, 0], inside * parts[:, 1]


@cache
def plane() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Wavenumbers of each axis, their distinct moduli, and which each of the plane has."""
    count = int(LARGEST * PERIOD / (2 * np.pi))
    k = 2 * np.pi / PERIOD * np.arange(-count, count + 1)
    lengths = np.round(np.hypot(*np.meshgrid(k, k)), 6)
    modulus, places = np.unique(lengths, return_inverse=True)
    return k, modulus, places.reshape(lengths.shape)


@lru_cache
def layer(nu: float, *, slides: bool) -> CubicSpline:
    """Normal stress and shear at the base of a film, per surface pressure, by k times thickness."""
    depths = np.linspace(0.0, DEEP, _DEPTHS)
    _, base = answers(nu, depths, slides=slides)
    return CubicSpline(depths, base[:, ::-1, 1])


def answers(nu: float, q: FloatArray, *, slides=False) -> tuple[FloatArray, FloatArray]:
    """Displacements (outward, down) and base stress (shear, normal), by surface shear and pressure.

    At wavenumbers times thickness q (n,), each (n, 2, 2), for a film of unit thickness and modulus.
    """
    surface = np.zeros((q.size, 2, 2))
    base = np.zeros_like(surface)
    # Where nothing comes back from the base the film is a half-space.
    half_space = np.array([[1 - nu, nu - 0.5], [nu - 0.5, 1 - nu]])
    # Lengths in thicknesses, stresses in shear moduli: y' = matrix y from base to surface.
    stiffness = nu / (1 - nu)
    free = [0, 3] if slides else [2, 3]
    for i, wavenumber in enumerate(q):
        # At rest a film that slides may be moved as a whole.
        x = max(float(wavenumber), 1e-4)
        surface[i] = half_space / x
        if x > DEEP:
            continue
        strain = np.array([stiffness * x, 0.0, 0.0, (1 - 2 * nu) / (2 * (1 - nu))])
        matrix = np.zeros((4, 4))
        matrix[0] = [0.0, -x, 1.0, 0.0]
        matrix[1] = strain
        matrix[2] = x * (np.array([2 * x, 0.0, 0.0, -1.0]) + 2 * strain)
        matrix[3] = [0.0, 0.0, x, 0.0]
        carried = expm(matrix)
        unknown = np.linalg.inv(carried[2:][:, free])
        if x < HALF_SPACE:
            surface[i] = carried[:2][:, free] @ unknown
        base[i] = unknown
        base[i, 0] *= not slides
    return surface, base


def line(half_range: float = HALF_RANGE, step=0.25e-3) -> FloatArray:
    """Positions of a line scan, in m."""
    return np.arange(-half_range, half_range + step / 2, step)


def scan(
    world: World,
    seed: int,
    *,
    noise=0.005,
    x: FloatArray | None = None,
    noise_stated=True,
    along="x",
    y=0.0,
) -> Scan:
    """Return a scan as a user would import it: of the paper's film and rod, which it states."""
    rng = np.random.default_rng(seed)
    x = line() if x is None else x
    u = world.voltages(x, along=along, y=y)
    amplitude = noise * np.abs(u).max()
    u = u + rng.normal(0.0, amplitude, u.shape)
    return Scan(
        x=x,
        u_zz=u,
        u_zz_errors=np.full(u.shape, amplitude) if noise_stated else None,
        direction=along,
        load=world.load,
        load_uncertainty=0.01 * world.load,
        indenter=Rod(radius=0.25e-3),
        film=FILM,
        load_cell=LoadCell(),
    )


def wide_scan(seed: int, *, width=1.3e-3, places=20, **made) -> Scan:
    """Return a scan of 20 mm over a film of 2.5 mm by a Gaussian sensor, its centre anywhere."""
    x = np.linspace(-9.5e-3, 9.5e-3, places)
    rng = np.random.default_rng(seed)
    world = World(thickness=2.5e-3, parts=(Part(width=(width, width)),))
    measured = scan(world, seed, x=x - rng.uniform(-0.5e-3, 0.5e-3), **made)
    return replace(measured, x=x, film=replace(FILM, thickness=2.5e-3))


def clipped(measured: Scan, count: int, *, seed=0, scatter=3e-5) -> Scan:
    """Return a scan whose highest readings agree to a share of the largest."""
    u = measured.u_zz
    falling = np.sort(u)[::-1]
    rng = np.random.default_rng(seed)
    ceiling = falling[count] + rng.uniform(0.1, 0.9) * (falling[count - 1] - falling[count])
    held = ceiling + rng.normal(0.0, scatter * falling[0] / 2, u.size)
    return replace(measured, u_zz=np.where(u > ceiling, held, u))


def marked(measured: Scan, count: int) -> Scan:
    """Return the same without these readings."""
    u = np.where(measured.u_zz >= np.sort(measured.u_zz)[-count], np.nan, measured.u_zz)
    return replace(measured, u_zz=u, at_ceiling=count)


Noise = Callable[[np.random.Generator, int], FloatArray]


def correlated(kept: float, size: float, white: float) -> Noise:
    """Return noise of this size that keeps a share from point to point, beside white noise."""

    def noise(rng, count):
        steps = np.sqrt(1 - kept**2) * rng.standard_normal(count)
        steps[0] = rng.standard_normal()
        walk = lfilter([1.0], [1.0, -kept], steps)
        return np.asarray(size * walk + white * rng.standard_normal(count))

    return noise


FILM = ElasticFilm(
    young_modulus=2.2e6,
    poisson_ratio=0.5,
    thickness=2e-3,
    law="linear",
    young_modulus_uncertainty=0.1e6,
    poisson_ratio_uncertainty=0.005,
    thickness_uncertainty=20e-6,
)

ROUND = World()


def elliptic(ratio: float) -> World:
    """Return the world with a sensor of an axis ratio, its long axis along x, of the same area."""
    root = ratio**0.5
    return replace(ROUND, parts=(Part(width=(SIGMA * root, SIGMA / root)),))


def lobe(distance: float, share=0.2) -> World:
    """Return the world with a share of the sensitivity beside the line."""
    return replace(ROUND, parts=(Part(1 - share), Part(share, centre=(0.0, distance))))


def tail(weight: float, width=3e-3) -> World:
    """Return the world with a share of the sensitivity in a wide tail."""
    return replace(ROUND, parts=(Part(1 - weight), Part(weight, width=(width, width))))
