"""Synthetic rod scans through a known apparatus function, their truth stored with them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.errors import InputError
from memscal.mechanics.indent import indent
from memscal.model.arrays import FloatArray, require_non_negative, require_positive, require_range
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.scan import Scan, StressSensor
from memscal.parallel import single_threaded
from memscal.simulation.sensor import (
    Disturbances,
    apparatus_function,
    blurred_stress,
    disturbance,
    shear_channel,
)

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
)
PAPER_ROD = Rod(radius=0.25e-3, radius_uncertainty=2.5e-6)


@single_threaded()
def simulate(
    *,
    film: ElasticFilm = PAPER_FILM,
    rod: Rod = PAPER_ROD,
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
    seed: int = 0,
) -> Scan:
    """Simulate a rod scan through a known apparatus function.

    The base stress of the frictionless rod on the bonded film is convolved with G exactly, by
    Hankel transforms; Gaussian noise, an offset and a linear drift are added.

    Parameters
    ----------
    film, rod
        What is pressed on what; the paper's where absent.
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
    load_uncertainty, state_noise : float or None, bool
        Relative standard uncertainty that the scan states for the load, and whether it states its
        noise (``u_zz_errors``).
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
    contact = indent(film, rod, load=float(loads.max()), strain="linear")
    per_newton = conversion_constant * blurred_stress([contact], truth, radius)[0] / contact.load
    row_loads = np.repeat(loads, repeats)
    signal = per_newton * row_loads[:, None] if not raster else per_newton * loads[0]
    largest = float(per_newton.max() * loads.mean())
    clean = signal + largest * disturbance(x, baseline, drift)
    u = clean + np.random.default_rng(seed).normal(0.0, noise * largest, clean.shape)
    if not raster and row_loads.size == 1:
        u = u[0]
    disturbed = Disturbances(noise, baseline, drift, state_noise, seed)
    channel_data: dict[str, FloatArray] = {}
    shear_truth: dict[str, float | str] = {}
    if shear is not None:
        blurred = blurred_stress([contact], shear.kernel, radius, order=1)[0] / contact.load
        sheared = blurred * shear.side(x - centre[0], radius)
        rows = sheared * (loads[0] if raster else row_loads[:, None])
        channel_data, shear_truth = shear.recorded(rows.reshape(u.shape), x, disturbed)
    return Scan(
        x=x,
        y=x if raster else None,
        u_zz=u,
        u_zz_errors=disturbed.errors(u.shape, largest),
        normal_load=np.broadcast_to(row_loads[:, None], u.shape) if loads.size > 1 else None,
        channels=channel_data,
        load=float(loads.mean()),
        load_uncertainty=None if load_uncertainty is None else load_uncertainty * loads.mean(),
        indenter=rod,
        film=film,
        sensor=StressSensor(name="a simulated sensor", channel="zz"),
        title="Synthetic rod scan",
        notes="Synthetic data made by memscal simulate; nothing here was measured.",
        synthetic={
            **truth.describe(),
            "conversion_constant": conversion_constant,
            "centre": centre[0],
            "centre_y": centre[1],
            **disturbed.in_volts(largest),
            "seed": float(seed),
            **shear_truth,
        },
    )


def checked_loads(load: float | Sequence[float]) -> FloatArray:
    """Return one load or several, in N, as a flat array; refuse none, and one not positive."""
    loads = np.atleast_1d(np.asarray(load, dtype=np.float64))
    if loads.ndim != 1 or loads.size == 0:
        raise InputError("The list of loads is empty.", cure="Give one load or several, in N.")
    for value in loads:
        require_positive("load", float(value), "N")
    return loads
