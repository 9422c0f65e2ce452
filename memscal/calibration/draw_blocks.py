"""Draws of a calibration, in blocks that may go to several processes.

Every draw has a seed of its own, so that neither the blocks nor their order change a number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import repeat
from typing import TYPE_CHECKING

import numpy as np

from memscal.calibration.input_draws import InputDraws, ReferenceTable
from memscal.calibration.inputs import InputEffect
from memscal.calibration.replicate_results import ReplicateResults
from memscal.calibration.workers import worker_pool
from memscal.estimation.replicates import ReplicateEstimator
from memscal.model.validation import FloatArray

if TYPE_CHECKING:
    from memscal.calibration.procedure import Calibration

__all__ = ["DrawModel", "drawn_results"]

_BLOCK = 500
#: Share of a standard uncertainty over which a derivative is a difference.
_SMALL = 0.02


@dataclass(frozen=True, eq=False)
class DrawModel:
    """What turns random numbers into results.

    Parameters
    ----------
    voltages : ndarray, shape (n,)
        What the estimate predicts at the measured points, in V.
    measured : ndarray, shape (n,)
        What was measured there, in V.
    noise_root : ndarray, shape (n, n)
        Square root of the voltages' covariance, in V.
    estimator, results
        From voltages to replicates, and from these to results.
    inputs : InputDraws
        How inputs are drawn.
    effects : mapping of str to InputEffect
        What each does to first order, where the table does not say it exactly.
    table : ReferenceTable or None
        References for inputs of film and rod; ``None`` where none is uncertain, or there are
        several scans.
    """

    voltages: FloatArray
    measured: FloatArray
    noise_root: FloatArray
    estimator: ReplicateEstimator
    results: ReplicateResults
    inputs: InputDraws
    effects: Mapping[str, InputEffect]
    table: ReferenceTable | None

    @classmethod
    def of(cls, calibration: Calibration) -> DrawModel:
        """Set up the draws of a calibration."""
        solution = calibration.solution
        estimate = solution.estimate
        table = None
        if len(solution.scans) == 1:
            table = ReferenceTable.of(solution.scan, estimate.model.reference)
        # An input that moves nothing (Young's modulus at a given load) is drawn all the same.
        return cls(
            voltages=estimate.predicted,
            measured=estimate.points.u,
            noise_root=estimate.noise_root,
            estimator=ReplicateEstimator(estimate),
            results=ReplicateResults.of(solution),
            inputs=InputDraws.of(tuple(calibration.effects), calibration.correlations),
            effects=dict(calibration.effects),
            table=table if table is not None and table.inputs else None,
        )

    def draw(
        self, first: int, last: int, seed: int, only: str | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return scalars and G of the draws from ``first`` up to, not including, ``last``.

        Parameters
        ----------
        first, last : int
            Which draws.
        seed : int
            Seed that each draw's own is spawned from.
        only : str, optional
            Vary only this input beside the noise, or none: ``"noise"``.
        """
        sources, points = len(self.inputs.sources), self.voltages.size
        # The same children as SeedSequence(seed).spawn() gives, whichever block asks for them.
        children = (np.random.SeedSequence(seed, spawn_key=(i,)) for i in range(first, last))
        normal = np.stack(
            [np.random.default_rng(child).standard_normal(sources + points) for child in children]
        )
        standard = self.inputs.standardised(normal[:, :sources])
        noise = normal[:, sources:] @ self.noise_root.T
        if only is not None:
            standard = {name: draws for name, draws in standard.items() if name == only}
        return self._results(self.voltages + noise, standard)

    def _results(
        self, voltages: FloatArray, standard: Mapping[str, FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        scaling = np.ones(len(voltages))
        changes = None
        exact = () if self.table is None else self.table.sources
        for name, draws in standard.items():
            effect = self.effects[name]
            if name not in exact:
                voltages = voltages + draws[:, None] * effect.voltage
            scaling = scaling / (1 - draws * effect.scaling)
        if self.table is not None and any(name in standard for name in exact):
            changes = self.table.drawn(standard, len(voltages))
        return self.results.read(self.estimator.fit(voltages, changes), scaling)

    def first_order(self) -> FloatArray:
        """Standard uncertainty of G by first order in noise and inputs, shape (n,), in 1/m^2.

        By differences about the measured voltages.
        """
        inputs = [self.effects[name].voltage for name in self.inputs.sources]
        columns = np.stack([*self.noise_root.T, *(self.inputs.root.T @ inputs if inputs else [])])
        above, below = (
            self._results(self.measured + side * _SMALL * columns, {})[1] for side in (1, -1)
        )
        return np.asarray(np.linalg.norm((above - below) / (2 * _SMALL), axis=0))


def drawn_results(
    model: DrawModel,
    draws: int,
    seed: int,
    workers: int = 1,
    *,
    block: int = _BLOCK,
    only: str | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return scalars, (draws, 5), and G, (draws, n), of all draws in their order."""
    starts = range(0, draws, block)
    ends = [min(start + block, draws) for start in starts]
    if workers == 1:
        parts = [model.draw(a, b, seed, only) for a, b in zip(starts, ends, strict=True)]
    else:
        with worker_pool(workers) as pool:
            parts = list(pool.map(model.draw, starts, ends, repeat(seed), repeat(only)))
    scalars, profiles = zip(*parts, strict=True)
    return np.concatenate(scalars), np.concatenate(profiles)
