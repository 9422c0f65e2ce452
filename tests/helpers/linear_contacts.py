"""Contacts of closed form and voltages drawn from the likelihood's own model: cheap experiments."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.linalg import toeplitz

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.friction.effective import FrictionFit, fit_friction
from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import Channel, LoadPoints, Predicted, Sensor, predict

LOADS = (0.5, 2.0)
FRICTIONS = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 1.0, np.inf])
NODES = Wavenumbers.covering(8e3, 24e-3)
CONVERSION = 1e-7
_POSITIONS = np.linspace(-8e-3, 8e-3, 33)


def gaussian_family() -> ProfileFamily:
    """Gaussian stresses that narrow with friction and widen with the load; thickness uncertain."""
    load = np.array(LOADS)
    narrower = 0.1 * (1 - np.exp(-FRICTIONS / 0.12))
    variance = (1.3e-3 * (1 - narrower[:, None]) * load ** (1 / 6)) ** 2
    k2 = NODES.k**2
    spectra = load[:, None] * np.exp(-0.5 * variance[..., None] * k2)
    table = variance.shape
    return ProfileFamily(
        name="amontons",
        loading="incremental",
        wavenumbers=NODES,
        loads=load,
        values=FRICTIONS,
        scale=0.3,
        spectra=spectra,
        by_load=spectra * (1 - variance[..., None] * k2 / 6),
        changes={"thickness": -0.01 * variance[..., None] * k2 * spectra},
        depths=np.full(table, np.nan),
        contact_radii=np.full(table, np.nan),
        convergence=np.full(table, 1e-4),
    )


def gaussian_sensor() -> Sensor:
    """A Gaussian G of 0.56 mm; A uncertain by 1 %, the width by 2 %."""
    g = np.exp(-0.5 * (0.56e-3 * NODES.k) ** 2)
    changes = CONVERSION * np.stack([0.01 * g, -0.02 * (0.56e-3 * NODES.k) ** 2 * g], axis=1)
    return Sensor(NODES, CONVERSION * g, changes, CONVERSION)


def bare_points(*, correlation=0.0, repeats=1) -> LoadPoints:
    """Points of a load whose voltages are still to be drawn."""
    x = np.tile(_POSITIONS, repeats)
    return LoadPoints(
        u=np.zeros(x.size),
        offset=x,
        log_load=np.zeros(x.size),
        noise=np.full(x.size, 3e-5),
        load_errors=np.full(x.size, 0.02),
        x_errors=np.full(x.size, 10e-6),
        flat=np.stack([np.ones(x.size), x / x.max()], axis=1),
        load_share=0.01,
        correlation=toeplitz(correlation ** np.arange(x.size)) if correlation else None,
        places=np.tile(np.eye(_POSITIONS.size), (repeats, 1)) if repeats > 1 else None,
    )


@dataclass(frozen=True)
class Laboratory:
    """A family, a sensor, and points whose voltages are drawn at any friction coefficient."""

    family: ProfileFamily
    sensor: Sensor
    points: tuple[LoadPoints, ...]

    @classmethod
    def of(cls, *, points: LoadPoints | None = None) -> Self:
        family = gaussian_family()
        every = bare_points() if points is None else points
        return cls(family, gaussian_sensor(), (every,) * family.loads.size)

    def predicted(self, friction: float, load: int, points: LoadPoints | None = None) -> Predicted:
        return predict(points or self.points[load], self.sensor, self.family.at(friction), load)

    def drawn(self, friction: float, seed: int) -> FrictionFit:
        """Draw everything that the likelihood counts, and hold it against the family."""
        return fit_friction(self.channel(self.measured(friction, seed)))

    def channel(self, points: Sequence[LoadPoints]) -> Channel:
        """Points of each load with the family and the sensor."""
        return Channel(points, self.sensor, self.family)

    def measured(self, friction: float, seed: int, *, systematic=True) -> list[LoadPoints]:
        """Draw the voltages of every load."""
        rng = np.random.default_rng(seed)
        common = {}
        measured = []
        for load, points in enumerate(self.points):
            found = self.predicted(friction, load)
            u = found.signal[0] + noise_of(points, found, rng)
            for source, column in found.columns.items():
                if not column.any():
                    continue
                if source not in common:
                    common[source] = rng.standard_normal(column.shape[-1]) * systematic
                u = u + column[0] @ common[source]
            u = u + points.flat @ rng.normal(0.0, 1e-3, 2)
            u = u + found.slope[0] * -np.sign(points.offset) * rng.normal(0.0, 10e-6)
            measured.append(replace(points, u=u))
        return measured


def noise_of(points: LoadPoints, found: Predicted, rng: np.random.Generator) -> np.ndarray:
    white = rng.standard_normal(points.u.size)
    if points.correlation is not None:
        white = np.linalg.cholesky(points.correlation) @ white
    scatter = found.by_load[0] * points.load_errors * rng.standard_normal(points.u.size)
    errors = rng.standard_normal(points.u.size)
    if points.places is not None:
        errors = errors[points.places.argmax(axis=1)]
    moved = found.slope[0] * points.x_errors * errors
    return np.asarray(points.noise * white + scatter + moved)
