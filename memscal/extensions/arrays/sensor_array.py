"""The calibrated array: what it predicts, where a contact presses, its files."""

from memscal.extensions.arrays.array_data import ArrayData
from memscal.model.arrays import keyword_array_record
from memscal.model.result import Shown


@keyword_array_record
class SensorArray(ArrayData, Shown):
    """Sensors under one film, calibrated together, as :func:`memscal.calibrate_array` finds them.

    Parameters
    ----------
    sensors : tuple of str
        Their names, n of them.
    used : ndarray of bool, shape (n,)
        False of a dead one; its numbers are NaN.
    conversion_constants : ndarray, shape (n,)
        In V/Pa, or in the SI unit of the readings per Pa.
    centres : ndarray, shape (n, 2)
        x and y in m; y is NaN where the scan does not tell it (a single line).
    crosstalk : ndarray, shape (n, n)
        Row i, column j: what sensor i reads of sensor j's signal; 1 on the diagonal.
    covariance : ndarray, shape (n, n)
        Of the conversion constants by all sources, in (V/Pa)^2.
    """

    def __repr__(self) -> str:
        """Return how many sensors there are, in place of arrays."""
        return f"<SensorArray: {len(self.sensors)} sensors, {self.used.sum()} used>"
