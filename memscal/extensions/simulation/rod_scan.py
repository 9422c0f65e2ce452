"""Synthetic rod scans: the stress below a rod, read by a simulated sensor."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.errors import InputError
from memscal.extensions.simulation.disturbances import TYPICAL, Disturbances, Shear
from memscal.extensions.simulation.sensor import (
    SimulatedSensor,
    blurred_stress,
    simulated_scan,
    simulated_sensor,
)
from memscal.extensions.simulation.sensor_array import simulated_array
from memscal.friction.family import require_loads
from memscal.mechanics.contact import Contact
from memscal.mechanics.press_rod import press_rod
from memscal.model.arrays import Arrays, FloatArray, require_non_negative, require_range
from memscal.model.film import LINEAR, NEO_HOOKEAN, ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.scan import Scan
from memscal.parallel import single_threaded
from memscal.progress import reported

#: The paper's film, with its uncertainties where it gives them and modest ones elsewhere.
PAPER_FILM = ElasticFilm(
    young_modulus=2.2e6,
    poisson_ratio=0.5,
    thickness=2e-3,
    roughness_rms=1.82e-6,
    young_modulus_uncertainty=0.1e6,
    poisson_ratio_uncertainty=0.005,
    thickness_uncertainty=0.02e-3,
    roughness_rms_uncertainty=0.10e-6,
    law=NEO_HOOKEAN,
)
PAPER_ROD = Rod(radius=0.25e-3, radius_uncertainty=2.5e-6)
#: Where a scan of one sensor ends by default, in m, and its points.
_REACH = 8e-3
_POINTS = 65
#: Where one of an array ends by default, in thicknesses beyond its last sensors.
_BEYOND = 2.5


@reported
@single_threaded()
def simulate(
    *,
    film: ElasticFilm = PAPER_FILM,
    rod: Rod = PAPER_ROD,
    rod_friction: float | None = None,
    kernel: RadialKernel | None = None,
    conversion_constant: float = 1e-7,
    shear: Shear = None,
    load: float | Sequence[float] = 1.0,
    half_range: float | None = None,
    points: int | None = None,
    repeats: int = 1,
    raster: bool = False,
    array: tuple[int, int] | None = None,
    pitch: float = 2e-3,
    crosstalk: float = 0.0,
    disturbances: Disturbances = TYPICAL,
    seed: int = 0,
) -> Scan:
    """Simulate a rod scan through a known apparatus function.

    The base stress of the rod on the bonded film, by the film's law and at each load, is convolved
    with G exactly, by Hankel transforms; Gaussian noise, an offset and a linear drift are added.

    Parameters
    ----------
    film, rod
        What is pressed on what; the paper's where absent, its film neo-Hookean.  A film that states
        no law is taken as linear, and the scan states that.  Of an uncertain
        Poisson's ratio that ends at 1/2 the true one is the mean (``film.expected``).
    rod_friction : float, optional
        0: the film slides freely under the rod; ``inf``: it sticks.  By default a linear film
        slides, and one of another law sticks.
    kernel : RadialKernel, optional
        The apparatus function; the paper's Gaussian of 561 um where absent.  Besides
        :class:`memscal.GaussianMixture` and :class:`memscal.SmoothedDisc`, any object of unit
        integral with their ``transform``, ``radial`` and ``describe``.
    conversion_constant : float
        A, in V/Pa.
    shear : tuple of RadialKernel and float, optional
        G and A (V/Pa) of the tangential channel along x: adds ``u_xz``, with the same disturbances
        as shares of its own largest signal.  Not of an array.
    load : float or sequence of float
        Load in N; several loads give one repeat of the scan for each.
    half_range, points : float, int, optional
        Positions run from minus to plus ``half_range`` in m, ``points`` along each axis: 65 over
        8 mm to both sides by default, and of an array to 2.5 thicknesses h beyond its last sensors,
        in steps of h/8, or of h/4 in a raster.
    repeats, raster : int, bool
        Repeats at each load; whether to scan a square instead of a line, as several rows of
        sensors always are.
    array : tuple of int, optional
        Rows along y and columns along x of sensors under one film; their names are T01, T02 ...,
        row by row.  Their constants scatter by 5 %, their centres by 20 um about the layout,
        which is about ``centre``.
    pitch, crosstalk : float
        Of an array: distance of neighbours in m, and what a sensor reads of each neighbour's
        signal, as a share.
    disturbances : Disturbances
        Noise, offset, drift, position of the sensor, and what the scan states.  Shares are of the
        largest signal that the scan meets, at the (mean) load.
    seed : int
        Seed of the noise.

    Returns
    -------
    Scan
        With its truth in ``synthetic``.

    Raises
    ------
    InputError
        If a number is out of range, or the kernel is no apparatus function.

    Examples
    --------
    >>> scan = simulate(points=33, seed=2)
    >>> scan.u_zz.shape, scan.synthetic["gaussian_sigma"]
    ((33,), 0.000561)
    >>> several = simulate(array=(1, 3), crosstalk=0.01)
    >>> several.sensors, several.u_zz.shape
    (('T01', 'T02', 'T03'), (3, 57))
    """
    require_non_negative("seed", seed)
    several = None
    reach = _REACH
    count = _POINTS
    if array:
        several = simulated_array(array, pitch, crosstalk, disturbances.centre, seed)
        raster = raster or array[0] > 1
        reach = several.layout.max() + _BEYOND * film.thickness
        count = 2 * math.ceil(reach / film.thickness * (4 if raster else 8)) + 1
    half_range = reach if half_range is None else half_range
    points = count if points is None else points
    require_range("half_range", half_range, 1e-9, 1.0, "m")
    if points < 2 or repeats < 1:
        raise InputError("A scan needs two positions and one repeat at least.")
    sensor = simulated_sensor(kernel, conversion_constant, shear)
    loads = require_loads(load)
    if raster and loads.size * repeats > 1:
        raise InputError("A raster has one repeat at one load.", cure="Simulate several rasters.")
    film = replace(film, law=film.law or LINEAR)
    linear = film.law == LINEAR
    if rod_friction is None and not linear:
        rod_friction = math.inf
    # The stress in a linear film is proportional to the load: one contact serves for all.
    solved = loads.max(keepdims=True) if linear else loads
    contacts = [press_rod(film.expected, rod, value, rod_friction) for value in solved]

    x = np.linspace(-half_range, half_range, points)
    y = x if raster else np.zeros(1)
    factor = (loads / solved)[:, None, None]
    centres = several.centres if several else [disturbances.centre]
    every = [_stresses(sensor, contacts, factor, x, y, repeats, centre) for centre in centres]
    stresses = every[0]
    if several:
        stresses = {n: several.read(np.stack([each[n] for each in every])) for n in stresses}
    stress = stresses["zz"]
    row_loads = np.repeat(loads, repeats)
    row = stress.shape[-2:] if raster or row_loads.size > 1 else x.shape
    shape = (*stress.shape[:-2], *row)
    states_law = disturbances.state_law
    truth = _truth(disturbances.centre, film, rod_friction)
    if several:
        truth |= several.truth(conversion_constant)
    return simulated_scan(
        sensor,
        stresses,
        float(stress.max() if raster else stress.max(axis=-1).mean(axis=-1).max()),
        np.random.default_rng(seed).standard_normal(shape),
        disturbances,
        seed,
        x=x,
        loads=loads,
        truth={name: value for name, value in truth.items() if value is not None},
        y=y if raster else None,
        normal_load=np.broadcast_to(row_loads[:, None], row) if loads.size > 1 else None,
        indenter=rod,
        rod_friction=rod_friction if states_law else None,
        film=film if states_law else without_law(film),
        title="Synthetic rod scan",
        **(several.stated if several else {}),
    )


def _stresses(
    sensor: SimulatedSensor,
    contacts: Sequence[Contact],
    factor: FloatArray,
    x: FloatArray,
    y: FloatArray,
    repeats: int,
    centre: Sequence[float],
) -> Arrays:
    """Return what a sensor with a centre sees on a raster, or on repeats of a line."""
    offset = x - centre[0]
    distance = np.hypot.outer(y - centre[1], offset)

    def blurred(kernel: RadialKernel, order: int) -> FloatArray:
        stress = factor * blurred_stress(contacts, kernel, distance, order=order)
        return stress[0] if y.size > 1 else np.repeat(stress[:, 0], repeats, axis=0)

    return sensor.stresses(blurred, offset, distance)


def _truth(
    centre: tuple[float, float], film: ElasticFilm, rod_friction: float | None
) -> dict[str, float | str | None]:
    """Return what a scan was made with, as its truth states it."""
    return {
        "centre": centre[0],
        "centre_y": centre[1],
        "film_law": film.law,
        "poisson_ratio": film.expected.poisson_ratio,
        "mooney_rivlin_ratio": film.mooney_rivlin_ratio,
        "rod_friction": rod_friction,
    }


def without_law(film: ElasticFilm) -> ElasticFilm:
    """Return the film without a law, as a scan that does not state it has it."""
    return replace(film, law="", mooney_rivlin_ratio=None)
