"""Rod scans with a tangential channel, made without the package's own forward model."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import memscal
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.model.scan import Scan

CENTRE = 0.14e-3
CONVERSION = 5e-8
SIGMA = 400e-6


def shear_scan(
    *,
    seed: int,
    kernel: RadialKernel | None = None,
    noise: float = 0.005,
    crosstalk: float = 0.0,
    repeats: int = 1,
    channel: str = "xz",
    **options: Any,
) -> Scan:
    """A scan whose tangential channel has a G and an A of its own; its noise is stated.

    ``noise``, and ``crosstalk`` of the normal channel, are shares of the largest voltage.
    """
    scan = memscal.simulate(seed=seed, repeats=repeats, centre=(CENTRE, 0.0), **options)
    kernel = kernel or GaussianMixture(sigmas=(SIGMA,))
    contact = memscal.indent(scan.film, scan.indenter, load=scan.load)
    wavenumbers = Wavenumbers.covering(40 / scan.film.thickness, 12e-3)
    transform = contact.base_shear_spectrum(wavenumbers.k) * kernel.transform(wavenumbers.k)
    spectrum = RadialSpectrum(wavenumbers, transform, order=1)
    offset = scan.x - CENTRE
    signal = CONVERSION * spectrum.at(np.abs(offset)) * np.sign(offset)
    largest = float(np.abs(signal).max())
    level = (
        0.01
        + 0.0025 * scan.x / np.abs(scan.x).max()
        + crosstalk * np.exp(-((offset / 1.5e-3) ** 2) / 2)
    )
    rng = np.random.default_rng([seed, 1])
    u = signal + largest * (level + rng.normal(0.0, noise, scan.u_zz.shape))
    channels = {f"u_{channel}": u, f"u_{channel}_errors": np.full(u.shape, noise * largest)}
    return replace(scan, channels=channels, direction=channel[0])
