"""The simulated sensor: base stress seen through a known G, as disturbed voltages."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from memscal.axisymmetry.hankel import Wavenumbers, quotient
from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.errors import InputError
from memscal.extensions.simulation.disturbances import Disturbances, Shear
from memscal.mechanics.contact import Contact
from memscal.model.arrays import Arrays, FloatArray, Values, require_positive, value_record
from memscal.model.instrument import StressSensor
from memscal.model.scan import Scan

# The film passes exp(-kh): beyond this in kh nothing is left in double precision.
_REACH = 40.0


def apparatus_function(kernel: RadialKernel | None) -> RadialKernel:
    """Return the kernel, of unit integral, or the paper's Gaussian where there is none."""
    if kernel is None:
        return GaussianMixture()
    if not isinstance(kernel, RadialKernel):
        raise InputError(
            f"The kernel is of type {type(kernel).__name__}, without transform(), radial() and "
            "describe().",
            cure="Give a GaussianMixture, a SmoothedDisc, or an object with these three methods.",
        )
    # Not at k = 0 itself, where a closed form such as J1(ka)/ka may divide by zero.
    integral = kernel.transform(np.array([1e-2]))[0]
    if not abs(integral - 1) <= 1e-6:
        raise InputError(
            f"The kernel's transform is {integral:g} at k = 0, not 1.",
            why="An apparatus function has unit integral.",
            cure="Divide the kernel by its integral; the conversion constant carries the size.",
        )
    return kernel


def blurred_stress(
    contacts: Sequence[Contact], kernel: RadialKernel, radius: FloatArray, *, order: int = 0
) -> FloatArray:
    r"""Return :math:`G \otimes \sigma_{zz}` in Pa at ``radius`` (m), a row for each contact."""
    # Of order one: the radial component of the blurred base shear.
    nodes = Wavenumbers.covering(_REACH / contacts[0].film.thickness, radius.max())
    transforms = [(c.base_shear_spectrum if order else c.base_spectrum)(nodes.k) for c in contacts]
    spectra = np.stack(transforms, axis=1) * kernel.transform(nodes.k)[:, None]
    return np.moveaxis(nodes.synthesise(spectra, radius, order=order), -1, 0)


Truth = dict[str, float | str]
"""What is known of a synthetic scan, by name, in SI units."""

Blurred = Callable[[RadialKernel, int], FloatArray]
"""Base stress through a kernel, in Pa at each reading: normal (order 0), radial shear (order 1)."""


@value_record
class SimulatedSensor:
    """G and A (V/Pa) of the normal channel, and those of the tangential one where there is one."""

    kernel: RadialKernel
    conversion_constant: float
    shear: Shear

    def stresses(self, blurred: Blurred, offset: FloatArray, distance: FloatArray) -> Arrays:
        """Return the stresses that the channels see, in Pa, at distances along x and in all (m)."""
        seen = {"zz": blurred(self.kernel, 0)}
        if self.shear is not None:
            # Cosine of the angle from x to the indenter; 0 right on the sensor.
            seen["xz"] = blurred(self.shear[0], 1) * quotient(offset, distance)
        return seen


def simulated_sensor(
    kernel: RadialKernel | None, conversion_constant: float, shear: Shear
) -> SimulatedSensor:
    """Return the sensor; refuse a kernel that is no apparatus function, and constants below 0."""
    require_positive("conversion_constant", conversion_constant, "V/Pa")
    if shear is not None:
        shear_kernel, shear_constant = shear
        require_positive("conversion_constant of the channel xz", shear_constant, "V/Pa")
        shear = apparatus_function(shear_kernel), shear_constant
    return SimulatedSensor(apparatus_function(kernel), conversion_constant, shear)


def simulated_scan(
    sensor: SimulatedSensor,
    stresses: Arrays,
    largest: float,
    draws: FloatArray,
    disturbances: Disturbances,
    seed: int,
    *,
    x: FloatArray,
    loads: FloatArray,
    truth: Truth,
    **stated: Any,
) -> Scan:
    """Return the scan that a sensor reads of stresses (Pa), with its truth.

    ``largest`` is the largest normal stress, in Pa; ``draws`` are standard normal numbers,
    and have the shape of the scan's voltages.
    """
    constant = sensor.conversion_constant
    signal = constant * stresses["zz"].reshape(draws.shape)
    largest_signal = constant * largest
    normal: Values = _read("u_zz", signal, largest_signal, draws, x, disturbances)
    tangential: Arrays = {}
    tangential_truth: Truth = {}
    if sensor.shear is not None:
        kernel, shear_constant = sensor.shear
        shear = shear_constant * stresses["xz"].reshape(draws.shape)
        largest_shear = float(np.abs(shear).max())
        shear_draws = np.random.default_rng([seed, 1]).standard_normal(draws.shape)
        tangential = _read("u_xz", shear, largest_shear, shear_draws, x, disturbances)
        described = {
            **kernel.describe(),
            "conversion_constant": shear_constant,
            **disturbances.in_volts(largest_shear),
        }
        tangential_truth = {f"{name}_xz": value for name, value in described.items()}
    load = float(loads.mean())
    uncertainty = disturbances.load_uncertainty
    return Scan(
        x=x,
        **normal,
        channels=tangential,
        load=load,
        load_uncertainty=uncertainty and uncertainty * load,
        sensor=StressSensor(name="a simulated sensor"),
        notes="Synthetic data made by memscal simulate; nothing here was measured.",
        synthetic={
            **sensor.kernel.describe(),
            "conversion_constant": constant,
            **truth,
            **disturbances.in_volts(largest_signal),
            "seed": float(seed),
            **tangential_truth,
        },
        **stated,
    )


def _read(
    name: str,
    signal: FloatArray,
    largest: float,
    draws: FloatArray,
    x: FloatArray,
    disturbances: Disturbances,
) -> Arrays:
    """Return the voltages of a channel, and their standard deviations if the scan states them."""
    noise = disturbances.noise
    channel = {name: signal + largest * (disturbances.level(x) + noise * draws)}
    if disturbances.state_noise and noise > 0:
        channel[f"{name}_errors"] = np.full(signal.shape, noise * largest)
    return channel
