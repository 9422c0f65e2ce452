"""Points as a sensor would read them without any error, whose errors are stated all the same."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from helpers import paper
from helpers.paper import LOADS, SPHERE

from memscal.extensions.interface_laws.families import (
    elasto_plastic_family,
    normal_compliance_family,
)
from memscal.friction import calculated
from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import Channel, LoadPoints, Sensor

MACROSCOPIC = 1.6
FILM = replace(
    paper.FILM,
    young_modulus_uncertainty=0.1e6,
    thickness_uncertainty=0.02e-3,
    poisson_ratio_uncertainty=0.005,
)
_REACH = 9e-3
_SIGMA = 561e-6


@dataclass(frozen=True)
class Precision:
    """Noise of a point over the load's largest signal, scatter of its load, and repeats."""

    noise: float
    scatter: float
    repeats: int = 3


PAPER = Precision(0.003, 0.02)
PRECISE = Precision(0.001, 0.002)


@lru_cache
def amontons() -> ProfileFamily:
    """Return contacts of a rigid interface along the friction coefficient."""
    return calculated.amontons_family(
        FILM,
        SPHERE,
        LOADS,
        reach=_REACH,
        friction=(0, 0.1, 0.2, 0.3, math.inf),
    )


@lru_cache
def slipping() -> ProfileFamily:
    """Return contacts along the slip length; short ones, which take long, are few."""
    lengths = (0.0, 2e-6, 4e-6, 8e-6, 1.6e-5, 5e-5, math.inf)
    return elasto_plastic_family(
        FILM, SPHERE, LOADS, friction=MACROSCOPIC, slip_lengths=lengths, reach=_REACH
    )


@lru_cache
def yielding() -> ProfileFamily:
    """Return contacts without friction along the length of a normal law."""
    lengths = (0.0, 2e-6, 4e-6)
    return normal_compliance_family(FILM, SPHERE, (0.69, 2.75), lengths=lengths, reach=_REACH)


def sensor(family: ProfileFamily) -> Sensor:
    """Return a Gaussian sensor of 1 V/Pa, A known to 1.2 % and the width of G to 0.5 %."""
    k = family.wavenumbers.k
    transfer = np.exp(-((k * _SIGMA) ** 2) / 2)
    changes = [0.012 * transfer, -0.005 * (k * _SIGMA) ** 2 * transfer]
    return Sensor(family.wavenumbers, transfer, np.stack(changes, axis=1), 1.0)


def read_without_error(truth: ProfileFamily, value: float, stated: Precision) -> list[LoadPoints]:
    """Return 33 points 0.5 mm apart at each load of a family, and their repeats, as calculated."""
    x = np.tile(np.linspace(-8e-3, 8e-3, 33), stated.repeats)
    ones = np.ones(x.size)
    transfer = sensor(truth).transfer
    voltages = [
        truth.wavenumbers.synthesise(transfer * spectrum, np.abs(x))
        for spectrum in truth.at(value).spectra[0]
    ]
    flat = np.stack([ones, np.linspace(-1, 1, x.size)], axis=1)
    errors = {"load_errors": stated.scatter * ones, "x_errors": 0 * ones, "load_share": 0.002}
    shared = {"offset": x, "log_load": 0 * ones, "flat": flat, **errors}
    return [LoadPoints(u, noise=stated.noise * u.max() * ones, **shared) for u in voltages]


def measured(points: Sequence[LoadPoints], family: ProfileFamily) -> Channel:
    """Return points with the contacts that are to explain them."""
    return Channel(points, sensor(family), family)
