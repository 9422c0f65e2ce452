"""What every regulariser is given, and what it gives back."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from memscal.axisymmetry.grids import FieldGrid
from memscal.errors import InputError
from memscal.model.arrays import FloatArray

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = [
    "ENTRY_POINT_GROUP",
    "Division",
    "DivisionProblem",
    "Evidence",
    "KernelProfile",
    "Regulariser",
    "create_regulariser",
    "filtered_division",
    "image_division",
    "regulariser_names",
    "require_amplitude",
    "require_count",
]

#: The paper adds white noise "ten times weaker than the weakest relevant spectral component".
NOISE_RATIO = 0.1

_CLOSED = 1e-9


class KernelProfile(Protocol):
    """A radial kernel, known on both sides of the Hankel transform."""

    def radial(self, r: FloatArray) -> FloatArray:
        """Values at radii (m)."""
        ...

    def transform(self, k: FloatArray) -> FloatArray:
        """Transform at wavenumbers (rad/m)."""
        ...


@dataclass(frozen=True, eq=False)
class DivisionProblem:
    r"""The two fields of the paper's Eq. (2), and how far their spectra can be believed.

    Parameters
    ----------
    grid : FieldGrid
        Where the fields live.
    voltage : ndarray
        Lifted voltage per newton, in V/N.
    reference : ndarray
        Lifted base stress per newton, in 1/m^2.
    weakest_voltage, weakest_reference : float
        Moduli of the weakest relevant spectral components: the fields' transforms where the
        voltage's stands ten times above its noise, in V m^2/N and 1.
    posterior : callable, optional
        Returns A G, in V/Pa/m^2, as the scan's points give it without any division, and the same
        on the grid: the mean of its posterior, or the most credible that is not negative (first
        argument) or does not rise with the radius (second).
    """

    grid: FieldGrid
    voltage: FloatArray
    reference: FloatArray
    weakest_voltage: float
    weakest_reference: float
    posterior: Callable[[bool, bool], tuple[KernelProfile, FloatArray]] | None = None

    @cached_property
    def voltage_spectrum(self) -> FloatArray:
        """Transform of the voltage, in V m^2/N."""
        return self.grid.forward(self.voltage)

    @cached_property
    def reference_spectrum(self) -> FloatArray:
        """Transform of the base stress, dimensionless."""
        return self.grid.forward(self.reference)


@dataclass(frozen=True, eq=False)
class Division:
    """The quotient of the fields.

    Parameters
    ----------
    field : ndarray
        A G on the grid, in V/Pa/m^2.
    window : ndarray
        What the regularisation leaves of each spectral component, from 0 to 1.
    profile : KernelProfile, optional
        What the field was made of, where it was no division: finer than any grid.
    """

    field: FloatArray
    window: FloatArray
    profile: KernelProfile | None = None


class Regulariser(Protocol):
    """A way to divide fields whose transforms vanish.

    Any object with these members will do.  Register its class under the entry point group
    ``memscal.regularisers``: it is called with the options that the user gave, and with
    ``seed=`` where its signature has one.
    """

    name: ClassVar[str]
    assumes: ClassVar[str]
    fails: ClassVar[str]

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide the voltage field by the stress field."""
        ...


def require_amplitude(method: str, amplitude: Any) -> None:
    """Refuse a noise amplitude that is no positive number."""
    if not isinstance(amplitude, Real) or not 0 < float(amplitude) < math.inf:
        raise InputError(
            f"The amplitude of method {method} is {amplitude}, but it must be a positive number.",
            cure="It is a factor on the rule's own choice: 1 keeps that, 2 doubles the noise.",
        )


def require_count(method: str, name: str, value: Any, least: int) -> None:
    """Refuse an option that is no whole number from ``least`` on."""
    if not isinstance(value, Integral) or int(value) < least:
        raise InputError(
            f"Option {name} of method {method} is {value}, but it must be a whole number of at "
            f"least {least}."
        )


def filtered_division(problem: DivisionProblem, window: FloatArray) -> Division:
    """Divide the spectra wherever the window is open.

    Components whose window is below 1e-9 are left out: there the quotient of two
    transforms that have both vanished is rounding, not information.
    """
    window = np.where(window > _CLOSED, window, 0.0)
    quotient = np.zeros_like(problem.voltage_spectrum)
    np.divide(problem.voltage_spectrum, problem.reference_spectrum, out=quotient, where=window > 0)
    return Division(problem.grid.inverse(quotient * window), window)


def image_division(problem: DivisionProblem, image: FloatArray) -> Division:
    """Wrap an image that an image-restoration routine made, with its effective window."""
    grid = problem.grid
    field = grid.from_image(image)
    modulus, voltage = np.abs(problem.reference_spectrum), np.abs(problem.voltage_spectrum)
    kept = np.abs(grid.transfer(field)) * modulus
    # Where the reference has vanished, so has the voltage: their rounding has no window.
    there = modulus > _CLOSED * modulus.max()
    window = np.divide(kept, voltage, out=np.zeros_like(kept), where=there)
    return Division(field, np.clip(window, 0.0, 1.0))


@dataclass(frozen=True, kw_only=True)
class Evidence:
    r"""Posterior mean of A G, given the scan's points, their noise, and a prior about a Gaussian.

    The radial profile of a scan is estimated in data space before any field is divided: the best
    Gaussian, and departures from it whose shape, smoothness and strength are weighed by evidence
    (:mod:`memscal.estimation.bayesian`).  The fields of the other methods are made of that
    estimate's convolution with the reference; this method takes the estimate itself, so that
    nothing is lost to a window, and beyond the resolved band the prior takes over.

    Parameters
    ----------
    nonnegative : bool
        Take the most credible G that is nowhere negative.
    monotone : bool
        Take the most credible G that nowhere rises with the radius.  A ring does: whether a
        constraint contradicts the scan is what the check ``reconvolution`` tells.
    """

    nonnegative: bool = False
    monotone: bool = False
    name: ClassVar[str] = "evidence"
    assumes: ClassVar[str] = "G is a Gaussian, or departs from one smoothly."
    fails: ClassVar[str] = (
        "Detail finer than a third of G's width that the film hides is not found, only allowed for."
    )

    @property
    def constrained(self) -> bool:
        """Whether a constraint was asked for."""
        return self.nonnegative or self.monotone

    def divide(self, problem: DivisionProblem) -> Division:
        """Take the posterior mean; its window is open everywhere."""
        if problem.posterior is None:
            raise InputError(
                "Method evidence was given fields without the scan that they came from.",
                cure="Use it by memscal.calibrate(scan, method='evidence').",
            )
        profile, field = problem.posterior(self.nonnegative, self.monotone)
        return Division(field, np.ones(problem.voltage_spectrum.shape), profile)


ENTRY_POINT_GROUP = "memscal.regularisers"

_OWN = {
    "white-noise": "memscal.deconvolution.windows:WhiteNoise",
    "evidence": "memscal.deconvolution.division:Evidence",
    "white-noise-draw": "memscal.deconvolution.windows:WhiteNoiseDraw",
    "tikhonov": "memscal.deconvolution.windows:Tikhonov",
    "wiener": "memscal.deconvolution.scikit_image:Wiener",
    "unsupervised-wiener": "memscal.deconvolution.scikit_image:UnsupervisedWiener",
    "richardson-lucy": "memscal.deconvolution.scikit_image:RichardsonLucy",
}


def regulariser_names() -> tuple[str, ...]:
    """Names of every regulariser: memscal's own first, then plug-ins'.

    Examples
    --------
    >>> regulariser_names()[0]
    'white-noise'
    """
    others = sorted({point.name for point in _plug_ins()} - set(_OWN))
    return (*_OWN, *others)


def create_regulariser(name: str, /, **options: Any) -> Regulariser:
    """Create a regulariser by name.

    Parameters
    ----------
    name : str
        One of :func:`regulariser_names`.
    **options
        Its parameters; ``seed`` is passed on only to those that draw random numbers.

    Raises
    ------
    InputError
        If there is no such regulariser, or it has no such option.

    Examples
    --------
    >>> create_regulariser("tikhonov", amplitude=0.5).amplitude
    0.5
    """
    factory = _factory(name)
    accepted = inspect.signature(factory).parameters
    if "seed" not in accepted:
        options = {key: value for key, value in options.items() if key != "seed"}
    unknown = sorted(set(options) - set(accepted))
    takes_any = any(p.kind is p.VAR_KEYWORD for p in accepted.values())
    if unknown and not takes_any:
        raise InputError(
            f"Method {name} has no option {', '.join(unknown)}.",
            cure=f"Its options are: {', '.join(accepted) or 'none'}.",
        )
    regulariser: Regulariser = factory(**options)
    return regulariser


def _factory(name: str) -> Any:
    if name in _OWN:
        module, _, attribute = _OWN[name].partition(":")
        return getattr(import_module(module), attribute)
    found = [point for point in _plug_ins() if point.name == name]
    if not found:
        raise InputError(
            f"There is no method named {name}.",
            cure=f"Choose from {', '.join(regulariser_names())}.",
        )
    point = found[0]
    try:
        return point.load()
    except Exception as error:
        # Whatever another package's import raises, the user needs to know which package it is.
        raise InputError(
            f"The method {name}, {point.value}, could not be loaded: {error}.",
            cure="Repair or remove the package that provides it.",
        ) from error


def _plug_ins() -> Collection[EntryPoint]:
    """Entry points of other packages; looked up only when one is asked for."""
    from importlib.metadata import entry_points

    return entry_points(group=ENTRY_POINT_GROUP)
