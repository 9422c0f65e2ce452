"""Loads and reach of calculated families, and how far profiles are apart."""

import numpy as np

from memscal.friction.family import ProfileFamily
from memscal.model.arrays import FloatArray

LOADS = (0.34, 2.75)
REACH = 12e-3
RADII = np.linspace(0.0, 10e-3, 101)
#: Width of the paper's apparatus function, in m.
SIGMA = 0.56e-3


def profiles(family: ProfileFamily, spectra: FloatArray, *, blurred: bool) -> FloatArray:
    """Profiles of transforms, shape (n, K), at ``RADII``; shape (n, radii)."""
    k = family.wavenumbers.k
    passed = np.exp(-((k * SIGMA) ** 2) / 2) if blurred else np.ones_like(k)
    return np.asarray(family.wavenumbers.synthesise((spectra * passed).T, RADII).T)


def apart(family: ProfileFamily, found: FloatArray, truth: FloatArray) -> float:
    """Largest distance of profiles, blurred and bare, in units of the maximum of each."""
    worst = 0.0
    for blurred in (True, False):
        ours, theirs = (profiles(family, one, blurred=blurred) for one in (found, truth))
        distance = np.max(np.abs(ours - theirs), axis=1) / np.max(np.abs(theirs), axis=1)
        worst = max(worst, float(distance.max()))
    return worst
