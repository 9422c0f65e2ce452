"""The instruments of a scan: the sensor, what gave load and position, and who measured."""

from memscal.errors import InputError
from memscal.model.arrays import (
    keyword_value_record,
    require_non_negative,
    require_positive,
    require_range,
)

#: Of dynamics: what has a meaning with another only.
_TOGETHER = {
    "resonance": "quality",
    "quality": "resonance",
    "creep_share": "creep_time",
    "creep_time": "creep_share",
    "creep_record": "creep_share",
}
MOST_CREEP = 0.99
"""The share of the final reading that creeps is below one."""


@keyword_value_record
class Dynamics:
    r"""How a sensor and its amplifier follow a signal in time; what is not stated is immediate.

    .. math::

        H(f) = \frac{1}{1 + i f/f_c}\,\frac{1}{1 - (f/f_0)^2 + i f/(f_0 Q)}\,
               \frac{1 - g + g/(1 + 2 \pi i f \tau)}{1 - g\,e^{-T/\tau}}

    Parameters
    ----------
    low_pass, low_pass_uncertainty : float, optional
        Corner :math:`f_c` of a low-pass of one pole, in Hz, and its standard uncertainty.
    resonance, quality : float, optional
        Resonance :math:`f_0`, in Hz, and its quality Q, both or neither; with uncertainties.
    creep_share, creep_time : float, optional
        Share g, at most 0.99, of the final reading that comes with the time :math:`\tau`, in s,
        after a step; both or neither; with uncertainties.
    creep_record : float, optional
        Time T after a step at which the reading counts as whole, in s: the length of the record
        that share and time were found from; without end where it is not stated.

    Raises
    ------
    InputError
        If a number is not finite and above zero, a share above 0.99, or one of two is missing.

    Examples
    --------
    >>> Dynamics(low_pass=3.0, low_pass_uncertainty=0.1).low_pass  # Hz
    3.0
    """

    low_pass: float | None = None
    low_pass_uncertainty: float | None = None
    resonance: float | None = None
    resonance_uncertainty: float | None = None
    quality: float | None = None
    quality_uncertainty: float | None = None
    creep_share: float | None = None
    creep_share_uncertainty: float | None = None
    creep_time: float | None = None
    creep_time_uncertainty: float | None = None
    creep_record: float | None = None

    def __post_init__(self) -> None:
        stated = {name: value for name, value in vars(self).items() if value is not None}
        for name, value in stated.items():
            of = name.removesuffix("_uncertainty")
            require = require_positive if of == name else require_non_negative
            require(f"{name} of the sensor", value)
            for needed in (of, _TOGETHER.get(of, of)):
                if needed not in stated:
                    raise InputError(
                        f"The dynamics of the sensor state {name}, but no {needed}.",
                        cure=f"Give {needed}, or leave out {name}.",
                    )
        require_range("creep_share of the sensor", self.creep_share or 0.0, 0.0, MOST_CREEP)


@keyword_value_record
class StressSensor:
    """The sensor and the channel whose voltage was recorded.

    ``temperature`` and its standard uncertainty, in K, are those of the sensor during the scan;
    ``dynamics`` how it follows a signal in time, at once where they are not stated.

    >>> StressSensor(name="W7", serial_number="0012").channel
    'zz'
    """

    name: str = ""
    model: str = ""
    channel: str = "zz"
    serial_number: str = ""
    manufacturer: str = ""
    temperature: float | None = None
    temperature_uncertainty: float | None = None
    dynamics: Dynamics | None = None


@keyword_value_record
class Equipment:
    """A measuring instrument, such as the stage, with the certificate of its calibration.

    >>> Equipment(name="stage", serial_number="7").same_as(Equipment(name="stage"))
    False
    """

    name: str = ""
    serial_number: str = ""
    certificate: str = ""
    certificate_date: str = ""

    def same_as(self, other: "Equipment") -> bool:
        """Whether both name one instrument: by its serial number, or by name if neither has one."""
        if self.serial_number or other.serial_number:
            return self.serial_number == other.serial_number
        return self.name == other.name != ""


@keyword_value_record
class LoadCell(Equipment):
    """The load cell or balance by which loads were set or read; empty where it is not stated.

    >>> LoadCell(name="balance", serial_number="7").same_as(LoadCell(serial_number="7"))
    True
    """


@keyword_value_record
class User:
    """Who measured, and the laboratory: ``name`` and ``affiliation``; empty if not stated.

    >>> User(affiliation="a laboratory").name
    ''
    """

    name: str = ""
    affiliation: str = ""
