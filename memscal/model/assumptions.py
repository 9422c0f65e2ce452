"""What a calibration takes for granted, with the sizes at which that would matter."""

from collections.abc import Mapping
from dataclasses import field

from memscal.model.arrays import Values, value_record

#: Whether a size is taken for granted, stated with an uncertainty that is counted, or measured.
ASSUMED = "assumed"
STATED = "stated"
MEASURED = "measured"

#: Keys of the sizes, in files and in JSON, by the numbers that an assumption moves.
SIZE_KEYS = {
    "conversion_constant": "size_for_one_u",
    "gaussian_sigma": "size_for_one_u_of_sigma",
    "fwhm": "size_for_one_u_of_fwhm",
}
MOVED = tuple(SIZE_KEYS)

#: By name: what is taken for granted, and the word for its size.
_KNOWN = {
    "roundness": ("The sensor is round.", "axis ratio less one"),
    "line_offset": (
        "The line passes over the sensor's centre.",
        "distance of the line from the centre",
    ),
    "stage_scale": ("The stage moves as far as it says.", "relative error of its scale"),
    "base_slip": (
        "The film is bonded to its base.",
        "share of the difference to a base that slides freely",
    ),
    "baseline_curvature": (
        "The baseline is straight, but for a curvature that is counted.",
        "edge to centre over the largest signal",
    ),
    "gain_curvature": (
        "The reading is proportional to the stress.",
        "b in U (1 - b U/U_max)",
    ),
    "shear_sensitivity": (
        "The sensor does not respond to shear.",
        "length times the divergence of the shear at the base",
    ),
    "film_law": (
        "The film follows the law of the reference.",
        "share of the difference between a linear and a neo-Hookean film",
    ),
    "rod_friction": (
        "The film is held, or slides, under the rod as the reference has it.",
        "share from sticking to sliding",
    ),
    "noise_correlation": (
        "The noise of a reading is independent of its neighbours.",
        "correlation of neighbouring readings",
    ),
    "poisson_ratio": ("Poisson's ratio is as stated.", "error of Poisson's ratio"),
    "thickness": ("The film is as thick as stated.", "error of the thickness"),
    "load_scale": ("The load is as stated.", "relative error of the load"),
}
_NOT_KNOWN = ("", "")
#: Those whose size is a length.
LENGTHS = ("line_offset", "shear_sensitivity", "thickness")
NAMES = tuple(_KNOWN)


@value_record
class Assumption:
    """What a result takes for granted of one thing, and how large an error of it would matter.

    Parameters
    ----------
    name : str
        Such as ``roundness``; see docs/assumptions.md.
    state : str
        ``"assumed"``: taken for granted, and in no uncertainty (but for what the budget counts of
        a curved baseline, of the law and of the rod's friction, where these are not stated);
        ``"stated"``: the scan states its uncertainty, which is in the budget (or states the law,
        the rod's friction or the correlation itself); ``"measured"``: the scan determines it.
    sizes : mapping of str to float
        By parameter (``conversion_constant``, ``gaussian_sigma``, ``fwhm``) the size, in m of a
        length, that moves it by one standard uncertainty; infinite where none does.

    Examples
    --------
    >>> from memscal import Assumption
    >>> sizes = {"conversion_constant": 0.05, "gaussian_sigma": 0.03, "fwhm": float("inf")}
    >>> Assumption("roundness", "assumed", sizes).to_dict()["size_for_one_u"]
    {'value': 0.05, 'unit': '1'}
    """

    name: str
    state: str
    sizes: Mapping[str, float] = field(default_factory=dict)

    @property
    def sentence(self) -> str:
        """What is taken for granted, in words."""
        return _KNOWN.get(self.name, _NOT_KNOWN)[0]

    @property
    def words(self) -> str:
        """The sentence as a part of another."""
        sentence = self.sentence
        start = sentence if sentence.startswith("Poisson") else sentence[:1].lower() + sentence[1:]
        return start.removesuffix(".")

    @property
    def measure(self) -> str:
        """What the size is of, in words."""
        return _KNOWN.get(self.name, _NOT_KNOWN)[1]

    @property
    def is_length(self) -> bool:
        """Whether the size is a length."""
        return self.name in LENGTHS

    @property
    def unit(self) -> str:
        """Unit in which the size is shown."""
        return "mm" if self.is_length else "1"

    def size(self, parameter: str) -> float:
        """Size for one standard uncertainty of a parameter, in the unit in which it is shown."""
        return self.sizes[parameter] / (1e-3 if self.is_length else 1.0)

    def size_text(self, parameter: str) -> str:
        """Size for one standard uncertainty of a parameter, with its unit, in words."""
        size = self.size(parameter)
        if size == float("inf"):
            return "none does"
        return f"{size:.2g} mm" if self.is_length else f"{size:.2g}"

    def to_dict(self) -> Values:
        """Return what JSON holds; a size that no error reaches is null."""
        values: Values = {"name": self.name, "sentence": self.sentence, "state": self.state}
        for parameter, key in SIZE_KEYS.items():
            size = self.size(parameter)
            values[key] = {"value": size if size < float("inf") else None, "unit": self.unit}
        return values
