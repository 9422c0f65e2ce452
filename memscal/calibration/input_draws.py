r"""Draws of the uncertain inputs of a calibration, and of what they do to its reference.

Every input is assigned the distribution that its statement amounts to (JCGM 101:2008, 6.4): a
normal one, cut off where no film or rod is (Poisson's ratio at 0 and 1/2, lengths at half their
value), or a rectangular one for the model's form.  Correlated inputs are joined by a Gaussian
copula.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.special import ndtr, ndtri

from memscal.axisymmetry.hankel import RadialSpectrum
from memscal.calibration.inputs import correlation_matrix
from memscal.mechanics.indent import indent
from memscal.model.scan import Scan
from memscal.model.validation import FloatArray

__all__ = ["InputDraws", "ReferenceTable"]

#: The reference is solved at this many values of each input, out to this many uncertainties.
_NODES = 5
_REACH = 3.5
#: Films have no Poisson's ratio beyond these.
_POISSON = (0.0, 0.5)


@dataclass(frozen=True, eq=False)
class InputDraws:
    """How standard normal draws become inputs.

    Parameters
    ----------
    sources : tuple of str
        The inputs whose uncertainty is stated.
    root : ndarray, shape (sources, sources)
        Square root of their correlation matrix.
    """

    sources: tuple[str, ...]
    root: FloatArray

    @classmethod
    def of(
        cls, sources: Sequence[str], correlations: Mapping[tuple[str, str], float]
    ) -> InputDraws:
        """Set up the draws of some sources."""
        values, vectors = np.linalg.eigh(correlation_matrix(list(sources), correlations))
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        # The symmetric root: without correlations each input keeps its own draw.
        return cls(tuple(sources), root @ vectors.T)

    def standardised(self, normal: FloatArray) -> dict[str, FloatArray]:
        """Turn independent normal draws, (draws, sources), into each input's own, in its u."""
        joined = normal @ self.root.T
        found = dict(zip(self.sources, joined.T, strict=True))
        if "model_form" in found:
            found["model_form"] = np.sqrt(3) * (2 * ndtr(found["model_form"]) - 1)
        return found


@dataclass(frozen=True, eq=False)
class _Input:
    """A number that the rod's solution depends on; ``nodes`` are where it is solved."""

    source: str
    value: float
    u: float
    lowest: float
    highest: float

    @property
    def nodes(self) -> FloatArray:
        low = max(self.value - _REACH * self.u, self.lowest)
        high = min(self.value + _REACH * self.u, self.highest)
        # Chebyshev's points: a polynomial through them is good in between.
        cosine = np.cos(np.pi * np.arange(_NODES - 1, -1, -1) / (_NODES - 1))
        return np.asarray((low + high) / 2 + (high - low) / 2 * cosine)

    def quantiles(self, probability: FloatArray) -> FloatArray:
        """Quantiles of the normal distribution without its tails beyond the bounds."""
        low, high = ndtr((np.array([self.lowest, self.highest]) - self.value) / self.u)
        return np.asarray(self.value + self.u * ndtri(low + (high - low) * probability))

    def shares(self, values: FloatArray) -> FloatArray:
        """Lagrange's weights of the nodes at the values, shape (nodes, values)."""
        nodes = self.nodes
        apart = np.subtract.outer(nodes, nodes) + np.eye(nodes.size)
        away = np.subtract.outer(nodes, values)
        each = [np.delete(away, i, axis=0).prod(axis=0) for i in range(nodes.size)]
        sign = (-1.0) ** (nodes.size - 1)
        return np.asarray(sign * np.stack(each) / apart.prod(axis=1)[:, None])


@dataclass(frozen=True, eq=False)
class ReferenceTable:
    """Transforms of the rod's solution on a grid of its uncertain inputs.

    Between the grid's values a polynomial of the fourth degree in each input is taken; a test
    compares it with solutions in between.

    Parameters
    ----------
    inputs : tuple
        Thickness, Poisson's ratio and radius, where their uncertainty is stated.
    changes : ndarray, shape (grid, nodes)
        By how much the transform differs from the reference's, on the inputs' grid.
    """

    inputs: tuple[_Input, ...]
    changes: FloatArray

    @property
    def sources(self) -> tuple[str, ...]:
        """The inputs' names."""
        return tuple(each.source for each in self.inputs)

    @classmethod
    def of(cls, scan: Scan, reference: RadialSpectrum) -> ReferenceTable:
        """Solve the rod of a scan on the grid; of another reference, the ratio is taken over."""
        inputs = _uncertain_inputs(scan)
        k = reference.wavenumbers.k

        def transform(values: Sequence[float]) -> FloatArray:
            changed = dict(zip((each.source for each in inputs), values, strict=True))
            film = replace(
                scan.film,
                thickness=changed.get("thickness", scan.film.thickness),
                poisson_ratio=changed.get("poisson_ratio", scan.film.poisson_ratio),
            )
            rod = replace(scan.indenter, radius=changed.get("rod_radius", scan.indenter.radius))
            contact = indent(film, rod, load=scan.load)
            return contact.base_shear_spectrum(k) if reference.order else contact.base_spectrum(k)

        scale = reference.values / transform([each.value for each in inputs])
        grid = product(*(each.nodes.tolist() for each in inputs))
        solved = np.stack([transform(place) for place in grid])
        return cls(inputs, solved * scale - reference.values)

    def drawn(self, standard: Mapping[str, FloatArray], count: int) -> FloatArray:
        """Changes of the reference for standardised draws of the inputs, shape (count, nodes).

        An input without draws keeps its value.
        """
        shares = np.ones((1, count))
        for each in self.inputs:
            kept = np.full(count, each.value)
            draws = standard.get(each.source)
            own = each.shares(kept if draws is None else each.quantiles(ndtr(draws)))
            shares = (shares[:, None, :] * own[None]).reshape(-1, count)
        return np.asarray(shares.T @ self.changes)

    def quantiles(self, source: str, probability: FloatArray) -> FloatArray:
        """Quantiles of one input, in its own unit."""
        return self._named(source).quantiles(probability)

    def stated(self, source: str) -> float:
        """Stated standard uncertainty of one input, in its own unit."""
        return self._named(source).u

    def _named(self, source: str) -> _Input:
        return next(each for each in self.inputs if each.source == source)


def _uncertain_inputs(scan: Scan) -> tuple[_Input, ...]:
    film, rod = scan.film, scan.indenter
    h, a = film.thickness, rod.radius
    stated = [
        ("thickness", h, film.thickness_uncertainty, h / 2, np.inf),
        ("poisson_ratio", film.poisson_ratio, film.poisson_ratio_uncertainty, *_POISSON),
        ("rod_radius", a, rod.radius_uncertainty, a / 2, np.inf),
    ]
    return tuple(_Input(name, value, u, low, high) for name, value, u, low, high in stated if u)
