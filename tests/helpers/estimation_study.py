"""The study of the estimator of G and A: its cases, the loop over seeds, and what must hold.

Limits are on what the truth says: error of G and of A, and how often the stated bands hold it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from zlib import crc32

import numpy as np
from helpers.bounds import FULL, cramer_rao, root_mean_square_limit
from helpers.scans import CONVERSION, plane_error, simulated
from scipy.optimize import brentq
from scipy.stats import binom, t

import memscal
from memscal import RadialKernel, Scan
from memscal.model.arrays import FloatArray

METHOD = "evidence"
FULL_SEEDS, FEW_SEEDS = 200, 12
SEEDS = FULL_SEEDS if FULL else FEW_SEEDS
R = np.linspace(0.0, 3e-3, 121)

K95 = 1.96
LEAST_COVERAGE, MEAN_COVERAGE = 0.88, (0.93, 0.98)
EFFICIENCY = 1.15
"""Largest RMS error of A over its Cramer-Rao bound, where G is Gaussian."""
BANDS = ("G", "A", "σ", "FWHM")


def chance(seeds: int) -> float:
    """Probability to leave to the choice of seeds: that a limit that holds is found exceeded.

    Few seeds are given more room: now and then noise is taken for a departure, and errors with
    such tails are normal only in their sum.
    """
    return 0.01 if seeds >= FULL_SEEDS else 1e-4


@dataclass(frozen=True)
class Case:
    """A kernel, and what its scans are taken with.

    ``noise`` as a share of the largest signal; ``step`` in m; ``off``: whether centre (0.14 mm),
    baseline (1 %) and drift (0.5 %) are off.
    """

    label: str
    kernel: RadialKernel
    noise: float
    step: float
    repeats: int
    off: bool

    @property
    def name(self) -> str:
        scan = f"{self.noise * 100:g} %, {self.step * 1e3:g} mm x {self.repeats}"
        return f"{self.label}, {scan}{', off' if self.off else ''}"

    @property
    def sigma(self) -> float | None:
        """Width of a single Gaussian, in m."""
        if isinstance(self.kernel, memscal.GaussianMixture) and len(self.kernel.sigmas) == 1:
            return self.kernel.sigmas[0]
        return None

    @property
    def points(self) -> int:
        return 1 + round(16e-3 / self.step)

    @property
    def centre(self) -> float:
        return 0.14e-3 if self.off else 0.0

    @property
    def limit(self) -> float | None:
        """Limit of the median error of G; of the worst seed, twice this."""
        if self.sigma is not None:
            return next(limit for noise, limit in _GAUSSIAN if self.noise <= noise)
        # Two repeats at 0.3 %, every 0.25 mm, or what tells as much.
        told = self.noise * np.sqrt(self.step / 0.25e-3 / self.repeats)
        return _OTHERS[self.label.split()[0]] if told <= 1.0001 * 0.003 / np.sqrt(2) else None

    @property
    def bound(self) -> float | None:
        """Relative Cramer-Rao bound of A, where G is Gaussian."""
        if self.sigma is None:
            return None
        setting = {"centre": self.centre, "points": self.points, "repeats": self.repeats}
        return cramer_rao(self.noise, sigma=self.sigma, **setting)[0]

    def scan(self, seed: int) -> Scan:
        """Return one scan; the seeds of different cases have nothing in common."""
        return simulated(
            kernel=self.kernel, noise=self.noise, points=self.points, repeats=self.repeats,
            centre=(self.centre, 0.0), baseline=0.01 if self.off else 0.0,
            drift=0.005 if self.off else 0.0, seed=crc32(self.name.encode()) + seed,
        )  # fmt: skip


_GAUSSIAN = ((0.001, 0.02), (0.005, 0.06), (0.02, 0.15))
_OTHERS = {"disc": 0.06, "mixture": 0.09, "ring": 0.15}


def _gaussian(sigma: float) -> tuple[str, RadialKernel]:
    return f"Gaussian {sigma:g}", memscal.GaussianMixture((1.0,), (sigma * 1e-3,))


def _disc(radius: float, sigma: float) -> tuple[str, RadialKernel]:
    disc = memscal.SmoothedDisc(radius=radius * 1e-3, sigma=sigma * 1e-3)
    return f"disc {radius:g}/{sigma:g}", disc


def _sum(kind: str, weights: tuple[float, float], *sigmas: float) -> tuple[str, RadialKernel]:
    label = f"{kind} {weights[0]:g}/{weights[1]:g} of {sigmas[0]:g}/{sigmas[1]:g}"
    return label, memscal.GaussianMixture(weights, tuple(s * 1e-3 for s in sigmas))


def _cases() -> Iterator[Case]:
    """Every noise, step and number of repeats with every kind of kernel, not their product."""
    narrow, middle, wide = (_gaussian(s) for s in (0.45, 0.561, 0.75))
    for i, kernel in enumerate((narrow, middle, wide)):
        for j, noise in enumerate((0.001, 0.005, 0.02)):
            yield Case(*kernel, noise, 0.25e-3, 1, (i + j) % 2 == 0)
    yield Case(*middle, 0.001, 0.5e-3, 1, True)
    yield Case(*narrow, 0.003, 0.5e-3, 2, False)
    yield Case(*wide, 0.003, 0.25e-3, 3, True)
    yield Case(*narrow, 0.005, 0.5e-3, 3, True)
    yield Case(*middle, 0.005, 0.5e-3, 1, False)
    yield Case(*wide, 0.02, 0.5e-3, 2, True)
    others = [
        _disc(0.8, 0.3), _sum("mixture", (0.75, 0.25), 0.5, 1.0),
        _sum("ring", (1.3, -0.3), 0.6, 0.3), _disc(0.6, 0.25),
        _sum("mixture", (0.6, 0.4), 0.45, 0.9), _sum("ring", (1.4, -0.4), 0.55, 0.3),
        _disc(1.0, 0.3), _sum("mixture", (0.85, 0.15), 0.55, 1.3),
        _sum("ring", (1.25, -0.25), 0.7, 0.35),
    ]  # fmt: skip
    others_scans = [(0.001, 0.25e-3, 1), (0.005, 0.25e-3, 1), (0.02, 0.25e-3, 3)]
    others_scans += [(0.003, 0.5e-3, 3), (0.005, 0.5e-3, 2), (0.001, 0.5e-3, 1)]
    for i, kernel in enumerate(others):
        yield Case(*kernel, 0.003, 0.25e-3, 2, i % 2 == 0)
    for i, kernel in enumerate(others):
        # Two kernels of each kind go each of the ways, by a stride that mixes them.
        for j in (i // 3, i // 3 + 3):
            noise, step, repeats = others_scans[j]
            yield Case(*kernel, noise, step, repeats, (i + j) % 2 == 1)


CASES = {case.name: case for case in _cases()}

REDUCED = [
    name for i, name in enumerate(CASES) if i in (0, 1, 5, 9, 12, 15, 16, 17, 18, 20, 24, 29)
]
"""The cases that run where time is short: every kind, noise, step and number of repeats."""


def half_width(kernel: RadialKernel) -> float:
    """Diameter of the outermost circle where G is half of its maximum, in m."""
    r = np.linspace(0.0, 5e-3, 5001)
    g = kernel.radial(r)
    last = int(np.flatnonzero(g >= g.max() / 2)[-1])

    def above(radius: float) -> float:
        return float(kernel.radial(np.array([radius]))[0] - g.max() / 2)

    return 2 * float(brentq(above, r[last], r[last + 1]))


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the seeds of a case found, each of shape (seeds,).

    ``g``: relative L2 error of G for r < 3 mm; ``a``, ``u_a``: error of A and its stated
    uncertainty, relative; ``covered``: of each band, the share of it that held the truth.
    """

    case: Case
    g: FloatArray
    a: FloatArray
    u_a: FloatArray
    covered: dict[str, FloatArray]

    @property
    def median(self) -> float:
        return float(np.median(self.g))

    @property
    def worst(self) -> float:
        return float(self.g.max())

    @property
    def beyond(self) -> int:
        """How many seeds are beyond twice the limit of the median."""
        limit = self.case.limit
        return 0 if limit is None else int(np.sum(self.g > 2 * limit))

    @property
    def rms(self) -> float:
        """Root-mean-square error of A, relative."""
        return float(np.sqrt(np.mean(self.a**2)))

    @property
    def bias(self) -> float:
        """Mean error of A in units of its stated uncertainty."""
        return float(self.a.mean() / np.sqrt(np.mean(self.u_a**2)))

    @property
    def bias_error(self) -> float:
        """Standard error of :attr:`bias`: the estimate scatters by its own, not the stated size."""
        return float(self.a.std(ddof=1) / np.sqrt(self.a.size) / np.sqrt(np.mean(self.u_a**2)))

    def coverage(self, band: str) -> tuple[float, float]:
        """How often a band held the truth, and its standard error over the seeds.

        The points of G(r) of one seed err together: the seeds are what is independent.
        """
        held = self.covered[band]
        return float(held.mean()), float(held.std(ddof=1) / np.sqrt(held.size))

    def exceeded(self) -> frozenset[str]:
        """Return the limits that do not hold, beyond what the number of seeds leaves to chance."""
        return frozenset(name for name, holds in self._limits() if not holds)

    def _limits(self) -> Iterator[tuple[str, bool]]:
        seeds, luck = self.g.size, chance(self.g.size)
        if (limit := self.case.limit) is not None:
            yield "error of G", least_median(self.g) <= limit
            yield "worst", self.beyond == 0
        if (bound := self.case.bound) is not None:
            yield "RMS of A", self.rms <= root_mean_square_limit(EFFICIENCY, seeds, luck) * bound
        yield "bias of A", abs(self.bias) - t.isf(luck / 2, seeds - 1) * self.bias_error < 1 / 3
        share, error = self.coverage("G")
        yield "band of G", share + t.isf(luck, seeds - 1) * error >= LEAST_COVERAGE
        for band in self.covered.keys() - {"G"}:
            held = self.covered[band].sum()
            yield f"band of {band}", bool(binom.cdf(held, seeds, LEAST_COVERAGE) >= luck)


def least_median(errors: FloatArray) -> float:
    """Median of all seeds; of few, the smallest that the true median may well be.

    The count of seeds below the true median is binomial, whatever their distribution.
    """
    if errors.size >= FULL_SEEDS:
        return float(np.median(errors))
    return float(np.sort(errors)[int(binom.ppf(chance(errors.size), errors.size, 0.5))])


@lru_cache
def study(name: str, seeds: int = SEEDS) -> Outcome:
    """Calibrate every seed's scan of a case."""
    case = CASES[name]
    truths = {"A": ("conversion_constant", CONVERSION)}
    if case.sigma is not None:
        truths["σ"] = ("gaussian_sigma", case.sigma)
    truths["FWHM"] = ("fwhm", half_width(case.kernel))
    wanted = case.kernel.radial(R)
    g, a, u_a = np.empty((3, seeds))
    covered = {band: np.empty(seeds) for band in ("G", *truths)}
    for seed in range(seeds):
        apparatus = memscal.calibrate(case.scan(seed), method=METHOD).apparatus
        p, found = apparatus.parameters, apparatus.radial(R)
        g[seed] = plane_error(R, found, wanted)
        a[seed] = p["conversion_constant"] / CONVERSION - 1
        u_a[seed] = p.uncertainty("conversion_constant") / CONVERSION
        held = np.abs(found - wanted) <= K95 * apparatus.radial_uncertainty(R)
        covered["G"][seed] = held.mean()
        for band, (parameter, truth) in truths.items():
            covered[band][seed] = abs(p[parameter] - truth) <= K95 * p.uncertainty(parameter)
    return Outcome(case, g, a, u_a, covered)


def mean_efficiency(outcomes: list[Outcome]) -> tuple[float, int]:
    """RMS error of A over its bound, of all cases with a bound; and how many seeds they had."""
    together = np.concatenate([o.a / o.case.bound for o in outcomes if o.case.bound is not None])
    return float(np.sqrt(np.mean(together**2))), together.size


def mean_coverage(outcomes: list[Outcome], band: str) -> tuple[float, float]:
    """Coverage averaged over the cases that have the band, and its standard error."""
    having = [o for o in outcomes if band in o.covered]
    share, error = np.array([o.coverage(band) for o in having]).T
    # A case without a miss says no more than that misses are rarer than its seeds.
    least = 1 / (1 + np.array([o.g.size for o in having]))
    return float(share.mean()), float(np.linalg.norm(np.maximum(error, least)) / len(having))
