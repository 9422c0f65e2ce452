"""Conversion constants and shapes of an array from its joint fit, and their errors."""

from __future__ import annotations

import numpy as np

from memscal.extensions.arrays.array_data import ALL, KernelModes
from memscal.extensions.arrays.joint_fit import JointFit
from memscal.extensions.arrays.joint_model import taken
from memscal.model.arrays import FloatArray, array_record

#: Modes of the kernel of less than this share of the largest are nothing, and no more than so many.
_SMALLEST = 1e-3
_MOST_MODES = 12


@array_record
class ArrayNumbers:
    """Numbers of m sensors by a fit; columns are roots of covariances, or effects of inputs."""

    log_a: FloatArray  # (m,)
    of_a: FloatArray  # (m, c)
    kernels: FloatArray  # (1 or m, nodes): transforms of G
    changes: FloatArray  # (1 or m, nodes, c): of these before they are divided by their integrals
    of_total: FloatArray  # (1 or m, c): of the integrals, relative


def array_numbers(fit: JointFit, columns: FloatArray) -> ArrayNumbers:
    """Return the numbers of a fit, and of columns (p + nodes, c) their changes."""
    model = fit.model
    layout = model.layout
    wavenumbers = fit.reference.wavenumbers
    own = model.own_kernels @ fit.state.own.T
    # Of equal kernels one stands for all.
    shown = own if layout.own.size else own[:, :1]
    kernels = (fit.posterior.kernel[:, None] + shown).T
    changes = np.repeat(columns[None, layout.count :], len(kernels), axis=0)
    for j, places in enumerate(layout.own):
        changes[j % len(kernels)] += model.own_kernels @ taken(columns, places)
    total = wavenumbers.integrals(kernels.T)
    integrals = np.stack([wavenumbers.integrals(change) for change in changes])
    of_total = integrals / total[:, None]
    # In place: these are hundreds of megabytes of a large array of own shapes.
    changes /= total[:, None, None]
    return ArrayNumbers(
        np.log(fit.state.gain) + np.log(total),
        taken(columns, layout.gains) + of_total,
        kernels / total[:, None],
        changes,
        of_total,
    )


def kernel_modes(fit: JointFit, numbers: ArrayNumbers) -> tuple[KernelModes, FloatArray]:
    """Return what is open of the shapes of G as few modes, and their columns (modes, c)."""
    reference = fit.reference
    seen = np.sqrt(reference.wavenumbers.weights) * abs(reference.values)
    seen = seen / seen.max() + 1e-6
    changes = []
    owners = []
    sizes = []
    alike = len(numbers.kernels) == 1
    for j, kernel in enumerate(numbers.kernels):
        change = numbers.changes[j] - kernel[:, None] * numbers.of_total[j]
        left, size, right = np.linalg.svd(seen[:, None] * change, full_matrices=False)
        count = min(_MOST_MODES, int(np.sum(size > _SMALLEST * size[0])))
        changes.append((left[:, :count] / seen[:, None] * size[0]).T)
        sizes.append(size[:count, None] / size[0] * right[:count])
        owners += [ALL if alike else j] * count
    return KernelModes(np.vstack(changes), np.array(owners)), np.vstack(sizes)
