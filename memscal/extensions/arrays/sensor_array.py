"""The calibrated array: what it predicts, where a contact presses, its files."""

from dataclasses import field
from os import PathLike

from memscal.apparatus import ApparatusFunction
from memscal.errors import FormatError
from memscal.extensions.arrays import files
from memscal.extensions.arrays.array_data import ArrayData
from memscal.extensions.arrays.single_sensor import single_sensor
from memscal.formats.hdf5.reader import open_hdf5
from memscal.formats.hdf5.writer import ARTIFACT_SCHEMA, SCHEMA_ATTRIBUTE
from memscal.model.arrays import keyword_array_record
from memscal.model.provenance import SourceFile
from memscal.model.result import Correlated, Gridded, Shown


@keyword_array_record
class SensorArray(ArrayData, Shown, Correlated, Gridded):
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

    source: SourceFile | None = field(default=None, init=False)
    """The file it was read from; ``None`` for a changed copy."""

    def __repr__(self) -> str:
        """Return how many sensors there are, in place of arrays."""
        return f"<SensorArray: {len(self.sensors)} sensors, {self.used.sum()} used>"

    def sensor(self, name: str) -> ApparatusFunction:
        """Return one sensor as an ordinary apparatus function, to measure or to be saved.

        Its A, G, centre and width have the uncertainties of the array by all sources; its readings
        are those of the scan less what it reads of the other sensors; its checks are those of the
        array, without what other sensors alone fail.

        Parameters
        ----------
        name : str
            One of ``sensors``.

        Raises
        ------
        InputError
            If there is no such sensor, or it is not used.

        Examples
        --------
        >>> import memscal
        >>> scan = memscal.simulate(array=(1, 3), pitch=2e-3, crosstalk=0.01, seed=1)
        >>> array = memscal.calibrate_array(scan).array
        >>> apparatus = array.sensor(array.sensors[1])
        >>> apparatus.conversion_constant == array.conversion_constants[1]
        True
        """
        return single_sensor(self, name)

    def save(self, path: str | PathLike[str], *, overwrite: bool = False) -> None:
        """Write the array to an artifact file.

        Raises
        ------
        OutputError
            If the file exists and ``overwrite`` is false, or cannot be written.
        """
        files.write_array(self, path, overwrite=overwrite)


def load_array(path: str | PathLike[str], *, accept_altered: bool = False) -> SensorArray:
    """Read a calibrated array from its artifact.

    Parameters
    ----------
    path : path-like
        A file written by ``memscal calibrate`` or :meth:`SensorArray.save`.
    accept_altered : bool
        Accept a file whose content does not fit its digest: ``source.altered`` records it.

    Returns
    -------
    SensorArray
        The calibrated array; ``source`` names its file.

    Raises
    ------
    FormatError
        If the file is no array's artifact, is damaged, or was changed after it was written.
    SchemaVersionError
        If it was written under a newer major version of the format.

    Examples
    --------
    >>> import memscal
    >>> array = memscal.load_array("array.h5")  # doctest: +SKIP
    >>> array.sensors, array.conversion_constants  # doctest: +SKIP
    """
    with open_hdf5(path, accept_altered=accept_altered) as file:
        if file.attribute("/", SCHEMA_ATTRIBUTE) == ARTIFACT_SCHEMA:
            raise FormatError(
                f"{file.name} is the artifact of a single sensor, not of an array.",
                why="An array's artifact has the sensors that were calibrated together.",
                cure="Calibrate a scan of all sensors (memscal calibrate), or use the functions "
                "for one sensor, such as memscal.load_apparatus.",
            )
        data = files.array_from(file)
        source = file.source
    array = SensorArray(**data.stated())
    object.__setattr__(array, "source", source)
    return array
