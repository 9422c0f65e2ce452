"""Scans of the sensor that a calibration found, with drawn inputs and noise, calibrated again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import ndtr, ndtri

from memscal.axisymmetry.hankel import RadialSpectrum, radial_spline
from memscal.calibration.functionals import kernel_functionals
from memscal.calibration.inputs import InputEffect, correlation_matrix
from memscal.calibration.solution import Solution, solve
from memscal.calibration.workers import worker_pool
from memscal.errors import MemscalError
from memscal.estimation.forward import Geometry
from memscal.estimation.points import measured_mask
from memscal.mechanics.indent import indent
from memscal.model.checks import OUTLIER_WEIGHT
from memscal.model.scan import Scan
from memscal.model.validation import FloatArray

__all__ = ["DrawnScans", "SolvedInput"]

#: Draws that a process takes at a time.
_LARGEST_BLOCK = 8


@dataclass(frozen=True)
class SolvedInput:
    """A property of a film or rod, the ``part`` of some scans, that the rod is solved for."""

    source: str
    scans: tuple[int, ...]
    part: str
    attribute: str
    value: float
    u: float
    bounds: tuple[float, float]

    def truncated(self, standard: FloatArray) -> FloatArray:
        """Turn normal draws into those of the normal distribution without impossible values."""
        low, high = ndtr((np.array(self.bounds) - self.value) / self.u)
        return np.asarray(ndtri(low + (high - low) * ndtr(standard)))


@dataclass(frozen=True, eq=False)
class DrawnScans:
    """What turns random numbers into scans of a calibrated sensor, and these into results.

    ``solution``, ``effects`` and ``correlations`` are the calibration's; every draw has a seed of
    its own, spawned from ``seed``.
    """

    solution: Solution
    effects: Mapping[str, InputEffect]
    correlations: Mapping[tuple[str, str], float]
    seed: int

    def all_results(
        self, draws: int, workers: int, progress: Callable[[int, int], None] | None
    ) -> tuple[list[FloatArray], list[str]]:
        """Calibrate all draws, in their order; see :meth:`results`."""
        block = max(1, min(_LARGEST_BLOCK, draws // (4 * workers)))
        starts = range(0, draws, block)
        ends = [min(start + block, draws) for start in starts]
        rows: list[FloatArray] = []
        failures: list[str] = []
        with nullcontext() if workers == 1 else worker_pool(min(workers, len(ends))) as pool:
            blocks = (map if pool is None else pool.map)(self.results, starts, ends)
            for end, (good, bad) in zip(ends, blocks, strict=True):
                rows += good
                failures += bad
                if progress is not None:
                    progress(end, draws)
        return rows, failures

    def results(self, first: int, last: int) -> tuple[list[FloatArray], list[str]]:
        """Calibrate the draws from ``first`` up to, not including, ``last``.

        Returns the budgeted parameters and G at the radii, in one row for each draw, and why
        draws could not be calibrated.
        """
        rows, failures = [], []
        for index in range(first, last):
            try:
                rows.append(self._calibrated(self.draw(index)))
            except MemscalError as failure:
                failures.append(failure.problem)
        return rows, failures

    def draw(self, index: int) -> list[Scan]:
        """Return the scans of one draw."""
        # The same child as SeedSequence(seed).spawn() gives, whichever process asks for it.
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(index,)))
        standard = self.standardised(rng.standard_normal(len(self.effects)))
        estimate = self.solution.estimate
        points = estimate.points
        noise: FloatArray = rng.standard_normal(points.u.size)
        if points.decorrelation is not None:
            noise = np.asarray(np.linalg.solve(points.decorrelation, noise), dtype=float)
        residual = points.u - self.solution.deconvolution.predicted
        stray = np.where(estimate.outlier_weight < OUTLIER_WEIGHT, residual, 0.0)
        voltages = self.voltages(standard) + stray + estimate.noise * noise
        return [
            _with_voltages(scan, points.channel, voltages[points.scan == i])
            for i, scan in enumerate(self.solution.scans)
        ]

    def standardised(self, normal: FloatArray) -> dict[str, FloatArray]:
        """Turn normal draws, (inputs, ...), into each input's error over its uncertainty."""
        values, vectors = np.linalg.eigh(correlation_matrix(list(self.effects), self.correlations))
        # The symmetric root: without correlations each input keeps its own draw.
        root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
        joined: dict[str, FloatArray] = dict(zip(self.effects, root @ normal, strict=True))
        if "model_form" in joined:
            joined["model_form"] = np.asarray(np.sqrt(3) * (2 * ndtr(joined["model_form"]) - 1))
        return joined | {item.source: item.truncated(joined[item.source]) for item in self.solved}

    def voltages(self, standard: Mapping[str, FloatArray]) -> FloatArray:
        """Voltages without noise, shape (n,), in V, for the true values of the inputs.

        They are those of the calibration's A and G, convolved with the stress of the true inputs.
        """
        estimate, voltages = self.solution.estimate, self.solution.deconvolution.predicted
        signal = voltages - estimate.background
        exact = {item.source for item in self.solved}
        for source, effect in self.effects.items():
            # An effect is that of a larger value in the analysis: the other way round.
            if source not in exact:
                change = effect.voltage + effect.scaling * signal
                voltages = voltages - standard[source] * change
        if exact:
            model = replace(estimate.model, references=self._reference_changes(standard))
            voltages = voltages + model.signal(self._geometry, estimate.kernel)
        return np.asarray(voltages)

    @cached_property
    def solved(self) -> tuple[SolvedInput, ...]:
        """Stated inputs that the rod is solved for."""
        return tuple(
            item for item in _solved_inputs(self.solution.scans) if item.source in self.effects
        )

    @cached_property
    def _geometry(self) -> Geometry:
        estimate = self.solution.estimate
        return estimate.model.geometry(estimate.centres)

    @cached_property
    def _nominal(self) -> list[FloatArray]:
        pairs = zip(self.solution.scans, self.solution.estimate.model.references, strict=True)
        return [_rod_spectrum(scan, reference) for scan, reference in pairs]

    def _reference_changes(self, standard: Mapping[str, FloatArray]) -> tuple[RadialSpectrum, ...]:
        """True reference of each scan less the nominal one, by the ratio of the rod's solutions."""
        true = list(self.solution.scans)
        for item in self.solved:
            value = np.clip(item.value + item.u * standard[item.source], *item.bounds)
            for i in item.scans:
                owner = replace(getattr(true[i], item.part), **{item.attribute: float(value)})
                true[i] = replace(true[i], **{item.part: owner})
        parts = zip(true, self.solution.estimate.model.references, self._nominal, strict=True)
        return tuple(
            replace(ref, values=ref.values * (_rod_spectrum(scan, ref) / nominal - 1))
            for scan, ref, nominal in parts
        )

    def _calibrated(self, scans: list[Scan]) -> FloatArray:
        """Calibrate a draw by the calibration's own steps, and read G off at its radii."""
        own = self.solution
        solution = solve(scans, own.stresses, own.regulariser, own.estimate.points.channel)
        result, radii = solution.deconvolution, own.deconvolution.g.r
        r, g = result.g.r, result.g.radial
        g = np.where(radii <= r[-1], radial_spline(r, g)(np.minimum(radii, r[-1])), 0.0)
        numbers = (
            functional.value for functional in kernel_functionals(result.g, result.gaussian_sigma)
        )
        sigma = solution.estimate.gaussian.sigma
        return np.array([result.conversion_constant, sigma, *numbers, *g])


def _solved_inputs(scans: tuple[Scan, ...]) -> Iterator[SolvedInput]:
    """Uncertain properties of each distinct film and rod, named as their effects are."""
    for name, part, attribute in (
        ("thickness", "film", "thickness"),
        ("poisson_ratio", "film", "poisson_ratio"),
        ("rod_radius", "indenter", "radius"),
    ):
        owners = [getattr(scan, part) for scan in scans]
        for number, owner in enumerate(dict.fromkeys(owners), start=1):
            value, u = getattr(owner, attribute), getattr(owner, f"{attribute}_uncertainty")
            if u:
                source = name if number == 1 else f"{name}_{number}"
                bounds = (0.0, 0.5) if name == "poisson_ratio" else (value / 2, np.inf)
                own = tuple(i for i, other in enumerate(owners) if other == owner)
                yield SolvedInput(source, own, part, attribute, value, u, bounds)


def _rod_spectrum(scan: Scan, reference: RadialSpectrum) -> FloatArray:
    contact = indent(scan.film, scan.indenter, load=scan.load)
    k = reference.wavenumbers.k
    return contact.base_shear_spectrum(k) if reference.order else contact.base_spectrum(k)


def _with_voltages(scan: Scan, channel: str, voltages: FloatArray) -> Scan:
    """Return the scan with other voltages of a channel at its measured points, shape (n,)."""
    u = np.full(scan.u_zz.shape, np.nan)
    u[measured_mask(scan, channel)] = voltages
    if channel == "zz":
        return replace(scan, u_zz=u)
    return replace(scan, channels={**scan.channels, f"u_{channel}": u})
