"""Synthetic scans of a sphere's contacts through a known apparatus function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.errors import InputError
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.mechanics.interface import Interface
from memscal.model.arrays import FloatArray, require_non_negative, require_positive, require_range
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere
from memscal.model.scan import Scan, StressSensor
from memscal.simulation.rod_scan import PAPER_FILM, checked_loads
from memscal.simulation.sensor import (
    Disturbances,
    apparatus_function,
    blurred_stress,
    disturbance,
    shear_channel,
)

# Distance in ln P of the outer states from the middle one, in standard deviations of the load, and
# its smallest value: closer ones would show the solver's own error.
_SPREAD = 2.0
_LEAST_SPREAD = 0.02


@dataclass(frozen=True, eq=False)
class LoadPath:
    """Contacts at several nominal loads, with neighbours where their loads scatter."""

    states: Sequence[Sequence[Contact]]  # at each nominal load one contact, or three
    spread: float  # their distance in ln P

    def at_nominal(self, kernel: RadialKernel, radius: FloatArray) -> FloatArray:
        """Return the blurred stress at every nominal load, shape (loads, *radius.shape), in Pa."""
        return blurred_stress([state[len(state) // 2] for state in self.states], kernel, radius)

    def near(
        self,
        index: int,
        kernel: RadialKernel,
        radius: FloatArray,
        ratio: FloatArray,
        order: int = 0,  # one for the shear's radial component
    ) -> FloatArray:
        """Return the blurred stress (Pa) at ``radius`` (m); ``ratio``: load over nominal."""
        values = blurred_stress(self.states[index], kernel, radius, order=order)
        if len(values) == 1:
            return np.asarray(values[0])
        below, middle, above = values
        t = np.log(ratio)  # the stress is a parabola in it
        slope = (above - below) / (2 * self.spread)
        bend = (above - 2 * middle + below) / self.spread**2
        return np.asarray(middle + slope * t + 0.5 * bend * t**2)


def pressed_path(
    solve: Callable[[FloatArray], list[Contact]], loads: FloatArray, scatter: float
) -> LoadPath:
    """Solve the contacts at the loads (N) that scatter by a relative standard deviation."""
    spread = max(_SPREAD * scatter, _LEAST_SPREAD) if scatter > 0 else 0.0
    around = np.exp(spread * np.arange(-1, 2)) if scatter > 0 else np.ones(1)
    path, place = np.unique(np.multiply.outer(loads, around), return_inverse=True)
    solved = solve(path)
    rows = np.reshape(place, (loads.size, around.size))
    return LoadPath([[solved[i] for i in row] for row in rows], spread)


#: The paper's sphere and its loads in N; the uncertainty of the radius is a plausible one.
PAPER_SPHERE = Sphere(radius=128.8e-3, radius_uncertainty=0.5e-3)
PAPER_LOADS = (0.34, 0.69, 1.37, 2.75)

# Beyond this scatter of the loads a parabola in ln P is no longer good to 1e-3.
_MOST_SCATTER = 0.1


def simulate_contacts(
    *,
    film: ElasticFilm = PAPER_FILM,
    sphere: Sphere = PAPER_SPHERE,
    kernel: RadialKernel | None = None,
    conversion_constant: float = 1e-7,
    channels: Sequence[str] = ("zz",),
    shear_kernel: RadialKernel | None = None,
    shear_conversion_constant: float = 5e-8,
    load: float | Sequence[float] = PAPER_LOADS,
    friction: float = 0.0,
    loading: str = "incremental",
    interface: Interface | None = None,
    points: int = 33,
    spacing: float = 0.5e-3,
    repeats: int = 1,
    noise: float = 0.005,
    load_scatter: float = 0.02,
    record_loads: bool = False,
    load_reading: float = 0.002,
    load_scale: float = 1.0,
    load_uncertainty: float | None = 0.01,
    position_error: float = 10e-6,
    centre: tuple[float, float] = (0.14e-3, 0.0),
    baseline: float = 0.01,
    drift: float = 0.005,
    state_noise: bool = True,
    lubrication: str = "dry",
    lubricant: str = "",
    seed: int = 0,
) -> Scan:
    r"""Simulate a line scan of contacts of a sphere, each pressed anew at its place.

    The base stress of contact i of nominal load P, with its own load :math:`P_i` and at its own
    distance :math:`R_i` from the sensor, is convolved with G exactly:

    .. math:: U_i = A\,(G \otimes \sigma_{zz}^{P_i})(R_i) + b + d\,\xi_i + n_i

    with an offset b, a linear drift d and Gaussian noise :math:`n_i`.  The stress at each load is a
    parabola in ln P through solved contacts.  Arguments are those of
    :func:`memscal.simulate_experiment` for one scan; each nominal ``load`` gives ``repeats`` rows;
    ``load_scale``: all true loads over the stated ones.
    """
    loads = checked_loads(load)
    if np.unique(loads).size != loads.size:
        raise InputError(
            f"A load is given twice: {', '.join(f'{value:g}' for value in loads)} N.",
            cure="Give each load once, and the number of its repeats.",
        )
    require_range("spacing", spacing, 1e-9, 0.1, "m")
    require_non_negative("noise", noise)
    require_range("load_scatter", load_scatter, 0.0, _MOST_SCATTER)
    require_range("load_reading", load_reading, 0.0, _MOST_SCATTER)
    if points < 2 or repeats < 1 or seed < 0:
        raise InputError(
            f"There are {points} contacts in a row and {repeats} rows at each load, from the seed "
            f"{seed}.",
            cure="Give two contacts and one row at least, and a seed that is not negative.",
        )
    require_positive("conversion_constant", conversion_constant, "V/Pa")
    require_positive("load_scale", load_scale)
    require_non_negative("position_error", position_error)
    if not np.isfinite((*centre, baseline, drift)).all():
        raise InputError(
            f"The centre is {centre} m, the offset {baseline:g} and the drift {drift:g} of the "
            "largest signal; they must be finite."
        )
    interface, truth = interface or Interface(), apparatus_function(kernel)
    shear = shear_channel(channels, shear_kernel, shear_conversion_constant)
    law: dict[str, Any] = {"friction": friction, "loading": loading, "interface": interface}
    path = pressed_path(
        lambda at: indent(film, sphere, load=at, strain="linear", **law),
        load_scale * loads,
        load_scatter,
    )
    x = np.linspace(-1.0, 1.0, points) * (0.5 * (points - 1) * spacing)
    row = np.repeat(np.arange(loads.size), repeats)
    draws = _draw(row.size, points, seed)
    ratio = 1 + load_scatter * draws["load"]
    along = x + position_error * draws["position"] - centre[0]
    away = np.hypot(along, centre[1])
    nominal = path.at_nominal(truth, np.hypot(x - centre[0], centre[1]))
    largest = conversion_constant * float(nominal.max())
    signal = np.stack([path.near(int(j), truth, away[i], ratio[i]) for i, j in enumerate(row)])
    added = disturbance(x, baseline, drift) + noise * draws["noise"]
    u = conversion_constant * signal + largest * added
    stated = np.broadcast_to(loads[row, None], u.shape)
    unsure = load_scatter
    if record_loads:
        stated, unsure = stated * ratio * (1 + load_reading * draws["reading"]), load_reading
    shape = u.shape[1:] if len(u) == 1 else u.shape
    disturbed = Disturbances(noise, baseline, drift, state_noise, seed)
    channel_data: dict[str, FloatArray] = {}
    shear_truth: dict[str, float | str] = {}
    if shear is not None:
        blurred = [
            path.near(int(j), shear.kernel, away[i], ratio[i], order=1) for i, j in enumerate(row)
        ]
        sheared = np.stack(blurred) * shear.side(along, away)
        channel_data, shear_truth = shear.recorded(sheared.reshape(shape), x, disturbed)
    return Scan(
        x=x,
        u_zz=u.reshape(shape),
        u_zz_errors=disturbed.errors(shape, largest),
        x_errors=np.full(points, position_error) if position_error > 0 else None,
        normal_load=stated.reshape(shape),
        normal_load_errors=(unsure * stated).reshape(shape) if unsure > 0 else None,
        channels=channel_data,
        load=float(loads.mean()),
        load_uncertainty=None if load_uncertainty is None else load_uncertainty * loads.mean(),
        indenter=sphere,
        film=film,
        lubrication=lubrication,
        lubricant=lubricant,
        sensor=StressSensor(name="a simulated sensor", channel="zz"),
        title=f"Synthetic sphere scan{', ' if lubrication else ''}{lubrication}",
        notes="Synthetic data made by memscal simulate; nothing here was measured.",
        synthetic={
            **truth.describe(),
            "conversion_constant": conversion_constant,
            **described_film(film),
            "indenter_radius": sphere.radius,
            "friction": float(friction),
            "loading": loading,
            **_described(interface),
            "load_scale": float(load_scale),
            **{f"load_{j}": float(value) for j, value in enumerate(load_scale * loads, 1)},
            "load_scatter": load_scatter,
            "position_error": position_error,
            "centre": centre[0],
            "centre_y": centre[1],
            **disturbed.in_volts(largest),
            "seed": float(seed),
            **shear_truth,
        },
    )


def described_film(film: ElasticFilm) -> dict[str, float]:
    """Return what of a film decides over its base stress, by the names of a truth."""
    names = ("young_modulus", "poisson_ratio", "thickness")
    return {name: float(getattr(film, name)) for name in names}


def _draw(rows: int, points: int, seed: int) -> dict[str, FloatArray]:
    """Return standard normal numbers for each source of error, from streams of their own."""
    sources = ("noise", "load", "position", "reading")
    streams = np.random.SeedSequence(seed).spawn(len(sources))
    return {
        name: np.random.default_rng(stream).standard_normal((rows, points))
        for name, stream in zip(sources, streams, strict=True)
    }


def _described(interface: Interface) -> dict[str, float | str]:
    """Return the compliance of the interface, by the names of a truth; nothing if it is rigid."""
    law: dict[str, float | str] = {}
    if interface.slip_length > 0:
        law["slip_length"] = interface.slip_length
    if interface.normal_law is not None and interface.normal is not None:
        law |= {name: float(value) for name, value in asdict(interface.normal).items()}
    return law | ({"interface": interface.description} if law else {})
