r"""How a sensor follows readings that change: its low-pass, resonance and creep.

The transfer function of frequency :math:`f`, with the time dependence :math:`e^{2\pi i f t}`, is

.. math::

    H(f) = \frac{1}{1 + i f/f_c}\,\frac{1}{1 - (f/f_0)^2 + i f/(f_0 Q)}\,
    \frac{1 - g + g/(1 + 2\pi i f\tau)}{1 - g\,e^{-T/\tau}}

with the low-pass :math:`f_c`, the resonance :math:`f_0` of quality :math:`Q`, and creep of the
share :math:`g` in the time :math:`\tau`.  After a step it is one at the end of the dwell record of
length :math:`T`, for which A holds: beyond it nothing is known of creep.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from memscal.model.arrays import FloatArray
from memscal.model.instrument import Dynamics

#: So many of its longest times after a step a sensor has settled.
_SETTLED = 16.0


def transfer(dynamics: Dynamics, frequency: FloatArray) -> NDArray[np.complex128]:
    """Return H at frequencies in Hz, of any shape and sign."""
    response = np.ones_like(frequency, complex)
    if dynamics.low_pass:
        response /= 1 + 1j * frequency / dynamics.low_pass
    if dynamics.resonance and dynamics.quality:
        relative = frequency / dynamics.resonance
        response /= 1 - relative**2 + 1j * relative / dynamics.quality
    if dynamics.creep_share and dynamics.creep_time:
        share = dynamics.creep_share
        tau = dynamics.creep_time
        response *= 1 - share + share / (1 + 2j * math.pi * frequency * tau)
        response /= 1 - share * math.exp(-(dynamics.creep_record or math.inf) / tau)
    return response


def settling_time(dynamics: Dynamics) -> float:
    """Return the time in s after which nothing of a step is left."""
    times = [0.0, dynamics.creep_time or 0.0]
    if dynamics.low_pass:
        times.append(1 / (2 * math.pi * dynamics.low_pass))
    if dynamics.resonance and dynamics.quality:
        times.append(max(dynamics.quality, 1 / dynamics.quality) / (math.pi * dynamics.resonance))
    return _SETTLED * max(times)


#: What a sensor's dynamics may state an uncertainty of.
_UNCERTAIN = ("low_pass", "resonance", "quality", "creep_share", "creep_time")


def varied(dynamics: Dynamics | None) -> Iterator[tuple[str, Dynamics, Dynamics]]:
    """Yield each uncertain number, with the dynamics half its uncertainty above and below."""
    if dynamics is None:
        return
    for name in _UNCERTAIN:
        value = getattr(dynamics, name)
        u = getattr(dynamics, f"{name}_uncertainty")
        if value and u:
            more = replace(dynamics, **{name: value + u / 2})
            yield name, more, replace(dynamics, **{name: value - u / 2})
