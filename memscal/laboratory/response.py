"""What a simulated sensor reports: base stresses through its apparatus function, disturbed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.errors import InputError
from memscal.mechanics.contact import Contact
from memscal.model.validation import FloatArray

__all__ = ["apparatus_function", "blurred_stress", "disturbance"]

# The film passes exp(-kh): beyond this in kh nothing is left in double precision.
_REACH = 40.0


def apparatus_function(kernel: RadialKernel | None) -> RadialKernel:
    """Return the kernel, or the paper's Gaussian where there is none.

    Raises
    ------
    InputError
        If it is no kernel, or has another integral than 1, which would pass for an error of A.
    """
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
        raise InputError(
            f"The kernel's transform is {integral:g} at k = 0, not 1.",
            why="An apparatus function has unit integral.",
            cure="Divide the kernel by its integral; the conversion constant carries the size.",
        )
    return kernel


def blurred_stress(
    contacts: Sequence[Contact], kernel: RadialKernel, radius: FloatArray, *, order: int = 0
) -> FloatArray:
    r"""Return :math:`G \otimes \sigma_{zz}` of several contacts on one film.

    Of order one it is the radial component of the blurred base shear, a vector field.

    Parameters
    ----------
    contacts : sequence of Contact
        Contacts on one film.
    kernel : RadialKernel
        The apparatus function G.
    radius : ndarray, any shape
        Distances from the contact's axis, in m.
    order : int
        Zero for the normal stress, one for the shear.

    Returns
    -------
    ndarray, shape (contacts, *radius.shape)
        The convolution, exact by Hankel transforms, in Pa.
    """
    nodes = Wavenumbers.covering(_REACH / contacts[0].film.thickness, float(radius.max()))
    transform = kernel.transform(nodes.k)
    transforms = [
        contact.base_shear_spectrum(nodes.k) if order else contact.base_spectrum(nodes.k)
        for contact in contacts
    ]
    spectra = np.stack([found * transform for found in transforms], axis=1)
    return np.moveaxis(nodes.synthesise(spectra, radius, order=order), -1, 0)


def disturbance(x: FloatArray, baseline: float, drift: float) -> FloatArray:
    """Return an offset and a linear drift over the positions, as shares of the largest signal."""
    half_range = 0.5 * float(np.ptp(x))
    return np.asarray(baseline + 0.5 * drift * (x - 0.5 * (x.min() + x.max())) / half_range)
