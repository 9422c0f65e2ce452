"""What a sensor of some dynamics reads in time, by linear systems of scipy."""

import numpy as np
from scipy.signal import TransferFunction, lsim

from memscal.model.arrays import FloatArray
from memscal.model.instrument import Dynamics


def systems(dynamics: Dynamics):
    """Yield the linear systems in time of which the dynamics are made."""
    if dynamics.low_pass:
        yield TransferFunction([1.0], [1 / (2 * np.pi * dynamics.low_pass), 1.0])
    if dynamics.resonance:
        w = 2 * np.pi * dynamics.resonance
        yield TransferFunction([w**2], [1.0, w / dynamics.quality, w**2])
    if dynamics.creep_share:
        g, tau = dynamics.creep_share, dynamics.creep_time
        whole = 1 - g * np.exp(-(dynamics.creep_record or np.inf) / tau)
        yield TransferFunction([(1 - g) * tau / whole, 1 / whole], [tau, 1.0])


def in_time(dynamics: Dynamics, u: FloatArray, dt: float) -> FloatArray:
    """Return what is read of ``u`` at times ``dt`` apart."""
    time = dt * np.arange(u.size)
    for system in systems(dynamics):
        u = lsim(system, u, time)[1]
    return u
