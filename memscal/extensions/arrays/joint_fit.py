r"""Joint fit of an array: everything of each sensor, one shape of G, crosstalk, noise.

What is each sensor's own is integrated out in closed form, with a prior for the crosstalk; what is
left is data and kernels of one sensor, of which the shape of G is found as that of a single one
(:mod:`memscal.estimation.bayesian`).  The prior of the crosstalk is

.. math::

    c_{ij} = m + e_{ij}, \qquad m \sim N(0,\,0.05^2), \qquad e_{ij} \sim N(0,\,t^2),

with t by its marginal likelihood, and a mean m of neighbours and one of all other pairs.  A prior
about zero would take a common crosstalk for a ring of the common G.
"""

from __future__ import annotations

from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum
from memscal.errors import FitError
from memscal.estimation import bayesian
from memscal.estimation.bayesian import Weighing
from memscal.estimation.departures import ReducedScan, departure_basis
from memscal.estimation.voltage_map import square_root
from memscal.extensions.arrays.joint_model import (
    ArrayState,
    JointModel,
    Layout,
    Noise,
    taken,
)
from memscal.model.arrays import TINY, FloatArray, array_record, floats

#: Standard deviations of crosstalk about its mean that are weighed, and that of the mean.
SPREADS = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05)
WIDEST = SPREADS[-1]
#: Standard deviation of what is a sensor's own: ln width, and departures over the Gaussian's size.
_OWN = 0.05
#: Rounds of a fit, and of the first one, after which the noise is known.
_MOST_ROUNDS = 12
_FIRST_ROUNDS = 3
#: Points of a mean along the scan.
_NODES = 8
#: A sensor's own noise is at least this share of its variance, and of its largest reading.
_LEAST_OWN = 0.02
_ROUNDING = 1e-7
#: Steps end below this share of a standard uncertainty.
_SETTLED = 0.1
#: The longest step of a centre, in widths of G.
_LONGEST = 0.5


@array_record
class Posterior:
    """What the readings tell of parameters and common kernel, by a prior of the crosstalk."""

    change: FloatArray  # (p,): of the parameters
    kernel: FloatArray  # (nodes,): transform of the common kernel, in V/Pa
    root: FloatArray  # (p + nodes, c): of the covariance of both
    gain: FloatArray  # (p + nodes, f): changes of both by kernels (f,) that the readings add


@array_record
class JointFit:
    """The posterior of an array."""

    model: JointModel
    state: ArrayState
    noise: Noise
    information: FloatArray  # (1 + p + f, 1 + p + f): of the last step
    posterior: Posterior
    widest: Posterior  # by the widest prior of the crosstalk
    log_evidence: float

    @property
    def reference(self) -> RadialSpectrum:
        """Transform of the base stress per newton."""
        return self.model.forward.reference

    @property
    def by_widest(self) -> JointFit:
        """The same by the widest prior of the crosstalk."""
        change = self.widest.change - self.posterior.change
        state = self.model.layout.moved(self.state, change)
        return replace(self, state=state, posterior=self.widest)

    @property
    def residual(self) -> FloatArray:
        """Readings that are not explained, (m, t), in V; zero where not kept."""
        return self.model.residual(self.state)


def prior_precision(layout: Layout, spread: float) -> FloatArray:
    """Return the prior precision of all parameters, (p, p); zero of what has a flat prior."""
    precision = np.zeros((layout.count, layout.count))
    for kind in (layout.near, ~layout.near):
        places = layout.crosstalk[kind & (layout.crosstalk >= 0)]
        # Of t^2 1 + m^2 1 1', by Sherman and Morrison.
        alike = WIDEST**2 / (spread**2 + places.size * WIDEST**2)
        precision[np.ix_(places, places)] = (np.eye(places.size) - alike) / spread**2
    own = layout.own[layout.own >= 0]
    precision[own, own] = _OWN**-2
    return precision


def parameters_of(layout: Layout, state: ArrayState) -> FloatArray:
    """Return the parameters that have a prior, (p,); zero of all others."""
    # The last one is that of all places of -1.
    values = np.zeros(layout.count + 1)
    values[layout.crosstalk] = state.crosstalk
    values[layout.own] = state.own
    return values[:-1]


def inverse_root(matrix: FloatArray) -> FloatArray:
    """Return the root of the inverse of normal equations; refuse those of no solution."""
    with np.errstate(divide="ignore"):
        scale = np.diag(matrix) ** -0.5
    try:
        inverse = np.linalg.inv(matrix * np.outer(scale, scale))
        return floats(scale[:, None] * np.linalg.cholesky(inverse))
    except np.linalg.LinAlgError:
        raise FitError(
            "The scan does not determine the array: a sensor has too few readings about its "
            "centre.",
            cure="Scan past every sensor, or leave the sensor out (used).",
        ) from None


def noise_of(model: JointModel, state: ArrayState) -> Noise:
    """Estimate each sensor's own noise, and what is common to a board, from what is left."""
    presses = model.presses
    residual = model.residual(state)
    errors = model.press_errors(state)
    count = np.maximum(presses.keep.sum(axis=1), 1)
    freedom = np.maximum(1 - model.layout.count / presses.used.sum() / count, 0.1)
    smallest = (_ROUNDING * np.ptp(presses.u, axis=1)) ** 2
    # Presses whose stated errors are small to a sensor, as it is far from them, tell its noise.
    kept = np.ma.masked_array(residual**2, ~presses.keep)
    typical: Any = np.ma.median(kept, axis=1)  # type: ignore[no-untyped-call] # np.ma has no types
    level = typical.filled(0.0) + np.maximum(smallest, TINY)
    weight = presses.keep / (level[:, None] + np.sum(errors**2, axis=0))
    weighed = weight * np.concatenate([residual[None], errors])
    of_all, *of_errors = weighed @ weighed.mT / np.maximum(weight @ weight.T, TINY)
    square = of_all / np.sqrt(np.outer(freedom, freedom)) - sum(of_errors)
    common = np.zeros_like(square)
    for i in np.unique(presses.board):
        members = np.flatnonzero(presses.used & (presses.board == i))
        if members.size > 1:
            block = np.ix_(members, members)
            shared = np.mean(square[block][np.triu_indices(members.size, 1)])
            common[block] = max(shared, 0.0)
    total = np.diag(square)
    if presses.stated is not None:
        stated = np.sum(presses.stated**2, axis=1, where=presses.keep) / count
        total = np.maximum(total, stated)
    least = np.maximum(_LEAST_OWN * total, smallest)
    least[~presses.used] = 1.0
    return Noise(np.maximum(total - np.diag(common), least), common)


def fit_array(model: JointModel, state: ArrayState, noise: Noise) -> JointFit:
    """Fit an array from a start; the noise is that of the residuals."""
    first = fit_shape(model, state, noise, _FIRST_ROUNDS)
    if model.presses.averaging:
        model = _at_positions(model, first.state)
    return fit_shape(model, first.state, noise_of(model, first.state))


def _at_positions(model: JointModel, state: ArrayState) -> JointModel:
    """Take off what a mean along the scan adds to each reading, by what is predicted nearby."""
    presses = model.presses
    change = model.predicted(state)
    for node, weight in zip(*np.polynomial.legendre.leggauss(_NODES), strict=True):
        centres = state.centres.copy()
        centres[:, presses.axes[0]] -= node / 2 * presses.averaging
        change -= weight / 2 * model.predicted(replace(state, centres=centres))
    u = np.where(presses.keep, presses.u + change, 0.0)
    return replace(model, presses=replace(presses, u=u))


def fit_shape(
    model: JointModel, state: ArrayState, noise: Noise, rounds: int = _MOST_ROUNDS
) -> JointFit:
    """Fit an array by damped Gauss-Newton steps, each with the shapes of G weighed anew."""
    spreads = SPREADS if model.layout.crosstalk.max() >= 0 else [WIDEST]
    for _ in range(rounds):
        data = model.residual(replace(state, kernel=model.start))
        information = model.information(state, noise, data)
        weighed = [weighed_by(model, information, state, spread) for spread in spreads]
        likeliest = max(weighed, key=attrgetter("log_evidence"))
        best = likeliest.posterior()
        longest = abs(taken(best.change, model.layout.centres)).max() / model.gaussian.width
        share = _LONGEST / max(longest, _LONGEST)
        moved = model.layout.moved(state, share * best.change)
        state = replace(moved, kernel=model.waves.mix @ best.kernel)
        size = np.linalg.norm(best.root[: model.layout.count], axis=1)
        if np.all(abs(best.change) < _SETTLED * size):
            break
    widest = weighed[-1].posterior()
    return JointFit(model, state, noise, information, best, widest, likeliest.log_evidence)


@array_record
class Weighed:
    """Shapes of the common G, weighed where what is each sensor's own is integrated out."""

    log_evidence: float
    root: FloatArray  # (p, p): of the covariance of the parameters
    by_others: FloatArray  # (p, 1 + f): the parameters by data and kernels
    columns: FloatArray  # (r, 1 + f): data and kernels that are left
    mix: FloatArray
    weighing: Weighing

    def posterior(self) -> Posterior:
        """Average the shapes: all parameters and the kernel, and the root of their covariance."""
        weighed = self.weighing.average(allowing=0)
        basis = self.weighing.basis
        kernels = basis.kernels(self.weighing.reduced.model.k)
        # The parameters given a kernel: what they are without it, less what it explains of them.
        by_kernel = self.by_others[:, 1:] @ (self.mix @ kernels)
        both = np.vstack([-by_kernel, kernels])
        below = ((0, len(kernels)), (0, 0))
        kernel_gain = weighed.gain.dense() @ self.columns[:, 1:]
        return Posterior(
            change=self.by_others[:, 0] - by_kernel @ weighed.mean,
            kernel=basis.conversion_constant * kernels[:, 0] + kernels @ weighed.mean,
            root=np.hstack([np.pad(self.root, below), both @ square_root(weighed.covariance)]),
            gain=np.pad(self.by_others[:, 1:], below) + both @ kernel_gain,
        )


def weighed_by(
    model: JointModel, information: FloatArray, state: ArrayState, spread: float
) -> Weighed:
    """Integrate out what is each sensor's own by a prior, and weigh the shapes of the common G."""
    precision = prior_precision(model.layout, spread)
    values = parameters_of(model.layout, state)
    gram = information.copy()
    own = slice(1, 1 + model.layout.count)
    gram[own, own] += precision
    gram[own, 0] -= precision @ values
    gram[0, own] = gram[own, 0]
    gram[0, 0] += values @ precision @ values
    root = inverse_root(gram[own, own])
    others = np.delete(np.arange(len(gram)), own)
    by_others = root @ (root.T @ gram[own][:, others])
    left = gram[np.ix_(others, others)] - gram[own][:, others].T @ by_others
    columns = square_root(left).T
    synthesis = columns[:, 1:] @ model.waves.mix
    # Data and kernels that are left, in the place of a reduced scan about a Gaussian.
    reduced = ReducedScan(
        model.forward,
        model.gaussian,
        data=columns[:, 0],
        flat=synthesis @ model.gaussian_kernels,
        components=columns[:, :0],
        weights=np.ones(len(columns)),
        synthesis=synthesis,
        right=np.eye(len(columns)),
    )
    basis = departure_basis(model.gaussian, reduced)
    count = model.presses.keep.sum() - model.layout.count
    weighing = bayesian.weigh_departures(reduced, basis, count, least_noise=1.0)
    flat = np.diag(precision) == 0
    of_prior = np.linalg.slogdet(precision + np.diag(flat))[1] / 2
    evidence = float(weighing.evidence + of_prior + np.log(np.diag(root)).sum())
    return Weighed(evidence, root, by_others, columns, model.waves.mix, weighing)
