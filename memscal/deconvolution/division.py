r"""Methods of division, for the paper's :math:`A\hat G = \hat U_{zz}/\hat\sigma_{zz}` (Eq. 2).

Both transforms vanish at large wavenumbers, and methods differ in their quotient there: by a
window on the spectra (the paper's white noise, Tikhonov's), or by scikit-image's Wiener filter of
an image.  Other packages add methods under an entry point: docs/own_method.md.
The voltage is the measured one, smoothed (:mod:`memscal.estimation.smoothing`).  Method
``bayesian`` divides nothing (:mod:`memscal.estimation.bayesian`).
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from functools import cached_property
from numbers import Integral, Real
from typing import Any, ClassVar, Literal, Protocol

import numpy as np
import scipy.fft

from memscal.axisymmetry.grids import FieldGrid
from memscal.errors import InputError, require_names
from memscal.estimation.bayesian import Bayesian
from memscal.model.arrays import FloatArray, Values, array_record, keyword_value_record

#: The paper adds white noise "ten times weaker than the weakest relevant spectral component".
NOISE_RATIO = 0.1
_CLOSED = 1e-9


@array_record
class DivisionProblem:
    """The two fields of the paper's Eq. (2), and which of their components are relevant."""

    grid: FieldGrid
    voltage: FloatArray  # lifted voltage per newton, in V/N
    reference: FloatArray  # lifted base stress per newton, in 1/m^2
    # Moduli of the fields' transforms where the voltage's is 15 times its noise, V m^2/N and 1.
    weakest_voltage: float
    weakest_reference: float
    transform: FloatArray | None = None  # of the reference, where it is known

    @cached_property
    def voltage_spectrum(self) -> FloatArray:
        """Transform of the voltage, in V m^2/N."""
        return self.grid.forward(self.voltage)

    @cached_property
    def reference_spectrum(self) -> FloatArray:
        """Transform of the base stress, dimensionless."""
        return self.grid.forward(self.reference) if self.transform is None else self.transform

    def images(self) -> tuple[FloatArray, FloatArray, float]:
        """Image of order one, point spread function of sum one, and the scale of their quotient."""
        image = self.grid.to_image(self.voltage)
        spread = self.grid.to_image(self.reference)
        peak = np.abs(image).max()
        total = spread.sum()
        # u = sum(g * spread) * cell area, with image / peak and spread / total.
        return image / peak, spread / total, peak / (total * self.grid.cell_area)

    def restored(self, image: FloatArray) -> Division:
        """Quotient of the fields, from a restored image, with its effective window."""
        field = self.grid.from_image(image)
        modulus = np.abs(self.reference_spectrum)
        voltage = np.abs(self.voltage_spectrum)
        predicted = np.abs(self.grid.transfer(field)) * modulus
        # Where the reference has vanished, so has the voltage: their rounding has no window.
        relevant = modulus > _CLOSED * modulus.max()
        window = np.divide(predicted, voltage, out=np.zeros_like(predicted), where=relevant)
        return Division(field, np.clip(window, 0.0, 1.0))


@array_record
class Division:
    """The quotient of the fields."""

    field: FloatArray  # A G on the grid, in V/Pa/m^2
    window: FloatArray  # what is left of each spectral component, from 0 to 1


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


MethodName = Literal[
    "white-noise", "bayesian", "white-noise-draw", "tikhonov", "wiener", "evidence"
]
"""Name of one of memscal's methods; ``evidence`` is a former name of ``bayesian``."""

Method = Regulariser | Bayesian
"""A way from a scan to A and G: by a division, or by Bayesian model averaging."""


def require_count(method: str, name: str, value: Any, least: int) -> None:
    """Refuse an option that is no whole number from ``least`` on."""
    if not isinstance(value, Integral) or int(value) < least:
        raise InputError(
            f"Option {name} of method {method} is {value}, but it must be a whole number of at "
            f"least {least}."
        )


def filtered_division(problem: DivisionProblem, window: FloatArray) -> Division:
    """Divide the spectra where the window exceeds 1e-9; beyond, the quotient is rounding."""
    window = np.where(window > _CLOSED, window, 0.0)
    quotient = np.zeros_like(problem.voltage_spectrum)
    np.divide(problem.voltage_spectrum, problem.reference_spectrum, out=quotient, where=window > 0)
    return Division(problem.grid.inverse(quotient * window), window)


@keyword_value_record
class _Own(Regulariser):
    """Base of memscal's regularisers: refuses values of their options that mean nothing."""

    amplitude: float = 1.0  # a factor on the rule's own choice

    def __post_init__(self) -> None:
        amplitude: Any = self.amplitude
        if not isinstance(amplitude, Real) or not 0 < float(amplitude) < math.inf:
            raise InputError(
                f"The amplitude of method {self.name} is {amplitude}, but it must be a positive "
                "number.",
                cure="It is a factor on the rule's own choice: 1 keeps that, 2 doubles the noise.",
            )


@keyword_value_record
class WhiteNoise(_Own):
    """Expectation of the paper's method over all draws of its complex noise, of variance s^2."""

    # White noise n leaves the numerator's mean; E[1/(z + n)] = (1 - exp(-|z|^2/s^2))/z. The
    # amplitude is that of the noise: s over a tenth of the weakest relevant component.
    name = "white-noise"
    assumes = "G is negligible beyond the wavenumber where the voltage sinks into its noise."
    fails = "A G with fine detail (sharp edges, a narrow ring) is smoothed to the resolved band."

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide with the expected window."""
        s = self.amplitude * NOISE_RATIO * problem.weakest_reference
        window = -np.expm1(-((np.abs(problem.reference_spectrum) / s) ** 2))
        return filtered_division(problem, window)


@keyword_value_record
class WhiteNoiseDraw(_Own):
    """One seeded draw of the paper's method: its quotient has no finite variance."""

    seed: int = 0
    name = "white-noise-draw"
    assumes = WhiteNoise.assumes
    fails = "Draws are heavy-tailed: some carry ripples that others do not."

    def __post_init__(self) -> None:
        super().__post_init__()
        require_count(self.name, "seed", self.seed, 0)

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide one draw; the window is that of its expectation."""
        grid = problem.grid
        rng = np.random.default_rng(self.seed)
        noisy_u = grid.to_period(problem.voltage)
        noisy_s = grid.to_period(problem.reference)
        # Noise of spectral amplitude s has, per pixel, s / (cell area * sqrt(pixels)).
        per_pixel = self.amplitude * NOISE_RATIO / (grid.cell_area * np.sqrt(noisy_u.size))
        noisy_u = noisy_u + rng.normal(0, per_pixel * problem.weakest_voltage, noisy_u.shape)
        noisy_s = noisy_s + rng.normal(0, per_pixel * problem.weakest_reference, noisy_s.shape)
        quotient = scipy.fft.rfft2(noisy_u) / scipy.fft.rfft2(noisy_s)
        period = scipy.fft.irfft2(quotient, s=noisy_u.shape) / grid.cell_area
        expected = WhiteNoise(amplitude=self.amplitude).divide(problem)
        return Division(grid.from_quotient(period), expected.window)


@keyword_value_record
class Tikhonov(_Own):
    r"""Minimiser of :math:`|\hat\sigma \hat g - \hat u|^2 + \alpha |\hat g|^2`."""

    # Its window closes more slowly than the white noise's, at the same wavenumber: sqrt(alpha) is
    # the paper's noise amplitude. The amplitude is that root over a tenth of the weakest relevant
    # component.
    name = "tikhonov"
    assumes = "G has little power; all wavenumbers are equally likely to carry it."
    fails = "Every component is a little too small, the peak of G with them."

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide with the Tikhonov window."""
        alpha = (self.amplitude * NOISE_RATIO * problem.weakest_reference) ** 2
        power = np.abs(problem.reference_spectrum) ** 2
        return filtered_division(problem, power / (power + alpha))


@keyword_value_record
class Wiener(_Own):
    """Wiener-Hunt restoration: the quotient with a Laplacian penalty."""

    # The amplitude is the root of the penalty over a tenth of the weakest relevant component.
    name = "wiener"
    assumes = "G is smooth; the noise of the lifted field is white."
    fails = "A lifted line scan has ring-shaped noise, not white: the penalty is a guess."

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide by scikit-image's Wiener-Hunt filter."""
        from skimage.restoration import wiener
        from skimage.restoration.uft import laplacian

        blurred, spread, scale = problem.images()
        penalty = np.abs(laplacian(2, blurred.shape)[0])
        spectrum = np.abs(np.fft.rfft2(np.fft.ifftshift(spread)))
        weakest = problem.weakest_reference / problem.grid.integrate(problem.reference)
        # Along one axis: the first component weaker than the weakest relevant one, or the last.
        index = int(np.argmax(spectrum[0] < weakest)) or spectrum.shape[1] - 1
        balance = (self.amplitude * NOISE_RATIO * weakest / penalty[0, index]) ** 2
        return problem.restored(wiener(blurred, spread, balance, clip=False) * scale)


ENTRY_POINT_GROUP = "memscal.regularisers"
_METHODS: tuple[Any, ...] = (WhiteNoise, Bayesian, WhiteNoiseDraw, Tikhonov, Wiener)
_OWN = {method.name: method for method in _METHODS}
#: Former names, which are accepted but no longer printed.
_ALIASES = {"evidence": "bayesian"}
#: Methods of earlier versions, whose artifacts are still read.
_LEFT = ("unsupervised-wiener", "richardson-lucy")


def regulariser_names() -> tuple[str, ...]:
    """Names of every regulariser: memscal's own first, then plug-ins'."""
    return (*_OWN, *sorted(set(_plug_ins()) - set(_OWN)))


def create_regulariser(name: str, /, **options: Any) -> Method:
    """Create a regulariser by its present or former name; ``seed`` only for those that draw."""
    factory = _factory(_ALIASES.get(name, name))
    accepted = inspect.signature(factory).parameters
    if "seed" not in accepted:
        options = {key: value for key, value in options.items() if key != "seed"}
    if not any(p.kind is p.VAR_KEYWORD for p in accepted.values()):
        require_names(f"Method {name} has no option", options, accepted)
    method: Method = factory(**options)
    return method


def chosen_method(
    method: str | Method, options: Mapping[str, Any] | None = None, **seed: int
) -> Method:
    """Set up a method by its name, or check one that is set up already."""
    if isinstance(method, str):
        return create_regulariser(method, **seed, **(options or {}))
    divides = isinstance(method, Bayesian) or callable(getattr(method, "divide", None))
    if isinstance(method, type) or not divides:
        raise InputError(
            f"The method is {method!r}, which cannot divide fields.",
            cure="Give a method's name, or a regulariser that is set up: Tikhonov(), not Tikhonov.",
        )
    if options:
        raise InputError(
            f"Options {', '.join(options)} were given beside a regulariser that is set up already.",
            cure="Set them on the regulariser, or give the method by name.",
        )
    return method


def _factory(name: str) -> Any:
    if name in _OWN:
        return _OWN[name]
    points = _plug_ins()
    if name in _LEFT and name not in points:
        cure = "docs/own_method.md adds it again, by scikit-image."
        raise InputError(f"There is no method named {name}.", cure=cure)
    require_names("There is no method named", [name], regulariser_names())
    try:
        return points[name].load()
    except Exception as error:
        # Whatever another package's import raises, the message names the package.
        raise InputError(
            f"The method {name}, {points[name].value}, could not be loaded: {error}.",
            cure="Repair or remove the package that provides it.",
        ) from error


def _plug_ins() -> Values:
    """Entry points of other packages, by name; looked up only when one is asked for."""
    from importlib.metadata import entry_points

    return {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
