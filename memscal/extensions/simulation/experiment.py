"""A whole synthetic experiment: a sensor's calibration, and what it then measures of contacts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.errors import InputError
from memscal.extensions.simulation import rod_scan
from memscal.extensions.simulation.rod_scan import (
    PAPER_FILM,
    PAPER_ROD,
    checked_loads,
    simulate,
    without_law,
)
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.mechanics.interface import Interface
from memscal.model.arrays import FloatArray, require_non_negative, require_positive, require_range
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, Sphere
from memscal.model.instrument import LoadCell, StressSensor
from memscal.model.scan import Scan
from memscal.parallel import single_threaded

# Distance in ln P of the outer states from the middle one, in standard deviations of the load, and
# its smallest value: closer ones would show the solver's own error.
_SPREAD = 2.0
_LEAST_SPREAD = 0.02
# Beyond this scatter of the loads a parabola in ln P is no longer good to 1e-3.
_MOST_SCATTER = 0.1


def _pressed(
    solve: Callable[[FloatArray], list[Contact]], loads: FloatArray, scatter: float
) -> tuple[list[list[Contact]], float]:
    """Return one contact at each load (N), or three where loads scatter, and their step in ln P."""
    spread = max(_SPREAD * scatter, _LEAST_SPREAD) if scatter > 0 else 0.0
    around = np.exp(spread * np.arange(-1, 2)) if scatter > 0 else np.ones(1)
    path, place = np.unique(np.multiply.outer(loads, around), return_inverse=True)
    solved = solve(path)
    rows = np.reshape(place, (loads.size, around.size))
    return [[solved[i] for i in row] for row in rows], spread


def _at_load(stresses: FloatArray, spread: float, ratio: FloatArray) -> FloatArray:
    """Return the stress at loads ``ratio`` over nominal, by the parabola in ln P through three."""
    if len(stresses) == 1:
        return np.asarray(stresses[0])
    below, middle, above = stresses
    t = np.log(ratio)
    slope = (above - below) / (2 * spread)
    bend = (above - 2 * middle + below) / spread**2
    return np.asarray(middle + slope * t + 0.5 * bend * t**2)


#: The paper's sphere and its loads in N; the uncertainty of the radius is a plausible one.
PAPER_SPHERE = Sphere(radius=128.8e-3, radius_uncertainty=0.5e-3)
PAPER_LOADS = (0.34, 0.69, 1.37, 2.75)


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
    """Simulate a line scan of contacts of a sphere, each pressed anew with a load of its own."""
    # Arguments are those of simulate_experiment; load_scale: all true loads over the stated ones.
    # Of an uncertain Poisson's ratio that ends at 1/2 the true one is the mean.
    loads = checked_loads(load)
    if np.unique(loads).size != loads.size:
        problem = f"A load is given twice: {', '.join(f'{value:g}' for value in loads)} N."
        raise InputError(problem, cure="Give each load once, and the number of its repeats.")
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
    interface = interface or Interface()
    truth = rod_scan.apparatus_function(kernel)
    shear = rod_scan.shear_channel(channels, shear_kernel, shear_conversion_constant)
    law: dict[str, Any] = {"friction": friction, "loading": loading, "interface": interface}
    states, spread = _pressed(
        lambda at: indent(film.expected, sphere, load=at, strain="linear", **law),
        load_scale * loads,
        load_scatter,
    )
    x = np.linspace(-1.0, 1.0, points) * (0.5 * (points - 1) * spacing)
    row = np.repeat(np.arange(loads.size), repeats)
    # Standard normal numbers for each source of error, from streams of their own.
    streams = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(4))
    of_noise, of_load, of_position, of_reading = (
        stream.standard_normal((row.size, points)) for stream in streams
    )
    ratio = 1 + load_scatter * of_load
    along = x + position_error * of_position - centre[0]
    away = np.hypot(along, centre[1])

    def blurred(kernel: RadialKernel, order: int = 0) -> FloatArray:
        of_rows = []
        for j, distance, of_nominal in zip(row, away, ratio, strict=True):
            stresses = rod_scan.blurred_stress(states[j], kernel, distance, order=order)
            of_rows.append(_at_load(stresses, spread, of_nominal))
        return np.stack(of_rows)

    at_nominal = [state[len(state) // 2] for state in states]
    nominal = rod_scan.blurred_stress(at_nominal, truth, np.hypot(x - centre[0], centre[1]))
    largest = conversion_constant * float(nominal.max())
    added = rod_scan.disturbance(x, baseline, drift) + noise * of_noise
    u = conversion_constant * blurred(truth) + largest * added
    stated = np.broadcast_to(loads[row, None], u.shape)
    unsure = load_scatter
    if record_loads:
        stated = stated * ratio * (1 + load_reading * of_reading)
        unsure = load_reading
    shape = u.shape[1:] if len(u) == 1 else u.shape
    disturbed = rod_scan.Disturbances(noise, baseline, drift, state_noise, seed)
    offset = along, away
    sheared, shear_truth = rod_scan.recorded_shear(shear, blurred, x, offset, shape, disturbed)
    return Scan(
        x=x,
        u_zz=u.reshape(shape),
        u_zz_errors=disturbed.errors(shape, largest),
        x_errors=np.full(points, position_error) if position_error > 0 else None,
        normal_load=stated.reshape(shape),
        normal_load_errors=(unsure * stated).reshape(shape) if unsure > 0 else None,
        channels=sheared,
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
            **_described_film(film),
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


def _described_film(film: ElasticFilm) -> dict[str, float]:
    """Return what of a true film decides over its base stress, by the names of a truth."""
    names = ("young_modulus", "poisson_ratio", "thickness")
    return {name: float(getattr(film.expected, name)) for name in names}


def _described(interface: Interface) -> dict[str, float | str]:
    """Return the compliance of the interface, by the names of a truth; nothing if it is rigid."""
    law: dict[str, float | str] = {}
    if interface.slip_length > 0:
        law["slip_length"] = interface.slip_length
    if interface.normal_law is not None and interface.normal is not None:
        law |= {name: float(value) for name, value in asdict(interface.normal).items()}
    return law | ({"interface": interface.description} if law else {})


@dataclass(frozen=True, kw_only=True)
class Reality:
    """The true film and indenters; true loads of rod and sphere relative to the stated ones."""

    film: ElasticFilm
    rod: Rod
    sphere: Sphere
    rod_load_scale: float = 1.0
    load_scale: float = 1.0


def drawn(
    stated: Reality, load_uncertainty: float, seed: int, *, one_load_cell: bool = False
) -> Reality:
    """Draw the true values from the stated ones, normal and independent, by their uncertainties."""
    rng = np.random.default_rng(seed)

    def around(value: float, uncertainty: float | None) -> float:
        # Drawn in any case: a source that is not stated moves no other.
        return value + (uncertainty or 0.0) * float(rng.standard_normal())

    film = stated.film
    rod = stated.rod
    sphere = stated.sphere
    modulus = around(film.young_modulus, film.young_modulus_uncertainty)
    # A Poisson's ratio above 0.5 is reflected at 0.5.
    ratio = 0.5 - abs(0.5 - around(film.poisson_ratio, film.poisson_ratio_uncertainty))
    thickness = around(film.thickness, film.thickness_uncertainty)
    return Reality(
        film=replace(
            film,
            young_modulus=modulus,
            poisson_ratio=ratio,
            thickness=thickness,
            poisson_ratio_uncertainty=None,
        ),
        rod=replace(rod, radius=around(rod.radius, rod.radius_uncertainty)),
        sphere=replace(sphere, radius=around(sphere.radius, sphere.radius_uncertainty)),
        rod_load_scale=(of_rod := around(1.0, load_uncertainty)),
        load_scale=of_rod if one_load_cell else around(1.0, load_uncertainty),
    )


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
    one_load_cell: bool = False,
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
        rod's and of the sphere's loads.  The files state the nominal values.  Without it, the true
        values are those, and the mean of a Poisson's ratio.
    one_load_cell : bool
        Whether the loads of rod and sphere have one common error, and all scans name its load
        cell; else the two errors are independent.
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
    require_non_negative("relative standard uncertainty of the load", load_uncertainty)
    # The order of the streams of random numbers is a promise: a new one goes to the end.
    inputs_seed, rod_seed, dry_seed, lubricated_seed = (
        int(stream.generate_state(1)[0]) for stream in np.random.SeedSequence(seed).spawn(4)
    )
    reality = Reality(film=film, rod=rod, sphere=sphere)
    if draw_inputs:
        reality = drawn(reality, load_uncertainty or 0.0, inputs_seed, one_load_cell=one_load_cell)
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
        seed=rod_seed,
        **shared,
    )
    dry = simulate_contacts(
        load=loads, friction=friction, interface=interface, seed=dry_seed, **contacts
    )
    lubricated = simulate_contacts(
        load=lubricated_loads,
        interface=Interface(normal=None if interface is None else interface.normal),
        lubrication="lubricated",
        lubricant=lubricant,
        seed=lubricated_seed,
        **contacts,
    )
    film = film if state_law else without_law(film)
    common = {"conversion_constant": conversion_constant, "gain": gain, "seed": float(seed)}
    if len(channels) > 1:
        common["conversion_constant_xz"] = shear_conversion_constant
    of_rod = {
        **_described_film(reality.film),
        "indenter_radius": reality.rod.radius,
        "load_scale": reality.rod_load_scale,
        "load_1": calibration.stated_load,
        **common,
        "gain": 1.0,
    }
    if (spread := calibration.load_uncertainty) is not None:
        spread *= rod_load / calibration.stated_load
    nominal = replace(calibration, load=rod_load, load_uncertainty=spread)
    stated = {"film": film, "load_cell": LoadCell(name="a simulated load cell" * one_load_cell)}
    return Experiment(
        rod=_as_stated(nominal, of_rod, indenter=rod, **stated),
        dry=_as_stated(dry, common, indenter=sphere, **stated),
        lubricated=_as_stated(lubricated, common, indenter=sphere, **stated),
    )


def _as_stated(scan: Scan, truth: Mapping[str, float], **stated: Any) -> Scan:
    return replace(scan, synthetic={**(scan.synthetic or {}), **truth}, **stated)
