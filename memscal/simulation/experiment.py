"""A whole synthetic experiment: a sensor's calibration, and what it then measures of contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.mechanics.interface import Interface
from memscal.model.arrays import require_non_negative, require_positive
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, Sphere
from memscal.model.scan import Scan
from memscal.parallel import single_threaded
from memscal.simulation.contact_scan import (
    PAPER_LOADS,
    PAPER_SPHERE,
    described_film,
    simulate_contacts,
)
from memscal.simulation.rod_scan import PAPER_FILM, PAPER_ROD, simulate, without_law


@dataclass(frozen=True, kw_only=True)
class Reality:
    """The true film and indenters; true loads of rod and sphere relative to the stated ones."""

    film: ElasticFilm
    rod: Rod
    sphere: Sphere
    rod_load_scale: float = 1.0
    load_scale: float = 1.0


def drawn(stated: Reality, load_uncertainty: float, seed: int) -> Reality:
    """Draw the true values from the stated ones, normal and independent, by their uncertainties."""
    rng = np.random.default_rng(seed)

    def around(value: float, uncertainty: float | None) -> float:
        # Drawn in any case: a source that is not stated moves no other.
        return value + (uncertainty or 0.0) * float(rng.standard_normal())

    film, rod, sphere = stated.film, stated.rod, stated.sphere
    modulus = around(film.young_modulus, film.young_modulus_uncertainty)
    # A Poisson's ratio above 0.5 is reflected at 0.5.
    ratio = 0.5 - abs(0.5 - around(film.poisson_ratio, film.poisson_ratio_uncertainty))
    thickness = around(film.thickness, film.thickness_uncertainty)
    return Reality(
        film=replace(film, young_modulus=modulus, poisson_ratio=ratio, thickness=thickness),
        rod=replace(rod, radius=around(rod.radius, rod.radius_uncertainty)),
        sphere=replace(sphere, radius=around(sphere.radius, sphere.radius_uncertainty)),
        rod_load_scale=around(1.0, load_uncertainty),
        load_scale=around(1.0, load_uncertainty),
    )


# The streams of random numbers, in an order that is a promise: a new one goes to the end.
_STREAMS = ("inputs", "rod", "dry", "lubricated")


@dataclass(frozen=True, eq=False)
class Experiment:
    """The scans of one synthetic experiment, with one sensor on one film.

    ``rod`` calibrates the sensor; ``dry`` and ``lubricated`` are scans of a sphere's contacts at
    several loads.
    """

    rod: Scan
    dry: Scan
    lubricated: Scan

    @property
    def scans(self) -> dict[str, Scan]:
        """The three scans by the names of their files, without a suffix."""
        return {"rod_scan": self.rod, "sphere_dry": self.dry, "sphere_lubricated": self.lubricated}


@single_threaded()
def simulate_experiment(
    *,
    film: ElasticFilm = PAPER_FILM,
    rod: Rod = PAPER_ROD,
    rod_friction: float | None = None,
    sphere: Sphere = PAPER_SPHERE,
    kernel: RadialKernel | None = None,
    conversion_constant: float = 1e-7,
    channels: Sequence[str] = ("zz",),
    shear_kernel: RadialKernel | None = None,
    shear_conversion_constant: float = 5e-8,
    rod_load: float = 1.0,
    rod_points: int = 65,
    rod_repeats: int = 1,
    loads: Sequence[float] = PAPER_LOADS,
    lubricated_loads: Sequence[float] = (0.69, 2.75),
    friction: float = 0.2,
    loading: str = "incremental",
    interface: Interface | None = None,
    lubricant: str = "glycerol",
    points: int = 33,
    spacing: float = 0.5e-3,
    repeats: int = 1,
    noise: float = 0.005,
    rod_noise: float | None = None,
    load_scatter: float = 0.02,
    record_loads: bool = False,
    load_reading: float = 0.002,
    load_uncertainty: float | None = 0.01,
    position_error: float = 10e-6,
    centre: tuple[float, float] = (0.14e-3, 0.0),
    baseline: float = 0.01,
    drift: float = 0.005,
    state_noise: bool = True,
    state_law: bool = True,
    draw_inputs: bool = False,
    gain: float = 1.0,
    thickness_factor: float = 1.0,
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
    channels, shear_kernel, shear_conversion_constant
        Whether ``u_xz`` is recorded, too, and its G and A, as of :func:`memscal.simulate`.
    rod_load, rod_points, rod_repeats : float, int, int
        Load of the rod in N, positions of its scan over 8 mm to both sides, and repeats.
    loads, lubricated_loads, lubricant
        Nominal loads of the sphere in N, dry and lubricated, and the lubricant's name.
    friction, loading, interface
        Law of the dry contacts, as of :func:`memscal.indent`.
    points, spacing, repeats : int, float, int
        Contacts in a row, their distance in m, and rows at each load.
    noise, rod_noise : float
        Standard deviation of each scan's noise, and of the rod scan's where it differs, as a
        share of the scan's largest signal.
    load_scatter, record_loads, load_reading, position_error
        Of each contact of the sphere: relative standard deviation of its load; whether that load
        is recorded in place of the nominal one, and the relative standard deviation of its
        reading; standard deviation of its position in m.
    load_uncertainty : float, optional
        Relative standard uncertainty of the common error of the rod's load, and of that of all
        loads of the sphere.
    centre, baseline, drift
        Position of the sensor in m; offset and its drift across each scan, as shares of the
        scan's largest signal.
    state_noise, state_law : bool
        Whether the scans state their noise, and the film's law with the rod's friction.
    draw_inputs : bool
        Draw the true values from the stated uncertainties: modulus, Poisson's ratio
        (reflected at 0.5) and thickness of the film, the radii, and the common errors of the
        rod's and of the sphere's loads, which are independent.  The files state the nominal
        values.
    gain, thickness_factor : float
        Mistakes: factor on the voltages of the sphere's scans only, and the film's true thickness
        relative to the stated one.
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
    require_positive("gain", gain)
    require_positive("thickness_factor", thickness_factor)
    require_non_negative("seed", seed)
    if load_uncertainty is not None:
        require_non_negative("relative standard uncertainty of the load", load_uncertainty)
    streams = np.random.SeedSequence(seed).spawn(len(_STREAMS))
    states = (int(stream.generate_state(1)[0]) for stream in streams)
    seeds = dict(zip(_STREAMS, states, strict=True))
    reality = Reality(film=film, rod=rod, sphere=sphere)
    if draw_inputs:
        reality = drawn(reality, load_uncertainty or 0.0, seeds["inputs"])
    thickness = thickness_factor * reality.film.thickness
    reality = replace(reality, film=replace(reality.film, thickness=thickness))
    shared: dict[str, Any] = {
        "film": reality.film,
        "kernel": kernel,
        "channels": channels,
        "shear_kernel": shear_kernel,
        "centre": centre,
        "baseline": baseline,
        "drift": drift,
        "state_noise": state_noise,
        "load_uncertainty": load_uncertainty,
    }
    contacts: dict[str, Any] = shared | {
        "sphere": reality.sphere,
        "conversion_constant": gain * conversion_constant,
        "shear_conversion_constant": gain * shear_conversion_constant,
        "loading": loading,
        "points": points,
        "spacing": spacing,
        "repeats": repeats,
        "noise": noise,
        "load_scatter": load_scatter,
        "record_loads": record_loads,
        "load_reading": load_reading,
        "load_scale": reality.load_scale,
        "position_error": position_error,
    }
    calibration = simulate(
        rod=reality.rod,
        rod_friction=rod_friction,
        state_law=state_law,
        conversion_constant=conversion_constant,
        shear_conversion_constant=shear_conversion_constant,
        load=reality.rod_load_scale * rod_load,
        points=rod_points,
        repeats=rod_repeats,
        noise=noise if rod_noise is None else rod_noise,
        seed=seeds["rod"],
        **shared,
    )
    dry = simulate_contacts(
        load=loads, friction=friction, interface=interface, seed=seeds["dry"], **contacts
    )
    lubricated = simulate_contacts(
        load=lubricated_loads,
        interface=Interface(normal=None if interface is None else interface.normal),
        lubrication="lubricated",
        lubricant=lubricant,
        seed=seeds["lubricated"],
        **contacts,
    )
    film = film if state_law else without_law(film)
    common = {"conversion_constant": conversion_constant, "gain": gain, "seed": float(seed)}
    if len(channels) > 1:
        common["conversion_constant_xz"] = shear_conversion_constant
    calibration = _with_load(calibration, rod_load, reality)
    return Experiment(
        rod=_as_stated(calibration, film, rod, common | {"gain": 1.0}),
        dry=_as_stated(dry, film, sphere, common),
        lubricated=_as_stated(lubricated, film, sphere, common),
    )


def _with_load(scan: Scan, load: float, reality: Reality) -> Scan:
    """Return the rod scan with its nominal load, and in its truth the true one."""
    spread = None if scan.load_uncertainty is None else scan.load_uncertainty * load / scan.load
    truth: dict[str, float | str] = {
        **(scan.synthetic or {}),
        **described_film(reality.film),
        "indenter_radius": reality.rod.radius,
        "load_scale": reality.rod_load_scale,
        "load_1": scan.load,
    }
    return replace(scan, load=load, load_uncertainty=spread, synthetic=truth)


def _as_stated(
    scan: Scan, film: ElasticFilm, indenter: Rod | Sphere, truth: Mapping[str, float | str]
) -> Scan:
    """Return the scan with film and indenter as the files state them."""
    synthetic = {**(scan.synthetic or {}), **truth}
    return replace(scan, film=film, indenter=indenter, synthetic=synthetic)
