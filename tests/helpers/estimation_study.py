"""The study of the estimator of G and A: its cases, the loop over seeds, and what must hold.

Scans are those of helpers.direct, whose calculation is not the analysis's.  Every limit stands
here, on what the truth says: errors and mean errors of G and A, and how the stated bands compare
with the errors, at every radius and from both sides.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any
from zlib import crc32

import numpy as np
from helpers.bounds import (
    FULL,
    cramer_rao,
    deviates,
    root_mean_square,
    root_mean_square_range,
)
from helpers.direct import Kernel, Tapered, direct_scan
from helpers.scans import CONVERSION, calibrated
from scipy.stats import binom, t

import memscal
from memscal import ApparatusFunction, Scan
from memscal.model.arrays import FloatArray

METHOD = "bayesian"
FULL_SEEDS = 200
FEW_SEEDS = 8
SEEDS = FULL_SEEDS if FULL else FEW_SEEDS
R = np.linspace(0.0, 3e-3, 121)
RADII = R[::4]
"""Where the band of G is looked at, in m."""

K95 = 1.96
BANDS = ("A", "σ", "FWHM")
MEAN_COVERAGE = {"G": (0.93, 0.99), "A": (0.93, 0.99), "σ": (0.93, 0.98), "FWHM": (0.93, 0.997)}
"""How often bands of 95 % hold the truth, averaged over all cases."""
EFFICIENCY = 1.15
"""RMS error of A over its Cramer-Rao bound, of all Gaussian cases together."""


def chance(seeds: int) -> float:
    """Probability to leave to the seeds: few, and errors with tails, are given more room."""
    return 0.01 if seeds >= FULL_SEEDS else 1e-4


@dataclass(frozen=True)
class Limits:
    """What must hold of a case, beyond what the number of seeds leaves to chance.

    Pairs are the lowest and the largest value.  200 seeds cannot tell a band that holds in 99 %
    from one that always does: that a band is too wide is told by errors over uncertainties, where
    0.76 and 1.36 are for normal errors bands that hold in 99 % and in 85 %.
    """

    error: tuple[float, float, float]  # median error of G where the scan has the noise of TOLD
    beyond: float = 0.0  # share of seeds whose error is twice that, or more
    bias_g: float = 1.0  # mean error of G in its RMS stated uncertainty, largest of all radii
    coverage: float = 0.85  # share of seeds whose band of G holds the truth, lowest of all radii
    mean_coverage: float = 0.90  # the same, averaged over the radii
    ratio: tuple[float, float] = (0.76, 1.36)  # RMS error of G over RMS stated u, at all radii
    bias_a: float = 1 / 3  # mean error of A in its stated uncertainty
    z_a: tuple[float, float] = (0.8, 1.2)  # RMS of the error over its stated uncertainty
    z_sigma: tuple[float, float] = (0.8, 1.2)  # that of a Gaussian's width
    z_fwhm: tuple[float, float] = (0.76, 1.36)
    efficiency: float = 1.15  # RMS error of A over its Cramer-Rao bound, where G is a Gaussian


TOLD = (0.0022, 0.0055, 0.021)
"""Noise of one reading every 0.25 mm that tells as much as the scan: 0.3 % twice, 0.5 %, 2 %."""

GOALS = {
    "Gaussian": Limits((0.02, 0.06, 0.15)),
    "disc": Limits((0.06, 0.11, 0.20)),
    "mixture": Limits((0.09, 0.09, 0.15)),
    "ring": Limits((0.15, 0.24, 0.26)),
    "sharp disc": Limits((0.15, 0.20, 0.25)),
    "discs at random": Limits((0.15, 0.20, 0.25)),
    "tail": Limits((0.09, 0.09, 0.15)),
    "cone": Limits((0.10, 0.12, 0.20)),
    "paraboloid": Limits((0.10, 0.12, 0.20)),
}
"""What is asked of a kind of kernel; the tables say where it does not hold."""

SMOOTHED = {
    "error": (0.14, 0.14, 0.20),
    "beyond": 0.15,
    "bias_g": 2.3,
    "coverage": 0.25,
    "ratio": (0.1, 2.3),
    "bias_a": 0.6,
    "z_fwhm": (0.15, 1.36),
}
EXCEPTIONS = {
    # The band counts what the scan does not exclude, and a Gaussian has none of it; in a few draws
    # the noise resembles another shape.
    "Gaussian": {"beyond": 0.10, "ratio": (0.04, 1.36), "z_a": (0.4, 1.2), "z_fwhm": (0.06, 1.36)},
    # The noise may resemble a ring, whose hole the film hides, or a Gaussian.
    "disc": {
        "error": (0.08, 0.11, 0.20),
        "beyond": 0.12,
        "ratio": (0.05, 1.36),
        "z_a": (0.45, 1.2),
        "z_fwhm": (0.3, 1.36),
    },
    # A wide tail cannot be told from the baseline.
    "mixture": {
        "beyond": 0.03,
        "bias_g": 1.2,
        "coverage": 0.65,
        "ratio": (0.15, 1.36),
        "bias_a": 0.9,
        "z_a": (0.5, 1.2),
        "z_fwhm": (0.2, 1.36),
    },
    "tail": {
        "bias_g": 1.5,
        "coverage": 0.60,
        "ratio": (0.12, 1.5),
        "bias_a": 1.1,
        "z_a": (0.6, 1.4),
        "z_fwhm": (0.1, 1.36),
    },
    # The hole of a narrow ring is hidden by the film.
    "ring": {
        "error": (0.165, 0.24, 0.26),
        "bias_g": 1.6,
        "coverage": 0.75,
        "ratio": (0.35, 1.6),
        "bias_a": 0.6,
        "z_fwhm": (0.45, 1.5),
    },
    # So is an edge that is sharper than the film passes, above all of a small disc and in noise.
    "sharp disc": {
        "error": (0.18, 0.20, 0.25),
        "beyond": 0.10,
        "bias_g": 1.4,
        "ratio": (0.15, 1.4),
        "bias_a": 0.6,
        "z_a": (0.5, 1.2),
        "z_fwhm": (0.35, 1.36),
    },
    "sharp disc 0.6/0.05, 0.3 %, 0.25 mm x 2": {
        "error": (0.40, 0.40, 0.40),
        "beyond": 0.2,
        "bias_g": 1.9,
        "coverage": 0.60,
        "ratio": (0.04, 1.9),
        "bias_a": 0.7,
    },
    "sharp disc 1.2/0.05, 1 %, 0.5 mm x 2, off": {
        "error": (0.27, 0.27, 0.28),
        "bias_g": 2.3,
        "coverage": 0.25,
        "ratio": (0.2, 2.3),
    },
    "discs at random": {"ratio": (0.3, 1.36), "bias_a": 0.5, "z_a": (0.7, 1.2)},
    # No shape of the prior has a kink.
    "cone": SMOOTHED,
    "paraboloid": SMOOTHED | {"error": (0.15, 0.19, 0.20)},
}
"""Wider limits where a goal is known not to hold, of a kind or of a case by its name."""


@dataclass(frozen=True)
class Case:
    """A kernel, and what its scans are taken with."""

    label: str
    kernel: Kernel
    noise: float  # as a share of the largest signal
    step: float  # in m
    repeats: int
    off: bool  # whether centre (0.14 mm), baseline (1 %) and drift (0.5 %) are off
    state_noise: bool = True

    @property
    def name(self) -> str:
        scan = f"{self.percent} %, {self.step * 1e3:g} mm x {self.repeats}"
        return f"{self.label}, {scan}{', off' if self.off else ''}"

    @property
    def percent(self) -> str:
        return f"{self.noise * 100:g}"

    @property
    def kind(self) -> str:
        return max((kind for kind in GOALS if self.label.startswith(kind)), key=len)

    @property
    def sigma(self) -> float | None:
        """Width of a single Gaussian, in m."""
        if isinstance(self.kernel, memscal.GaussianMixture) and len(self.kernel.sigmas) == 1:
            return self.kernel.sigmas[0]
        return None

    @property
    def setting(self) -> dict[str, Any]:
        centre = 0.14e-3 if self.off else 0.0
        points = 1 + round(16e-3 / self.step)
        return {"centre": centre, "points": points, "repeats": self.repeats}

    @property
    def goal(self) -> Limits:
        return GOALS[self.kind]

    @property
    def limits(self) -> Limits:
        return replace(self.goal, **(EXCEPTIONS.get(self.kind, {}) | EXCEPTIONS.get(self.name, {})))

    def largest_error(self, limits: Limits) -> float:
        """Limit of the median error of G; of the worst seed, twice this."""
        told = self.noise * np.sqrt(self.step / 0.25e-3 / self.repeats)
        noises = zip(TOLD, limits.error, strict=True)
        return next(limit for noise, limit in noises if told <= noise)

    @property
    def bound(self) -> float | None:
        """Relative Cramer-Rao bound of A, where G is Gaussian."""
        if self.sigma is None:
            return None
        setting = self.setting | {"centre": (self.setting["centre"], 0.0)}
        bounds = cramer_rao(self.noise, kernel=self.kernel, **setting)
        return bounds["conversion_constant"] / CONVERSION

    def drawn(self, seed: int) -> tuple[Kernel, float]:
        """Kernel and noise of a seed."""
        return self.kernel, self.noise

    def scan(self, seed: int) -> Scan:
        """Return one scan; the seeds of different cases have nothing in common."""
        kernel, noise = self.drawn(seed)
        return direct_scan(
            kernel,
            noise=noise,
            seed=crc32(self.name.encode()) + seed,
            **self.setting,
            baseline=0.01 * self.off,
            drift=0.005 * self.off,
            state_noise=self.state_noise,
        )


class DiscsAtRandom(Case):
    """Discs of 0.5 to 1.2 mm, blurred by 0.05 to 0.3 mm, at 0.1 to 1 % noise."""

    percent = "0.1 to 1"

    def drawn(self, seed: int) -> tuple[Kernel, float]:
        rng = np.random.default_rng([crc32(self.name.encode()), seed])
        radius, sigma = rng.uniform([0.5e-3, 0.05e-3], [1.2e-3, 0.3e-3])
        return memscal.SmoothedDisc(float(radius), float(sigma)), 10 ** rng.uniform(-3.0, -2.0)


def _gaussian(sigma):
    return f"Gaussian {sigma:g}", memscal.GaussianMixture((1.0,), (sigma * 1e-3,))


def _disc(radius, sigma, kind="disc"):
    disc = memscal.SmoothedDisc(radius=radius * 1e-3, sigma=sigma * 1e-3)
    return f"{kind} {radius:g}/{sigma:g}", disc


def _sum(kind, weights, *sigmas):
    label = f"{kind} {weights[0]:g}/{weights[1]:g} of {sigmas[0]:g}/{sigmas[1]:g}"
    return label, memscal.GaussianMixture(weights, tuple(s * 1e-3 for s in sigmas))


def _cases():
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
        _disc(0.8, 0.3),
        _sum("mixture", (0.75, 0.25), 0.5, 1.0),
        _sum("ring", (1.3, -0.3), 0.6, 0.3),
        _disc(0.6, 0.25),
        _sum("mixture", (0.6, 0.4), 0.45, 0.9),
        _sum("ring", (1.4, -0.4), 0.55, 0.3),
        _disc(1.0, 0.3),
        _sum("mixture", (0.85, 0.15), 0.55, 1.3),
        _sum("ring", (1.25, -0.25), 0.7, 0.35),
    ]
    others_scans = [(0.001, 0.25e-3, 1), (0.005, 0.25e-3, 1), (0.02, 0.25e-3, 3)]
    others_scans += [(0.003, 0.5e-3, 3), (0.005, 0.5e-3, 2), (0.001, 0.5e-3, 1)]
    for i, kernel in enumerate(others):
        yield Case(*kernel, 0.003, 0.25e-3, 2, i % 2 == 0)
    for i, kernel in enumerate(others):
        # Two kernels of each kind go each of the ways, by a stride that mixes them.
        for j in (i // 3, i // 3 + 3):
            noise, step, repeats = others_scans[j]
            yield Case(*kernel, noise, step, repeats, (i + j) % 2 == 1)


def _strangers():
    """Sensors that the prior was not made from: sharp edges, wide tails, other forms."""
    for i, (radius, sigma) in enumerate([(0.8, 0.1), (1.0, 0.1), (1.0, 0.25), (0.6, 0.05)]):
        yield Case(*_disc(radius, sigma, "sharp disc"), 0.003, 0.25e-3, 2, i % 2 == 0)
    yield Case(*_disc(0.8, 0.1, "sharp disc"), 0.001, 0.25e-3, 1, False)
    yield Case(*_disc(1.0, 0.1, "sharp disc"), 0.005, 0.25e-3, 1, True)
    yield Case(*_disc(1.2, 0.05, "sharp disc"), 0.01, 0.5e-3, 2, True)
    typical = memscal.SmoothedDisc(0.85e-3, 0.175e-3)
    yield DiscsAtRandom("discs at random", typical, 0.003, 0.25e-3, 1, True)
    for i, wide in enumerate((1.3, 1.5)):
        for j, noise in enumerate((0.001, 0.005, 0.02)):
            tail = _sum("tail", (0.85, 0.15), 0.55, wide)
            yield Case(*tail, noise, 0.25e-3, 1, (i + j) % 2 == 0)
    for i, power in enumerate((1, 2)):
        form = ("cone 1.2", "paraboloid 1.2")[i], Tapered(1.2e-3, power)
        yield Case(*form, 0.003, 0.25e-3, 2, i == 0)
        yield Case(*form, 0.005, 0.25e-3, 1, i == 1)


STRANGERS = tuple(case.name for case in _strangers())
CASES = {case.name: case for case in (*_cases(), *_strangers())}

_SHORT = (0, 1, 5, 9, 12, 15, 16, 17, 18, 20, 24, 29)
REDUCED = [name for i, name in enumerate(CASES) if i in _SHORT or name in STRANGERS[::3]]
"""The cases that run where time is short: every kind, noise, step and number of repeats."""


def half_width(kernel: Kernel) -> float:
    """Diameter of the outermost circle where G is half of its maximum, in m."""
    r = np.linspace(0.0, 5e-3, 5001)
    g = kernel.radial(r)
    last = int(np.flatnonzero(g >= g.max() / 2)[-1])
    between = slice(last, last + 2)
    return 2 * float(np.interp(-g.max() / 2, -g[between], r[between]))


def plane_norm(error: FloatArray) -> FloatArray:
    """L2 norm over the plane of functions at :data:`R`, along the last axis."""
    return np.sqrt(np.sum(R * error**2, axis=-1))


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the seeds of a case found.

    ``error``, ``u``: error of G at :data:`R` and its stated uncertainty, shape (seeds, radii),
    over the L2 norm of the true G; ``a``: relative error of A, shape (seeds,); ``z``: by band the
    errors over stated uncertainties, shape (seeds,).
    """

    case: Case
    error: FloatArray
    u: FloatArray
    a: FloatArray
    z: dict[str, FloatArray]

    @cached_property
    def g(self) -> FloatArray:
        """Relative L2 error of G for r < 3 mm, shape (seeds,)."""
        return plane_norm(self.error)

    def beyond(self, limits: Limits) -> int:
        """How many seeds are beyond twice the limit of the median."""
        return int(np.sum(self.g > 2 * self.case.largest_error(limits)))

    @cached_property
    def held(self) -> FloatArray:
        """Whether the band of G holds the truth at :data:`RADII`, shape (seeds, radii)."""
        return (np.abs(self.error) <= K95 * self.u)[:, ::4]

    @cached_property
    def ratio(self) -> FloatArray:
        """RMS error of G over the RMS of its stated uncertainty at :data:`RADII`."""
        return root_mean_square(self.error)[::4] / root_mean_square(self.u)[::4]

    @cached_property
    def bias_g(self) -> tuple[FloatArray, FloatArray]:
        """Mean error of G over that uncertainty at :data:`RADII`, and its standard error."""
        scatter = self.error.std(axis=0, ddof=1) / np.sqrt(self.g.size)
        return tuple(x[::4] / root_mean_square(self.u)[::4] for x in (self.error.mean(0), scatter))

    def coverage(self, band: str) -> tuple[float, float]:
        """How often a band held the truth, and its standard error over the seeds."""
        # The points of G(r) of one seed err together: the seeds are what is independent.
        held = self.held.mean(axis=1) if band == "G" else np.abs(self.z[band]) <= K95
        return float(held.mean()), float(held.std(ddof=1) / np.sqrt(held.size))

    def exceeded(self, limits: Limits) -> list[str]:
        """Return the limits that do not hold, beyond what the number of seeds leaves to chance."""
        return [name for name, holds in self._kept(limits) if not holds]

    def _kept(self, limits):
        seeds = self.g.size
        luck = chance(self.g.size)
        # One of many radii may exceed a limit by chance.
        rare = luck / RADII.size
        least, most = root_mean_square_range(seeds, rare)
        yield "error of G", least_median(self.g) <= self.case.largest_error(limits)
        yield "worst", binom.sf(self.beyond(limits) - 1, seeds, limits.beyond) >= luck
        mean, error = self.bias_g
        surely = np.abs(mean) - t.isf(rare / 2, seeds - 1) * error
        yield "bias of G", (surely <= limits.bias_g).all()
        held = self.held.sum(axis=0)
        yield "band of G at a radius", (binom.cdf(held, seeds, limits.coverage) >= rare).all()
        share, error = self.coverage("G")
        yield "band of G", share + t.isf(luck, seeds - 1) * error >= limits.mean_coverage
        yield "u of G small", self.ratio.max() <= limits.ratio[1] * most
        yield "u of G large", self.ratio.min() >= limits.ratio[0] * least
        least, most = root_mean_square_range(seeds, luck)
        if (bound := self.case.bound) is not None:
            yield "RMS of A", root_mean_square(self.a) <= limits.efficiency * most * bound
        z = self.z["A"]
        surely = abs(z.mean()) - t.isf(luck / 2, seeds - 1) * z.std(ddof=1) / np.sqrt(seeds)
        yield "bias of A", surely <= limits.bias_a
        for band, z in self.z.items():
            low, high = {"A": limits.z_a, "σ": limits.z_sigma, "FWHM": limits.z_fwhm}[band]
            yield f"u of {band} small", root_mean_square(z) <= high * most
            yield f"u of {band} large", root_mean_square(z) >= low * least


def least_median(errors: FloatArray) -> float:
    """Median of all seeds; of few, the smallest that the true median may well be."""
    if errors.size >= FULL_SEEDS:
        return float(np.median(errors))
    return float(np.sort(errors)[int(binom.ppf(chance(errors.size), errors.size, 0.5))])


def errors_of(case: Case, seed: int, apparatus: ApparatusFunction) -> dict[str, Any]:
    """Errors of one seed's estimate, by the names of an outcome."""
    truth = case.drawn(seed)[0].radial(R)
    a = apparatus.parameters["conversion_constant"]
    size = plane_norm(truth)
    g = apparatus.radial(R)
    u = apparatus.radial_uncertainty(R)
    return {"error": (g - truth) / size, "u": u / size, "a": a / CONVERSION - 1}


@lru_cache
def study(name: str, seeds: int = SEEDS) -> Outcome:
    """Calibrate every seed's scan of a case."""
    case = CASES[name]
    rows = []
    z = []
    for seed in range(seeds):
        apparatus = calibrated(case.scan(seed), method=METHOD).apparatus
        rows.append(errors_of(case, seed, apparatus))
        p = apparatus.parameters
        width = half_width(case.drawn(seed)[0])
        truths = {"conversion_constant": CONVERSION, "fwhm": width}
        z.append(deviates(p, truths | ({"gaussian_sigma": case.sigma} if case.sigma else {})))
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return Outcome(case, **columns, z=dict(zip(("A", "FWHM", "σ"), np.array(z).T, strict=False)))


def mean_efficiency(outcomes: list[Outcome]) -> tuple[float, int]:
    """RMS error of A over its bound, of all cases with a bound; and how many seeds they had."""
    together = np.concatenate([o.a / o.case.bound for o in outcomes if o.case.bound is not None])
    return float(root_mean_square(together)), together.size


def mean_coverage(outcomes: list[Outcome], band: str) -> tuple[float, float]:
    """Coverage averaged over the cases that have the band, and its standard error."""
    having = [o for o in outcomes if band == "G" or band in o.z]
    share, error = np.array([o.coverage(band) for o in having]).T
    # A case without a miss says no more than that misses are rarer than its seeds.
    least = 1 / (1 + np.array([o.g.size for o in having]))
    return float(share.mean()), float(np.linalg.norm(np.maximum(error, least)) / len(having))
