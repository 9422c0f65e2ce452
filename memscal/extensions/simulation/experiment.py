"""A whole synthetic experiment: a sensor's calibration, and what it then measures of contacts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.extensions.simulation.contact_scan import (
    PAPER_LOADS,
    PAPER_SPHERE,
    described_film,
    simulate_contacts,
)
from memscal.extensions.simulation.disturbances import TYPICAL, Disturbances, Shear
from memscal.extensions.simulation.rod_scan import PAPER_FILM, PAPER_ROD, simulate, without_law
from memscal.mechanics.indent import Loading
from memscal.mechanics.interface import Interface
from memscal.model.arrays import Values, array_record, keyword_value_record, require_non_negative
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, Sphere
from memscal.model.instrument import LoadCell
from memscal.model.scan import Scan
from memscal.parallel import single_threaded
from memscal.progress import reported


@keyword_value_record
class Reality:
    """The true film and indenters; true loads of rod and sphere relative to the stated ones."""

    film: ElasticFilm
    rod: Rod
    sphere: Sphere
    rod_load_scale: float = 1.0
    load_scale: float = 1.0


def drawn(stated: Reality, disturbances: Disturbances, seed: int) -> Reality:
    """Draw the true values from the stated ones, normal and independent, by their uncertainties."""
    rng = np.random.default_rng(seed)
    uncertainty = disturbances.load_uncertainty or 0.0

    def around(record: object, *names: str) -> Values:
        values = {}
        for name in names:
            # Drawn in any case: a source that is not stated moves no other.
            u = getattr(record, f"{name}_uncertainty") or 0.0
            values[name] = getattr(record, name) + u * rng.standard_normal()
        return values

    film = around(stated.film, "young_modulus", "poisson_ratio", "thickness")
    # A Poisson's ratio above 0.5 is reflected at 0.5.
    film["poisson_ratio"] = 0.5 - abs(0.5 - film["poisson_ratio"])
    rod = replace(stated.rod, **around(stated.rod, "radius"))
    sphere = replace(stated.sphere, **around(stated.sphere, "radius"))
    rod_load, load = (1.0 + uncertainty * rng.standard_normal() for _ in range(2))
    return Reality(
        film=replace(stated.film, **film, poisson_ratio_uncertainty=None),
        rod=rod,
        sphere=sphere,
        rod_load_scale=rod_load,
        load_scale=rod_load if disturbances.one_load_cell else load,
    )


@array_record
class Experiment:
    """The scans of one synthetic experiment, with one sensor on one film.

    ``rod`` calibrates the sensor; ``dry`` and ``lubricated`` are scans of a sphere's contacts at
    several loads.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(friction=0.1, loads=[0.69], lubricated_loads=[0.69])
    >>> made.rod.indenter.shape, made.dry.indenter.shape, made.lubricated.lubrication
    ('rod', 'sphere', 'lubricated')
    """

    rod: Scan
    dry: Scan
    lubricated: Scan

    @property
    def scans(self) -> dict[str, Scan]:
        """The three scans by the names of their files, without a suffix."""
        return {"rod_scan": self.rod, "sphere_dry": self.dry, "sphere_lubricated": self.lubricated}


@reported
@single_threaded()
def simulate_experiment(
    *,
    film: ElasticFilm = PAPER_FILM,
    rod: Rod = PAPER_ROD,
    rod_friction: float | None = None,
    sphere: Sphere = PAPER_SPHERE,
    kernel: RadialKernel | None = None,
    conversion_constant: float = 1e-7,
    shear: Shear = None,
    rod_load: float = 1.0,
    rod_points: int = 65,
    rod_repeats: int = 1,
    loads: Sequence[float] = PAPER_LOADS,
    lubricated_loads: Sequence[float] = (0.69, 2.75),
    friction: float = 0.2,
    loading: Loading = "incremental",
    interface: Interface | None = None,
    points: int = 33,
    spacing: float = 0.5e-3,
    repeats: int = 1,
    disturbances: Disturbances = TYPICAL,
    seed: int = 0,
) -> Experiment:
    r"""Simulate an experiment: a rod scan, and contacts of a sphere, dry and lubricated.

    All scans are made with one sensor on one film.  The dry contacts obey the law that is asked
    for; the lubricated ones slide freely, :math:`\mu = 0`, over an interface of the same normal
    compliance.

    Parameters
    ----------
    film, rod, sphere
        What is pressed on what, as the files state it; the paper's where absent.  The film's law is
        that under the rod; the sphere's contacts, which sink by 2 %, are solved linearly.
    rod_friction
        Friction of the rod, as of :func:`memscal.simulate`.
    kernel : RadialKernel, optional
        The apparatus function G; the paper's Gaussian of 561 um where absent.
    conversion_constant : float
        A, in V/Pa.
    shear : tuple of RadialKernel and float, optional
        G and A (V/Pa) of the tangential channel ``u_xz``, as of :func:`memscal.simulate`.
    rod_load, rod_points, rod_repeats : float, int, int
        Load of the rod in N, positions of its scan over 8 mm to both sides, and repeats.
    loads, lubricated_loads
        Nominal loads of the sphere in N, dry and lubricated.
    friction, loading, interface
        Law of the dry contacts, as of :func:`memscal.indent`.
    points, spacing, repeats : int, float, int
        Contacts in a row, their distance in m, and rows at each load.
    disturbances : Disturbances
        Noise, offset and drift, scatter and errors of loads and positions, deliberate mistakes,
        and what the scans state.
    seed : int
        What is drawn and each scan have streams of random numbers of their own.

    Returns
    -------
    Experiment
        Each scan with its truth in ``synthetic``.

    Raises
    ------
    InputError
        If a number is out of range, or the kernel is no apparatus function.
    DomainError
        If a load is out of the contact model's range.

    Examples
    --------
    >>> experiment = simulate_experiment(friction=0.1, loads=[0.69], lubricated_loads=[0.69])
    >>> experiment.dry.synthetic["friction"], experiment.lubricated.synthetic["friction"]
    (0.1, 0.0)
    """
    require_non_negative("seed", seed)
    # The order of the streams of random numbers is a promise: a new one goes to the end.
    inputs_seed, rod_seed, dry_seed, lubricated_seed = (
        int(stream.generate_state(1)[0]) for stream in np.random.SeedSequence(seed).spawn(4)
    )
    true = _true(Reality(film=film, rod=rod, sphere=sphere), disturbances, inputs_seed)
    calibration = simulate(
        film=true.film,
        rod=true.rod,
        rod_friction=rod_friction,
        kernel=kernel,
        conversion_constant=conversion_constant,
        shear=shear,
        load=true.rod_load_scale * rod_load,
        points=rod_points,
        repeats=rod_repeats,
        disturbances=disturbances,
        seed=rod_seed,
    )
    gain = disturbances.gain
    contacts = partial(
        simulate_contacts,
        film=true.film,
        sphere=true.sphere,
        kernel=kernel,
        conversion_constant=gain * conversion_constant,
        shear=None if shear is None else (shear[0], gain * shear[1]),
        loading=loading,
        points=points,
        spacing=spacing,
        repeats=repeats,
        disturbances=disturbances,
        load_scale=true.load_scale,
    )
    dry = contacts(load=loads, friction=friction, interface=interface, seed=dry_seed)
    lubricated = contacts(
        load=lubricated_loads,
        interface=Interface(normal=None if interface is None else interface.normal),
        lubrication="lubricated",
        lubricant="glycerol",
        seed=lubricated_seed,
    )
    truth = {"conversion_constant": conversion_constant, "gain": gain, "seed": float(seed)}
    if shear is not None:
        truth["conversion_constant_xz"] = shear[1]
    scale = true.rod_load_scale
    of_rod = {"indenter_radius": true.rod.radius, "load_scale": scale, "load_1": scale * rod_load}
    rod_truth = {**described_film(true.film), **of_rod, **truth, "gain": 1.0}
    u = disturbances.load_uncertainty
    nominal = replace(calibration, load=rod_load, load_uncertainty=u and u * rod_load)
    cell = LoadCell(name="a simulated load cell" if disturbances.one_load_cell else "")
    stated = {"film": film if disturbances.state_law else without_law(film), "load_cell": cell}
    return Experiment(
        rod=_as_stated(nominal, rod_truth, indenter=rod, **stated),
        dry=_as_stated(dry, truth, indenter=sphere, **stated),
        lubricated=_as_stated(lubricated, truth, indenter=sphere, **stated),
    )


def _true(stated: Reality, disturbances: Disturbances, seed: int) -> Reality:
    """Return the true film, indenters and loads: drawn if asked for, the film as thick as it is."""
    true = drawn(stated, disturbances, seed) if disturbances.draw_inputs else stated
    thickness = disturbances.thickness_factor * true.film.thickness
    return replace(true, film=replace(true.film, thickness=thickness))


def _as_stated(scan: Scan, truth: Mapping[str, float], **stated: Any) -> Scan:
    return replace(scan, synthetic={**(scan.synthetic or {}), **truth}, **stated)
