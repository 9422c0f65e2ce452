"""Synthetic line scans of contacts of a sphere, each pressed anew with a load of its own."""

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.errors import InputError
from memscal.extensions.simulation.disturbances import TYPICAL, Disturbances, Shear
from memscal.extensions.simulation.rod_scan import PAPER_FILM
from memscal.extensions.simulation.sensor import (
    Truth,
    blurred_stress,
    simulated_scan,
    simulated_sensor,
)
from memscal.friction.family import require_loads
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.mechanics.interface import Interface
from memscal.model.arrays import FloatArray, Values, floats, require_positive, require_range
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere
from memscal.model.scan import Scan

# Distance in ln P of the outer states from the middle one, in standard deviations of the load, and
# its smallest value: closer ones would show the solver's own error.
_SPREAD = 2.0
_LEAST_SPREAD = 0.02
#: The paper's sphere and its loads in N; the uncertainty of the radius is a plausible one.
PAPER_SPHERE = Sphere(radius=128.8e-3, radius_uncertainty=0.5e-3)
PAPER_LOADS = (0.34, 0.69, 1.37, 2.75)


def simulate_contacts(
    *,
    film: ElasticFilm = PAPER_FILM,
    sphere: Sphere = PAPER_SPHERE,
    kernel: RadialKernel | None = None,
    conversion_constant: float = 1e-7,
    shear: Shear = None,
    load: float | Sequence[float] = PAPER_LOADS,
    friction: float = 0.0,
    loading: str = "incremental",
    interface: Interface | None = None,
    points: int = 33,
    spacing: float = 0.5e-3,
    repeats: int = 1,
    disturbances: Disturbances = TYPICAL,
    load_scale: float = 1.0,
    lubrication: str = "dry",
    lubricant: str = "",
    seed: int = 0,
) -> Scan:
    """Simulate a line scan of contacts of a sphere; ``load_scale``: all true loads over stated."""
    loads = require_loads(load)
    _require_row(loads, points, spacing, repeats, seed)
    require_positive("load_scale", load_scale)
    sensor = simulated_sensor(kernel, conversion_constant, shear)
    law = {"friction": friction, "loading": loading, "interface": interface or Interface()}
    states, spread = _pressed(film, sphere, load_scale * loads, law, disturbances.load_scatter)

    x = np.linspace(-1.0, 1.0, points) * (0.5 * (points - 1) * spacing)
    row = np.repeat(np.arange(loads.size), repeats)
    # Standard normal numbers for each source of error, from streams of their own.
    noise, load_errors, position_errors, reading_errors = (
        np.random.default_rng(stream).standard_normal((row.size, points))
        for stream in np.random.SeedSequence(seed).spawn(4)
    )
    centre_x, centre_y = disturbances.centre
    # Repeats of a load are at the same places.
    offset = x + disturbances.position_error * position_errors[repeats * row] - centre_x
    distance = np.hypot(offset, centre_y)
    ratio = 1 + disturbances.load_scatter * load_errors

    def blurred(kernel: RadialKernel, order: int) -> FloatArray:
        rows = zip(row, distance, ratio, strict=True)
        return np.stack(
            [
                _at_load(blurred_stress(states[j], kernel, away, order=order), spread, over_nominal)
                for j, away, over_nominal in rows
            ]
        )

    middle = [contacts[len(contacts) // 2] for contacts in states]
    undisturbed = blurred_stress(middle, sensor.kernel, np.hypot(x - centre_x, centre_y))
    shape = x.shape if row.size == 1 else noise.shape
    stated = np.broadcast_to(loads[row, None], noise.shape)
    uncertainty = disturbances.load_scatter
    if disturbances.record_loads:
        uncertainty = disturbances.load_reading
        stated = stated * ratio * (1 + uncertainty * reading_errors)
    position_error = disturbances.position_error
    return simulated_scan(
        sensor,
        sensor.stresses(blurred, offset, distance),
        float(undisturbed.max()),
        noise.reshape(shape),
        disturbances,
        seed,
        x=x,
        loads=loads,
        truth=_truth(film, sphere, law, load_scale, loads, disturbances),
        x_errors=np.full(points, position_error) if position_error > 0 else None,
        normal_load=stated.reshape(shape),
        normal_load_errors=(uncertainty * stated).reshape(shape) if uncertainty > 0 else None,
        indenter=sphere,
        film=film,
        lubrication=lubrication,
        lubricant=lubricant,
        title=f"Synthetic sphere scan{', ' if lubrication else ''}{lubrication}",
    )


def _require_row(loads: FloatArray, points: int, spacing: float, repeats: int, seed: int) -> None:
    """Refuse a row of contacts that is none."""
    if np.unique(loads).size != loads.size:
        raise InputError(
            f"A load is given twice: {', '.join(f'{value:g}' for value in loads)} N.",
            cure="Give each load once, and the number of its repeats.",
        )
    require_range("spacing", spacing, 1e-9, 0.1, "m")
    if points < 2 or repeats < 1 or seed < 0:
        raise InputError(
            f"There are {points} contacts in a row and {repeats} rows at each load, from the seed "
            f"{seed}.",
            cure="Give two contacts and one row at least, and a seed that is not negative.",
        )


def _pressed(
    film: ElasticFilm, sphere: Sphere, loads: FloatArray, law: Values, scatter: float
) -> tuple[list[list[Contact]], float]:
    """Return one contact at each load (N), or three where loads scatter, and their step in ln P."""
    spread = max(_SPREAD * scatter, _LEAST_SPREAD) if scatter > 0 else 0.0
    around = np.exp(spread * np.arange(-1, 2)) if scatter > 0 else np.ones(1)
    path, place = np.unique(np.outer(loads, around), return_inverse=True)
    # Of an uncertain Poisson's ratio that ends at 1/2 the true one is the mean.
    solved = indent(film.expected, sphere, load=path, strain="linear", **law)
    rows = np.reshape(place, (loads.size, around.size))
    return [[solved[i] for i in row] for row in rows], spread


def _at_load(stresses: FloatArray, spread: float, ratio: FloatArray) -> FloatArray:
    """Return the stress at loads ``ratio`` over nominal, by the parabola in ln P through three."""
    if len(stresses) == 1:
        return floats(stresses[0])
    below, middle, above = stresses
    t = np.log(ratio)
    slope = (above - below) / (2 * spread)
    bend = (above - 2 * middle + below) / spread**2
    return floats(middle + slope * t + 0.5 * bend * t**2)


def described_film(film: ElasticFilm) -> dict[str, float]:
    """Return what of a true film decides over its base stress, by the names of a truth."""
    names = ("young_modulus", "poisson_ratio", "thickness")
    return {name: float(getattr(film.expected, name)) for name in names}


def _truth(
    film: ElasticFilm,
    sphere: Sphere,
    law: Values,
    load_scale: float,
    loads: FloatArray,
    disturbances: Disturbances,
) -> Truth:
    """Return what was pressed on what, where and how, by the names of a truth."""
    return {
        **described_film(film),
        "indenter_radius": sphere.radius,
        "friction": float(law["friction"]),
        "loading": law["loading"],
        **_described_interface(law["interface"]),
        "load_scale": float(load_scale),
        **{f"load_{j}": float(load_scale * load) for j, load in enumerate(loads, 1)},
        "load_scatter": disturbances.load_scatter,
        "position_error": disturbances.position_error,
        "centre": disturbances.centre[0],
        "centre_y": disturbances.centre[1],
    }


def _described_interface(interface: Interface) -> Truth:
    """Return what yields of the interface, by the names of a truth; nothing if it is rigid."""
    if interface.rigid:
        return {}
    described = {}
    if interface.slip_length > 0:
        described["slip_length"] = interface.slip_length
    if interface.normal_law is not None:
        described |= asdict(interface.normal_law)
    return described | {"interface": interface.description}
