r"""What uncertain inputs do to a calibration: film, rod, load, positions, and the model itself.

If an input is larger by one standard uncertainty than was taken, the estimate is wrong as if the
voltages had been: by :math:`-A\,G\otimes\delta\sigma_{zz}` for a change of the base stress, by
:math:`-U'(R)\,\delta R` for one of the positions.  A change of the load scales A alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum, hankel_transform
from memscal.errors import InputError
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.reference import carried_force, film_sensitivities, rod_sensitivities
from memscal.mechanics.contact import Contact
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile

__all__ = ["InputEffect", "correlation_matrix", "input_effects"]

#: Two models differ by a bound, anywhere within which the truth may lie: a rectangle.
_RECTANGLE = 1 / np.sqrt(3)


@dataclass(frozen=True, eq=False)
class InputEffect:
    """What one standard uncertainty of an input does.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Change of the voltages that it would be mistaken for, in V.
    scaling : float
        Relative change of A beside that.
    """

    voltage: FloatArray
    scaling: float = 0.0


def input_effects(
    scans: Sequence[Scan],
    stresses: Sequence[StressProfile | Contact],
    estimate: ProfileEstimate,
    alternatives: Sequence[RadialSpectrum] | None = None,
) -> Mapping[str, InputEffect]:
    """Return the effect of every input whose uncertainty is stated, by its name.

    Scans that share a film, or a rod, share its error; the load is read from one balance, and
    the positions from one stage.

    Parameters
    ----------
    scans, stresses
        The scans and their references.
    estimate : ProfileEstimate
        Their estimate.
    alternatives : sequence of RadialSpectrum, optional
        References of another model of the film, such as finite strain: their difference is the
        bound of a rectangular distribution, the source ``model_form``.
    """
    model = estimate.model
    changes: dict[str, list[FloatArray]] = {}
    shared = [("film", film_sensitivities), ("indenter", rod_sensitivities)]
    for attribute, sensitivities in shared:
        owners = [getattr(scan, attribute) for scan in scans]
        distinct = list(dict.fromkeys(owners))
        for i, (scan, owner) in enumerate(zip(scans, owners, strict=True)):
            number = distinct.index(owner)
            suffix = "" if number == 0 else f"_{number + 1}"
            for source, change in sensitivities(scan, model.references[i]).items():
                blank = [np.zeros_like(change) for _ in scans]
                changes.setdefault(source + suffix, blank)[i] = change
    for i, stress in enumerate(stresses):
        # What is stated of the normal stress says nothing of the shear.
        if model.order or not isinstance(stress, StressProfile):
            continue
        if stress.sigma_zz_errors is not None:
            errors = hankel_transform(stress.r, stress.sigma_zz_errors, model.k) / stress.load
            blank = [np.zeros_like(errors) for _ in scans]
            changes.setdefault("reference_stress", blank)[i] = errors
    if alternatives is not None:
        pairs = zip(alternatives, model.references, strict=True)
        changes["model_form"] = [_RECTANGLE * (a.values - ours.values) for a, ours in pairs]
    effects = {source: _of_reference(estimate, change) for source, change in changes.items()}
    return effects | _of_positions(scans, estimate) | _of_loads(scans, stresses, estimate)


def _of_reference(estimate: ProfileEstimate, changes: Sequence[FloatArray]) -> InputEffect:
    spectra = (
        replace(reference, values=change)
        for reference, change in zip(estimate.model.references, changes, strict=True)
    )
    changed = replace(estimate.model, references=tuple(spectra))
    return InputEffect(-changed.signal(estimate.gaussian.geometry, estimate.kernel))


def _of_positions(scans: Sequence[Scan], estimate: ProfileEstimate) -> dict[str, InputEffect]:
    shares = np.array([scan.position_scale_uncertainty or 0.0 for scan in scans])
    if not shares.any():
        return {}
    slope = estimate.model.radial_derivative(estimate.gaussian.geometry, estimate.kernel)
    wrong = slope * estimate.distance * shares[estimate.points.scan]
    return {"position_scale": InputEffect(-wrong)}


def _of_loads(
    scans: Sequence[Scan], stresses: Sequence[StressProfile | Contact], estimate: ProfileEstimate
) -> dict[str, InputEffect]:
    """What is wrong by a factor: loads, forces of references, and their discretisation."""
    model = estimate.model
    signal = estimate.predicted - estimate.background
    shares: dict[str, Sequence[float | None]] = {
        "reference_force": [
            abs(carried_force(stress, reference) - 1.0)
            for stress, reference in zip(stresses, model.references, strict=True)
        ],
        "load": [
            None if scan.load_uncertainty is None else scan.load_uncertainty / scan.load
            for scan in scans
        ],
        "reference_convergence": [stress.convergence for stress in stresses],
    }
    effects = {}
    for source, stated in shares.items():
        if all(share is None for share in stated):
            continue
        each = np.array([share or 0.0 for share in stated])
        common = float(each.mean())
        apart = (each - common)[estimate.points.scan]
        effects[source] = InputEffect(-apart * signal, -common)
    return effects


def correlation_matrix(
    sources: Sequence[str], correlations: Mapping[tuple[str, str], float]
) -> FloatArray:
    """Return the correlation matrix of inputs, the identity but for the stated pairs.

    Raises
    ------
    InputError
        If a pair names an input whose uncertainty is not stated, a coefficient lies outside
        -1 to 1, or the pairs contradict each other.
    """
    matrix = np.eye(len(sources))
    for pair, coefficient in correlations.items():
        unknown = [name for name in pair if name not in sources]
        if unknown or len(set(pair)) != 2:
            raise InputError(
                f"A correlation is given for {' and '.join(map(repr, pair))}.",
                why="It must be between two inputs whose uncertainty is stated.",
                cure=f"Choose from {', '.join(sources) or 'none'}.",
            )
        if not -1 <= coefficient <= 1:
            raise InputError(
                f"The correlation of {pair[0]} and {pair[1]} is {coefficient:g}, outside -1 to 1."
            )
        i, j = (sources.index(name) for name in pair)
        matrix[i, j] = matrix[j, i] = coefficient
    least = float(np.linalg.eigvalsh(matrix)[0]) if sources else 1.0
    if least < -1e-9:
        raise InputError(
            f"The correlations of the inputs contradict each other: their matrix has the "
            f"eigenvalue {least:.3g}.",
            why="A covariance is positive semi-definite.",
            cure="Two inputs that both follow a third closely cannot be opposed.",
        )
    return matrix
