"""The study outside the model: what scans do not state, one thing at a time, and what tells it.

Each row makes scans by the calculation of helpers.outside with one thing other than stated. The
size at which A (or sigma) is wrong by two standard uncertainties is found without noise; at three a
row is alarmed if checks fail; where a scan states the size as a standard uncertainty, sizes drawn
from it are counted, at two and at three; where a calibration names a size, it is compared.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from helpers import two_states
from helpers.bounds import FULL, deviates, root_mean_square
from helpers.direct import LOADS, TABLE, base_stresses
from helpers.outside import ROUND, SIGMA, A, Noise, World, correlated, elliptic, lobe, tail
from helpers.outside import scan as perturbed_scan
from helpers.scans import calibrated
from scipy.interpolate import make_interp_spline
from scipy.special import j0

from memscal import ApparatusFunction, Scan
from memscal.model.arrays import FloatArray

RUNS = 30 if FULL else 6
DRAWS = 60 if FULL else 6
TRUTHS = {"conversion_constant": A, "gaussian_sigma": SIGMA}
SYMBOLS = {"conversion_constant": "A", "gaussian_sigma": "σ", "friction": "μ"}
#: Sizes are tried up to this factor of the first one, each larger by this ratio.
_FARTHEST = 32.0
_RATIO = 1.25
#: Limits of what is counted (rms of z), alarmed (share of runs) and named (factor).
COUNTED = 1.4
ALARMED = 0.9
NAMED = 1.5


Stated = Callable[[Scan, float], Scan]


def states(name: str) -> Stated:
    """Say how a scan states the size as a standard uncertainty of its own."""
    return lambda scan, size: replace(scan, **{f"{name}_uncertainty": size})


def states_of_film(name: str) -> Stated:
    """Say how a scan states the size as a standard uncertainty of its film."""

    def stated(scan, size):
        return replace(scan, film=replace(scan.film, **{f"{name}_uncertainty": size}))

    return stated


def by_default(scan: Scan, size: float) -> Scan:
    """Say that a scan need not state the size."""
    return scan


@dataclass(frozen=True)
class Row:
    """One thing that a scan does not state."""

    name: str
    world: Callable[[float], World]  # of a size
    first: float  # a size of which less than two uncertainties come, in SI units
    unit: str = ""
    per_unit: float = 1.0  # of what the table shows
    stated: Stated | None = None
    assumption: str = ""  # that names the size
    named: Callable[[float], float] = float  # the size as the assumption has it
    shown_by: str = ""  # what measurement would show it, where a line cannot
    parameter: str = "conversion_constant"
    signs: tuple[float, ...] = (-1.0, 1.0)

    def shift(self, size: float) -> float:
        """Mean error by a size, over the standard uncertainty."""
        exact = self.deviation(self.exactly(0.0))
        return abs(self.deviation(self.exactly(size)) - exact)

    def exactly(self, size: float) -> ApparatusFunction:
        """Calibrate a scan of a size without noise, which it states as it is."""
        world = self.world(size)
        scan = perturbed_scan(world, 0)
        scan = replace(scan, u_zz=world.voltages(scan.x))
        return calibrated(scan, other=False).apparatus

    def failed(self, size: float, seed: int) -> list[str]:
        """Names of the checks that a scan of a size fails."""
        apparatus = calibrated(perturbed_scan(self.world(size), seed)).apparatus
        return [check.name for check in apparatus.checks if not check.passed]

    def stated_deviations(self, size: float, draws: int) -> list[float]:
        """Deviations where sizes are drawn from what scans state as a standard uncertainty."""
        z = []
        for seed in range(draws):
            drawn = size * abs(np.random.default_rng([35, seed]).normal())
            z.append(self.stated_deviation(self.signs[seed % len(self.signs)] * drawn, size, seed))
        return z

    def stated_deviation(self, drawn: float, size: float, seed: int) -> float:
        """Deviation of a scan that is made with one size and states another."""
        scan = self.stated(perturbed_scan(self.world(drawn), seed), size)
        return self.deviation(calibrated(scan, other=False).apparatus)

    def deviation(self, apparatus: ApparatusFunction) -> float:
        """Error of the parameter over its standard uncertainty."""
        return deviates(apparatus.parameters, {self.parameter: TRUTHS[self.parameter]})[0]

    def sizes_at(self, deviations: Sequence[float]) -> list[float]:
        """Sizes at which the mean error is so many uncertainties; infinite if none is."""
        tried = [0.0]
        found = [0.0]
        size = self.first
        while size < _FARTHEST * self.first and found[-1] < max(deviations):
            tried.append(size)
            found.append(self.shift(size))
            size *= _RATIO
        largest = np.maximum.accumulate(found)
        return [float(np.interp(each, largest, tried, right=np.inf)) for each in deviations]


@dataclass(frozen=True)
class StatesRow(Row):
    """One thing of a lubricated scan that neither it nor the dry one states."""

    stated: Stated | None = by_default
    parameter: str = "friction"
    perturbed: str = ""  # the argument of two_states.perturbed that the size changes
    none: float = 1.0  # which is this where nothing is off
    stating: str = ""  # the argument that states the size

    def outcome(self, size: float, seed: int, **stated: float) -> two_states.Outcome:
        """Compare an experiment of a size."""
        changed = {"lubricated": 0.0} | {self.perturbed: self.none + size}
        return two_states.perturbed(seed=seed, **changed, **stated)

    def shift(self, size: float) -> float:
        """Mean error by a size, over the standard uncertainty, with the noise of one seed."""
        return abs(self.outcome(size, 0).deviation - self.outcome(0.0, 0).deviation)

    def failed(self, size: float, seed: int) -> list[str]:
        """Names of the checks that an experiment of a size fails."""
        return list(self.outcome(size, seed).failed)

    def stated_deviation(self, drawn: float, size: float, seed: int) -> float:
        """Deviation of an experiment that is made with one size and states another."""
        return self.outcome(drawn, seed, **{self.stating: size}).deviation


@dataclass(frozen=True)
class NoiseRow(Row):
    """Noise whose correlation, as its size, no scan states: its errors have no mean."""

    stated: Stated | None = by_default
    noise: Noise | None = None

    def sizes_at(self, deviations: Sequence[float]) -> list[float]:
        """No size moves the mean."""
        return [math.inf for _ in deviations]

    def stated_deviations(self, size: float, draws: int) -> list[float]:
        """Deviations of scans without an alarm."""
        z = []
        seed = 0
        while len(z) < draws:
            scan = perturbed_scan(ROUND, seed, noise=0.0, noise_stated=False)
            noise = self.noise(np.random.default_rng([35, seed]), scan.x.size)
            scan = replace(scan, u_zz=scan.u_zz + size * scan.u_zz.max() * noise)
            calibration = calibrated(scan)
            seed += 1
            if calibration.passed:
                z.append(self.deviation(calibration.apparatus))
        return z


@dataclass(frozen=True)
class NeoHookean(World):
    """A film of rubber, in a world else as stated: its base stress is of finite elements."""

    def base(self, k: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Transforms of normal stress and shear at the base per newton, at wavenumbers (n,)."""
        # Per newton, linear in the load between those that are solved.
        solved = base_stresses(self.radius, "neo-hookean")
        linear = base_stresses(self.radius, "linear")
        per_newton = [linear[LOADS[0]] / LOADS[0], *(solved[load] / load for load in LOADS)]
        stress = make_interp_spline((0.0, *LOADS), per_newton, k=1)(min(self.load, LOADS[-1]))
        grid = np.linspace(0.0, 25 / self.thickness, 600)
        kernel = j0(np.multiply.outer(grid, TABLE)) * TABLE
        transform = 2 * np.pi * np.trapezoid(kernel * stress, TABLE, axis=1)
        normal = make_interp_spline(grid, transform)(np.minimum(k, grid[-1]))
        return normal * (k < grid[-1]), np.zeros_like(k)


@dataclass(frozen=True)
class Outcome:
    """What tells a row: sizes at two and three uncertainties, and what happens there."""

    row: Row
    two: float
    three: float
    alarmed: float  # share of runs at the largest of these with a failed check
    check: str  # that fails most often
    counted: tuple[float, ...]  # rms of error over uncertainty where the scan states the sizes
    named: float | None  # the size of two uncertainties as named, over that found

    @property
    def told_by(self) -> tuple[str, ...]:
        """What tells the row, of counted, alarmed and named."""
        told = []
        if self.counted and max(self.counted) <= COUNTED:
            told.append("counted")
        if self.alarmed >= ALARMED:
            told.append("alarmed")
        if self.named is not None and self.row.shown_by and 1 / NAMED < self.named < NAMED:
            told.append("named")
        return tuple(told)


@lru_cache
def outcome(row: Row, runs: int = RUNS, draws: int = DRAWS) -> Outcome:
    """Run one row of the study."""
    two, three = row.sizes_at((2.0, 3.0))
    failed = Counter()
    alarmed = math.nan
    sizes = [size for size in (two, three) if math.isfinite(size)]
    if sizes:
        by_run = [row.failed(sizes[-1], seed) for seed in range(runs)]
        alarmed = sum(map(bool, by_run)) / runs
        for names in by_run:
            failed.update(names)
    stated = sizes or [row.first]
    by_size = [row.stated_deviations(size, draws) for size in stated] if row.stated else []
    counted = [float(root_mean_square(z)) for z in by_size]
    named = None
    if row.assumption and math.isfinite(two):
        assumptions = {each.name: each for each in row.exactly(0.0).assumptions}
        size = assumptions[row.assumption].sizes[row.parameter]
        # Of an offset the error grows with the square.
        factor = math.sqrt(2) if row.assumption == "line_offset" else 2.0
        named = factor * size / row.named(two)
    check = failed.most_common(1)[0][0] if failed else ""
    return Outcome(row, two, three, alarmed, check, tuple(counted), named)


def no_other(size: float) -> World:
    """Return the world as stated."""
    return ROUND


def of_rubber(load: float) -> World:
    """Return the world of a film of rubber under a load; none is a vanishing one."""
    return NeoHookean(load=max(load, 1e-3))


def _ratio_of_lobe(distance):
    """Axis ratio, less one, of a sensor with a fifth of its sensitivity beside the line."""
    return math.sqrt(1 + 0.16 * (distance / SIGMA) ** 2) - 1


ROWS = {
    row.name: row
    for row in (
        Row(
            "long axis along the line",
            lambda size: elliptic(1 + size),
            0.05,
            stated=states("roundness"),
            assumption="roundness",
            shown_by="a second line across, or a raster",
        ),
        Row(
            "long axis across the line",
            lambda size: elliptic(1 / (1 + size)),
            0.05,
            stated=states("roundness"),
            assumption="roundness",
            shown_by="a second line across, or a raster",
        ),
        Row(
            "a fifth of the sensitivity beside the line",
            lobe,
            0.3e-3,
            "mm",
            1e3,
            lambda scan, size: replace(scan, roundness_uncertainty=_ratio_of_lobe(size)),
            assumption="roundness",
            named=_ratio_of_lobe,
            shown_by="a raster",
        ),
        Row(
            "line beside the sensor",
            lambda size: replace(ROUND, line_offset=size),
            0.1e-3,
            "mm",
            1e3,
            states("line_offset"),
            "line_offset",
            shown_by="a second line across, or a raster",
        ),
        Row(
            "scale of the stage",
            lambda size: replace(ROUND, stage_scale=1 + size),
            0.006,
            "%",
            100.0,
            states("position_scale"),
            "stage_scale",
            shown_by="a calibrated scale beside the stage",
        ),
        Row(
            "scale of the load",
            lambda size: replace(ROUND, load_scale=1 + size),
            0.01,
            "%",
            100.0,
            lambda scan, size: replace(scan, load_uncertainty=size * scan.load),
            shown_by="a calibrated load cell",
        ),
        Row(
            "slip at the base",
            lambda size: replace(ROUND, base_slip=size),
            0.05,
            "",
            1.0,
            states("base_slip"),
            "base_slip",
            shown_by="a film of another thickness",
            signs=(1.0,),
        ),
        Row(
            "tail of G of 3 mm",
            tail,
            0.02,
            "%",
            100.0,
            shown_by="noise of 0.1 % and a baseline stated as straight",
        ),
        Row(
            "baseline, one cosine",
            lambda size: replace(ROUND, cosine=size),
            0.002,
            "%",
            100.0,
            # From edge to centre it is twice its amplitude.
            lambda scan, size: replace(scan, baseline_curvature_uncertainty=2 * size),
        ),
        Row(
            "baseline, parabola",
            lambda size: replace(ROUND, parabola=size),
            0.005,
            "%",
            100.0,
            states("baseline_curvature"),
            "baseline_curvature",
        ),
        Row(
            "baseline, step",
            lambda size: replace(ROUND, step=size),
            0.005,
            "%",
            100.0,
            states("baseline_curvature"),
        ),
        Row(
            "amplifier, b",
            lambda size: replace(ROUND, gain_curvature=size),
            0.02,
            "%",
            100.0,
            states("gain_curvature"),
            "gain_curvature",
        ),
        Row(
            "response to shear",
            lambda size: replace(ROUND, shear_sensitivity=-size),
            0.03e-3,
            "mm",
            1e3,
            stated=states("shear_sensitivity"),
            assumption="shear_sensitivity",
        ),
        Row(
            "Poisson's ratio below a half",
            lambda size: replace(ROUND, poisson_ratio=0.5 - abs(size)),
            0.02,
            stated=states_of_film("poisson_ratio"),
        ),
        Row(
            "thickness",
            lambda size: replace(ROUND, thickness=2e-3 + size),
            0.03e-3,
            "mm",
            1e3,
            states_of_film("thickness"),
            parameter="gaussian_sigma",
        ),
        Row(
            "lag along the line",
            lambda size: replace(ROUND, lag=size),
            0.05e-3,
            "mm",
            1e3,
            shown_by="the line scanned back: its centre moves by twice the lag",
            parameter="gaussian_sigma",
        ),
        Row(
            "law stated as linear, film of rubber: the load",
            of_rubber,
            0.1,
            "N",
            stated=lambda scan, _: replace(scan, film=replace(scan.film, law="")),
            signs=(1.0,),
        ),
        NoiseRow(
            "slow noise, AR(0.9)",
            no_other,
            0.004,
            "%",
            100.0,
            noise=correlated(0.9, 1.0, 0.75),
        ),
        NoiseRow(
            "slow noise, AR(0.98)",
            no_other,
            0.005,
            "%",
            100.0,
            noise=correlated(0.98, 1.0, 0.4),
        ),
        StatesRow(
            "friction of lubricated contacts",
            no_other,
            0.01,
            perturbed="lubricated",
            stating="width",
            none=0.0,
            signs=(1.0,),
        ),
        StatesRow(
            "gain of lubricated scans",
            no_other,
            0.004,
            "%",
            100.0,
            perturbed="gain",
            stating="gain_uncertainty",
        ),
        StatesRow(
            "loads of lubricated scans",
            no_other,
            0.008,
            "%",
            100.0,
            perturbed="load",
            stating="load_uncertainty",
        ),
    )
}
"""What a scan may be made with that it does not state."""
