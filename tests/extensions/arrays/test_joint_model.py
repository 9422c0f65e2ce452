"""Normal equations of an array against derivatives and covariances by brute force."""

from dataclasses import replace

import numpy as np
import pytest

from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.extensions.arrays.joint_model import ArrayState, JointModel, Layout, Noise
from memscal.extensions.arrays.presses import Presses, Waves

RNG = np.random.default_rng(0)
M = 4


def model(axes):
    """Three sensors and a dead one, a reading missing, errors of place and load."""
    t = 40
    places = 3e-3 * RNG.uniform(-1, 1, (2, t))
    keep = np.ones((M, t), bool)
    keep[1, 5] = False
    keep[3] = False
    presses = Presses(
        places=places,
        load=RNG.uniform(0.9, 1.1, t),
        u=RNG.normal(size=(M, t)) * keep,
        keep=keep,
        drift=np.stack([np.ones(t), places[0] / 3e-3], axis=1),
        axes=axes,
        place_errors=np.full(t, 10e-6),
        load_errors=np.full(t, 0.01),
        board=np.array([0, 0, 1, 1]),
    )
    wavenumbers = Wavenumbers.covering(1e4, 20e-3)
    k = wavenumbers.k
    reference = RadialSpectrum(wavenumbers, np.exp(-1e-3 * k))
    pairs = np.array([[0, 1, 0, 1], [1, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 0]], bool)
    own = np.stack([-1e-7 * (k * 5e-4) ** 2 * gaussian_transfer(k, 5e-4)], axis=1)
    scaled = np.array([True, False, True, False])
    layout = Layout.of(presses, scaled, pairs, pairs, 1)
    waves = Waves.of(reference, 10e-3)
    state = ArrayState(
        gain=np.array([0.9, 1.0, 1.1, 1.0]),
        centres=1e-3 * RNG.normal(size=(M, 2)),
        crosstalk=np.eye(M) + 0.02 * pairs,
        drift=1e-4 * RNG.normal(size=(M, 2)) * [[1], [1], [1], [0]],
        kernel=1e-7 * waves.mix @ gaussian_transfer(k, 5e-4),
        own=np.array([[0.0], [0.02], [-0.03], [0.0]]),
    )
    return JointModel(presses, waves, layout, own, None, None), state


@pytest.mark.parametrize("axes", [(0,), (0, 1)], ids=["line", "plane"])
def test_information_is_that_of_brute_force(axes):
    joint, state = model(axes)
    presses = joint.presses
    shared = np.zeros((M, M))
    shared[:2, :2] = 1e-8
    noise = Noise(np.array([1e-8, 2e-8, 3e-8, 1.0]), shared)
    data = RNG.normal(size=presses.u.shape) * presses.keep
    found = joint.information(state, noise, data)
    columns = [data]
    for i in range(joint.layout.count):
        step = np.zeros(joint.layout.count)
        step[i] = 1e-6 * (1e-3 if i in joint.layout.centres else 1.0)
        ends = [joint.predicted(joint.layout.moved(state, s * step)) for s in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2 * step[i]))
    for column in np.eye(len(joint.waves.mix)):
        added = replace(state, kernel=state.kernel + column)
        columns.append(joint.predicted(added) - joint.predicted(state))
    stacked = np.stack(columns, axis=2)
    moved = replace(state, centres=state.centres - [1e-8, 0])
    by_place = (joint.predicted(moved) - joint.predicted(state)) / 1e-8
    signal = joint.predicted(state) - state.drift @ presses.drift.T
    gram = np.zeros_like(found)
    for t in range(presses.load.size):
        covariance = noise.covariance + np.outer(by_place[:, t], by_place[:, t]) * 10e-6**2
        covariance += np.outer(signal[:, t], signal[:, t]) * 0.01**2
        kept = presses.keep[:, t]
        some = stacked[kept, t]
        gram += some.T @ np.linalg.inv(covariance[np.ix_(kept, kept)]) @ some
    scale = np.sqrt(np.diag(gram))
    assert np.allclose(found / np.outer(scale, scale), gram / np.outer(scale, scale), atol=2e-5)
