"""The elastic film between the indenter and the sensor."""

import math
from dataclasses import replace
from typing import Any, Literal

from memscal.errors import InputError
from memscal.model.arrays import (
    keyword_value_record,
    require_non_negative,
    require_positive,
    require_range,
    warn_of_units,
)

#: A normal distribution whose mean is moved by less, in standard deviations, is not cut off.
_UNCUT = 1e-6
#: In Pa: a softer film was given in MPa or kPa. Of one that is merely thick, which may stand for a
#: half-space, a scan warns.
_LEAST_MODULUS = 1e3
FilmLaw = Literal["linear", "neo-hookean", "mooney-rivlin"]
#: Laws of the film's stress: linear elasticity, and two of rubber at finite strain.
LINEAR, NEO_HOOKEAN, MOONEY_RIVLIN = LAWS = ("linear", "neo-hookean", "mooney-rivlin")


@keyword_value_record
class ElasticFilm:
    r"""An elastic film bonded to a rigid base.

    Parameters
    ----------
    young_modulus : float
        Young's modulus :math:`E`, in Pa.
    poisson_ratio : float
        Poisson's ratio :math:`\nu`, from 0 up to and including 0.5 (incompressible).
    thickness : float
        Thickness :math:`h`, in m.
    roughness_rms : float, optional
        Root-mean-square roughness of the free surface, in m.
    young_modulus_uncertainty, poisson_ratio_uncertainty, thickness_uncertainty : float, optional
        Standard uncertainties (k = 1), in the unit of the quantity.  ``None`` means "not stated":
        a calibration counts nothing for that source and notes it.
    law : str
        ``"linear"``, ``"neo-hookean"`` or ``"mooney-rivlin"``, each with the modulus and Poisson's
        ratio at small strain; empty where it is not stated: a calibration then counts its form.
    mooney_rivlin_ratio : float, optional
        :math:`C_2/C_1` of a Mooney-Rivlin film, from 0 (neo-Hookean) upward.
    name : str
        Which film it is, where there are several; scans that name the same film must agree on it.

    Examples
    --------
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> round(film.shear_modulus)
    733333
    """

    young_modulus: float
    poisson_ratio: float
    thickness: float
    roughness_rms: float | None = None
    young_modulus_uncertainty: float | None = None
    poisson_ratio_uncertainty: float | None = None
    thickness_uncertainty: float | None = None
    roughness_rms_uncertainty: float | None = None
    law: str = ""
    mooney_rivlin_ratio: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        require_positive("film young_modulus", self.young_modulus, "Pa")
        require_range("film poisson_ratio", self.poisson_ratio, 0.0, 0.5, "1")
        require_positive("film thickness", self.thickness, "m")
        for name in ("young_modulus", "poisson_ratio", "thickness", "roughness_rms"):
            uncertainty = getattr(self, f"{name}_uncertainty")
            require_non_negative(f"standard uncertainty of film {name}", uncertainty)
        require_non_negative("film roughness_rms", self.roughness_rms)
        if self.law not in ("", *LAWS):
            raise InputError(
                f"The film's law is {self.law!r}.",
                cure=f"Give one of {', '.join(LAWS)}, or leave it out where it is not known.",
            )
        if (self.law == MOONEY_RIVLIN) != (self.mooney_rivlin_ratio is not None):
            raise InputError(
                f"The film's law is {self.law or 'not stated'!r}, and its ratio C2/C1 is "
                f"{self.mooney_rivlin_ratio}.",
                why="A Mooney-Rivlin film has such a ratio, and no other film has.",
                cure="Give both or neither: law and mooney_rivlin_ratio.",
            )
        require_non_negative("film mooney_rivlin_ratio", self.mooney_rivlin_ratio)
        if self.young_modulus < _LEAST_MODULUS:
            warn_of_units(self)

    @property
    def shear_modulus(self) -> float:
        r"""Shear modulus :math:`G = E / 2(1 + \nu)`, in Pa."""
        return self.young_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def contact_modulus(self) -> float:
        r"""Plane-strain modulus :math:`E^* = E / (1 - \nu^2)` of a rigid contact, in Pa."""
        return self.young_modulus / (1 - self.poisson_ratio**2)

    @property
    def expected(self) -> "ElasticFilm":
        """The film with mean and standard deviation of a Poisson's ratio that ends at 0 and 1/2.

        A stated ratio is normally distributed, cut off at these ends: of 1/2 ± u half a normal
        distribution is left, of mean 1/2 - 0.80 u and standard deviation 0.60 u.
        """
        nu = self.poisson_ratio
        u = self.poisson_ratio_uncertainty
        if not u or u < _UNCUT**2:
            return self
        low = -nu / u
        high = (0.5 - nu) / u
        at_low, at_high = (math.exp(-0.5 * z**2) / math.sqrt(2 * math.pi) for z in (low, high))
        inside = (math.erf(high / math.sqrt(2)) - math.erf(low / math.sqrt(2))) / 2
        shift = (at_low - at_high) / inside
        if abs(shift) < _UNCUT:
            return self
        variance = 1 + (low * at_low - high * at_high) / inside - shift**2
        spread = u * math.sqrt(variance)
        return replace(self, poisson_ratio=nu + u * shift, poisson_ratio_uncertainty=spread)

    @property
    def law_text(self) -> str:
        """The law in words, with its ratio C2/C1."""
        ratio = self.mooney_rivlin_ratio
        words = law_in_words(self.law) or "of a law that is not stated"
        return words if ratio is None else f"{words} of C2/C1 = {ratio:.4g}"


def law_in_words(law: str) -> str:
    """Write a law as text does, with the names that it has."""
    return law.replace("hookean", "Hookean").replace("mooney-rivlin", "Mooney-Rivlin")


def more_and_less(record: Any, name: str) -> tuple[Any, Any, float] | None:
    """Return a film or indenter with more and less of a quantity, and u over the difference."""
    # None where no u is stated, or one that rounding hides; one-sided at the ends of a Poisson's
    # ratio, 0 and 1/2, beyond which the expected film's does not go.
    value = getattr(record, name)
    u = getattr(record, f"{name}_uncertainty", None)
    if not u:
        return None
    more = min(value + u, 0.5 if name == "poisson_ratio" else math.inf)
    less = max(value - u, 0.0)
    if more == less:
        return None
    return replace(record, **{name: more}), replace(record, **{name: less}), u / (more - less)
