"""The instruments of a scan: the sensor, what gave load and position, and who measured."""

from memscal.model.arrays import keyword_value_record


@keyword_value_record
class StressSensor:
    """The sensor and the channel whose voltage was recorded.

    ``temperature`` and its standard uncertainty, in K, are those of the sensor during the scan.

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
