"""Synthetic sensor and its rod scans: base stress through a known G, disturbed; and the truth."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.errors import InputError
from memscal.mechanics.contact import Contact
from memscal.mechanics.press_rod import press_rod
from memscal.model.arrays import FloatArray, require_non_negative, require_positive, require_range
from memscal.model.film import LINEAR, NEO_HOOKEAN, ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.instrument import StressSensor
from memscal.model.scan import Scan
from memscal.parallel import single_threaded

# The film passes exp(-kh): beyond this in kh nothing is left in double precision.
_REACH = 40.0


def apparatus_function(kernel: RadialKernel | None) -> RadialKernel:
    """Return the kernel, of unit integral, or the paper's Gaussian where there is none."""
    if kernel is None:
        return GaussianMixture()
    if not isinstance(kernel, RadialKernel):
        raise InputError(
            f"The kernel is a {type(kernel).__name__}, which has no transform(), radial() and "
            "describe().",
            cure="Give a GaussianMixture, a SmoothedDisc, or an object with these three methods.",
        )
    # Not at k = 0 itself, where a closed form such as J1(ka)/ka may divide by zero.
    integral = float(kernel.transform(np.array([1e-2]))[0])
    if not abs(integral - 1) <= 1e-6:
        problem = f"The kernel's transform is {integral:g} at k = 0, not 1."
        cure = "Divide the kernel by its integral; the conversion constant carries the size."
        raise InputError(problem, why="An apparatus function has unit integral.", cure=cure)
    return kernel


def blurred_stress(
    contacts: Sequence[Contact], kernel: RadialKernel, radius: FloatArray, *, order: int = 0
) -> FloatArray:
    r"""Return :math:`G \otimes \sigma_{zz}` in Pa at ``radius`` (m), a row for each contact."""
    # Of order one: the radial component of the blurred base shear.
    nodes = Wavenumbers.covering(_REACH / contacts[0].film.thickness, float(radius.max()))
    transforms = [(c.base_shear_spectrum if order else c.base_spectrum)(nodes.k) for c in contacts]
    spectra = np.stack(transforms, axis=1) * kernel.transform(nodes.k)[:, None]
    return np.moveaxis(nodes.synthesise(spectra, radius, order=order), -1, 0)


def disturbance(x: FloatArray, baseline: float, drift: float) -> FloatArray:
    """Return an offset and a linear drift over the positions, as shares of the largest signal."""
    half_range = 0.5 * float(np.ptp(x))
    return np.asarray(baseline + 0.5 * drift * (x - 0.5 * (x.min() + x.max())) / half_range)


@dataclass(frozen=True)
class Disturbances:
    """Noise, offset and drift as shares of the largest signal, and whether noise is stated."""

    noise: float
    baseline: float
    drift: float
    state_noise: bool
    seed: int

    def in_volts(self, largest: float) -> dict[str, float]:
        """Return offset, drift and noise in V, by the names of a truth."""
        return {name: getattr(self, name) * largest for name in ("baseline", "drift", "noise")}

    def errors(self, shape: tuple[int, ...], largest: float) -> FloatArray | None:
        """Return the standard deviations that a scan states, in V; None if it states none."""
        return np.full(shape, self.noise * largest) if self.state_noise and self.noise > 0 else None


Shear = tuple[RadialKernel, float] | None
"""Apparatus function and conversion constant (V/Pa) of the tangential channel along x."""


def recorded_shear(
    shear: Shear,
    blurred: Callable[[RadialKernel, int], FloatArray],
    x: FloatArray,
    offset: tuple[FloatArray, FloatArray],
    shape: tuple[int, ...],
    disturbed: Disturbances,
) -> tuple[dict[str, FloatArray], dict[str, float | str]]:
    """Return voltages of the shear along x, at offsets along x and in all (m), and their truth."""
    if shear is None:
        return {}, {}
    (kernel, constant) = shear
    (along, away) = offset
    # Cosine of the angle from x to the indenter; 0 right on the sensor.
    side = np.divide(along, away, out=np.zeros_like(away + along), where=away > 0)
    clean = constant * (blurred(kernel, 1) * side).reshape(shape)
    largest = float(np.abs(clean).max())
    draws = np.random.default_rng([disturbed.seed, 1]).standard_normal(shape)
    level = disturbance(x, disturbed.baseline, disturbed.drift)
    channels = {"u_xz": clean + largest * (level + disturbed.noise * draws)}
    if (errors := disturbed.errors(shape, largest)) is not None:
        channels["u_xz_errors"] = errors
    volts = {"conversion_constant": constant, **disturbed.in_volts(largest)}
    return channels, {f"{name}_xz": value for name, value in {**kernel.describe(), **volts}.items()}


def shear_channel(
    channels: Sequence[str], kernel: RadialKernel | None, conversion_constant: float
) -> Shear:
    """Return the tangential channel if it is among the channels of a scan."""
    if tuple(channels) not in (("zz",), ("zz", "xz")):
        why = "A line scan along x has the normal channel, and may have the shear's along x."
        cure = 'Give ("zz",) or ("zz", "xz").'
        raise InputError(f"The channels are {tuple(channels)}.", why=why, cure=cure)
    if len(channels) == 1:
        return None
    require_positive("conversion_constant of the channel xz", conversion_constant, "V/Pa")
    return apparatus_function(kernel), conversion_constant


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


@single_threaded()
def simulate(
    *,
    film: ElasticFilm = PAPER_FILM,
    rod: Rod = PAPER_ROD,
    rod_friction: float | None = None,
    kernel: RadialKernel | None = None,
    conversion_constant: float = 1e-7,
    channels: Sequence[str] = ("zz",),
    shear_kernel: RadialKernel | None = None,
    shear_conversion_constant: float = 5e-8,
    load: float | Sequence[float] = 1.0,
    half_range: float = 8e-3,
    points: int = 65,
    repeats: int = 1,
    raster: bool = False,
    noise: float = 0.005,
    centre: tuple[float, float] = (0.14e-3, 0.0),
    baseline: float = 0.01,
    drift: float = 0.005,
    load_uncertainty: float | None = 0.01,
    state_noise: bool = True,
    state_law: bool = True,
    seed: int = 0,
) -> Scan:
    """Simulate a rod scan through a known apparatus function.

    The base stress of the rod on the bonded film, by the film's law and at each load, is convolved
    with G exactly, by Hankel transforms; Gaussian noise, an offset and a linear drift are added.

    Parameters
    ----------
    film, rod
        What is pressed on what; the paper's where absent, its film neo-Hookean.  A film that states
        no law is taken as linear.  Of an uncertain Poisson's ratio that ends at 1/2 the true one is
        the mean (``film.expected``).
    rod_friction : float, optional
        0: the film slides freely under the rod; ``inf``: it sticks.  By default a linear film
        slides, and one of another law sticks.
    kernel : RadialKernel, optional
        The apparatus function; the paper's Gaussian of 561 um where absent.  Besides
        :class:`memscal.GaussianMixture` and :class:`memscal.SmoothedDisc`, any object of unit
        integral with their ``transform``, ``radial`` and ``describe``.
    conversion_constant : float
        A, in V/Pa.
    channels : sequence of str
        ``("zz", "xz")`` adds the tangential channel ``u_xz``, with G and A of its own and the same
        disturbances as shares of its own largest signal.
    shear_kernel, shear_conversion_constant
        G (the paper's Gaussian where absent) and A (V/Pa) of that channel.
    load : float or sequence of float
        Load in N; several loads give one repeat of the scan for each.
    half_range, points : float, int
        Positions run from minus to plus ``half_range`` in m, ``points`` along each axis.
    repeats, raster : int, bool
        Repeats at each load; whether to scan a square instead of a line.
    noise, baseline, drift : float
        Standard deviation of the noise, offset, and change of the offset across the scan, each
        as a share of the largest signal that the scan meets, at the (mean) load.
    centre : tuple of float
        Position of the sensor, in m.
    load_uncertainty, state_noise, state_law : float or None, bool, bool
        Relative standard uncertainty that the scan states for the load; whether it states its
        noise (``u_zz_errors``), and the film's law with the rod's friction.
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
    """
    require_range("half_range", half_range, 1e-9, 1.0, "m")
    require_positive("conversion_constant", conversion_constant, "V/Pa")
    require_non_negative("noise", noise)
    if points < 2 or repeats < 1:
        raise InputError("A scan needs two positions and one repeat at least.")
    if not np.isfinite(centre).all() or seed < 0:
        raise InputError(
            f"The centre is {centre} m and the seed {seed}; the one must be finite, the other not "
            "negative."
        )
    truth = apparatus_function(kernel)
    shear = shear_channel(channels, shear_kernel, shear_conversion_constant)
    loads = checked_loads(load)
    if raster and loads.size * repeats > 1:
        raise InputError("A raster has one repeat at one load.", cure="Simulate several rasters.")
    x = np.linspace(-half_range, half_range, points)
    radius = np.hypot.outer((x if raster else np.zeros(1)) - centre[1], x - centre[0])
    linear = film.law in ("", LINEAR)
    if rod_friction is None and not linear:
        rod_friction = math.inf
    # The stress in a linear film is proportional to the load: one contact serves for all.
    solved = loads.max(keepdims=True) if linear else loads
    true = film.expected
    contacts = [press_rod(true, rod, float(value), rod_friction) for value in solved]

    def blurred(kernel: RadialKernel, order: int = 0) -> FloatArray:
        stress = blurred_stress(contacts, kernel, radius, order=order)
        stress = stress * (loads / solved)[:, None, None]
        return np.asarray(stress[0] if raster else np.repeat(stress[:, 0], repeats, axis=0))

    row_loads = np.repeat(loads, repeats)
    signal = conversion_constant * blurred(truth)
    largest = float(signal.max() if raster else signal.max(axis=1).mean())
    clean = signal + largest * disturbance(x, baseline, drift)
    u = clean + np.random.default_rng(seed).normal(0.0, noise * largest, clean.shape)
    if not raster and row_loads.size == 1:
        u = u[0]
    disturbed = Disturbances(noise, baseline, drift, state_noise, seed)
    offset = x - centre[0], radius
    sheared, shear_truth = recorded_shear(shear, blurred, x, offset, u.shape, disturbed)
    of_law = {"mooney_rivlin_ratio": film.mooney_rivlin_ratio, "rod_friction": rod_friction}
    return Scan(
        x=x,
        y=x if raster else None,
        u_zz=u,
        u_zz_errors=disturbed.errors(u.shape, largest),
        normal_load=np.broadcast_to(row_loads[:, None], u.shape) if loads.size > 1 else None,
        channels=sheared,
        load=float(loads.mean()),
        load_uncertainty=None if load_uncertainty is None else load_uncertainty * loads.mean(),
        indenter=rod,
        rod_friction=rod_friction if state_law else None,
        film=film if state_law else without_law(film),
        sensor=StressSensor(name="a simulated sensor", channel="zz"),
        title="Synthetic rod scan",
        notes="Synthetic data made by memscal simulate; nothing here was measured.",
        synthetic={
            **truth.describe(),
            "conversion_constant": conversion_constant,
            "centre": centre[0],
            "centre_y": centre[1],
            "film_law": film.law or LINEAR,
            "poisson_ratio": true.poisson_ratio,
            **{name: value for name, value in of_law.items() if value is not None},
            **disturbed.in_volts(largest),
            "seed": float(seed),
            **shear_truth,
        },
    )


def without_law(film: ElasticFilm) -> ElasticFilm:
    """Return the film without a law, as a scan that does not state it has it."""
    return replace(film, law="", mooney_rivlin_ratio=None)


def checked_loads(load: float | Sequence[float]) -> FloatArray:
    """Return one load or several, in N, as a flat array; refuse none, and one not positive."""
    loads = np.atleast_1d(np.asarray(load, dtype=np.float64))
    if loads.ndim != 1 or loads.size == 0:
        raise InputError("The list of loads is empty.", cure="Give one load or several, in N.")
    for value in loads:
        require_positive("load", float(value), "N")
    return loads
