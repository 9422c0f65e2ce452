"""The calibrated array: what it predicts, where a contact presses, its files."""

from dataclasses import field
from os import PathLike

from numpy.typing import ArrayLike

from memscal.apparatus import ApparatusFunction
from memscal.errors import FormatError
from memscal.extensions.arrays import files
from memscal.extensions.arrays.array_data import ArrayData
from memscal.extensions.arrays.bound import bound, predict
from memscal.extensions.arrays.contacts import Contacts
from memscal.extensions.arrays.locate import Touch, locate
from memscal.extensions.arrays.single_sensor import single_sensor
from memscal.extensions.arrays.stream import Stream
from memscal.formats.hdf5.reader import open_hdf5
from memscal.formats.hdf5.writer import ARTIFACT_SCHEMA
from memscal.model.arrays import FloatArray, keyword_array_record
from memscal.model.provenance import SourceFile
from memscal.model.result import Gridded, Shown


@keyword_array_record
class SensorArray(ArrayData, Shown, Gridded):
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

    Examples
    --------
    >>> import memscal
    >>> scan = memscal.simulate(array=(1, 3), pitch=2e-3, crosstalk=0.01, seed=1)
    >>> array = memscal.calibrate_array(scan).array
    >>> array.crosstalk.shape, array.covariance.shape, bool(array.used.all())
    ((3, 3), (3, 3), True)
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
        >>> bool(apparatus.conversion_constant == array.conversion_constants[1])
        True
        """
        return single_sensor(self, name)

    def locate(
        self,
        u: ArrayLike,
        indenter: Touch = "point",
        shear: float = 0.3,
        rest: ArrayLike | None = None,
    ) -> Contacts:
        r"""Find place and force of a contact in each frame.

        The readings are explained by :math:`u_i = P \sum_j C_{ij} A_j [f_j + q \cdot s_j](r)`
        with the stress of the indenter and of its shear at the base of the film, blurred by G, in
        noise as in the scan.  Shear moves the readings as another place does, by a third of h Q/P:
        unless it is known, state how large it may be.

        Parameters
        ----------
        u : array_like, shape (frames, n)
            Readings in their SI unit, zero without contact (or see ``rest``), columns in the
            order of ``sensors``; NaN is missing.  Readings at an end of a sensor's range are
            left out.
        indenter : "point", Rod or Sphere
            What presses; the contact radius of a sphere follows from the force and the film.
        shear : float
            Standard deviation of each component of shear over normal force; 0: there is none.
        rest : array_like, shape (m, n) or (n,), optional
            Readings without contact on the same scale: their mean is subtracted, and the
            uncertainty of the mean is counted (of few frames by the noise of the scan, or more).

        Returns
        -------
        Contacts
            With NaN where nothing is found; its flags say why.  Of a row of sensors ``y`` is that
            of the row, and its variances are NaN.

        Raises
        ------
        InputError
            If the number of columns is not that of the sensors, indenter or shear make no sense,
            or the sensors lie in a row that is along neither x nor y.

        Examples
        --------
        >>> import memscal
        >>> scan = memscal.simulate(array=(1, 3), pitch=2e-3, crosstalk=0.01, seed=1)
        >>> array = memscal.calibrate_array(scan).array
        >>> u = array.predict([[0.5e-3, 0.0]], force=0.8)
        >>> contacts = array.locate(u, shear=0.0)
        >>> round(float(contacts.x[0]) * 1e3, 3), round(float(contacts.force[0]), 3)
        (0.5, 0.8)
        """
        return locate(self, u, indenter, shear, rest)

    def predict(
        self,
        places: ArrayLike,
        force: ArrayLike = 1.0,
        *,
        indenter: Touch = "point",
        shear: ArrayLike = 0.0,
    ) -> FloatArray:
        """Return what the sensors read of contacts, shape (m, n), in the unit of the readings.

        Parameters
        ----------
        places : array_like, shape (m, 2)
            x and y of each contact, in m.
        force : array_like, shape () or (m,)
            Normal forces, in N.
        indenter : "point", Rod or Sphere
            What presses.
        shear : array_like, shape (), (2,) or (m, 2)
            Shear force on the film over normal force, along x and y.

        Raises
        ------
        InputError
            If an array has another shape, a number is not finite, or the indenter is another one.

        Notes
        -----
        Sensors read nothing of places beyond the tables, which reach from each of them to the far
        end of where contacts are sought: two thicknesses outside all of them.
        """
        return predict(self, places, force, indenter, shear)

    def bound(
        self,
        places: ArrayLike,
        force: ArrayLike = 1.0,
        *,
        indenter: Touch = "point",
        shear: float = 0.3,
    ) -> FloatArray:
        """Return the Cramer-Rao bound of x, y and force at places, covariances (m, 3, 3).

        No unbiased estimate of a single frame has less variance in the noise of the scan, the
        array being known exactly, and the shear within its standard deviation.

        Parameters
        ----------
        places, force, indenter, shear
            As of :meth:`predict` and :meth:`locate`.

        Raises
        ------
        InputError
            If the places have another shape, forces, indenter or shear make no sense, or the
            sensors lie in a row that is along neither x nor y.

        Examples
        --------
        >>> import memscal
        >>> scan = memscal.simulate(array=(1, 3), pitch=2e-3, crosstalk=0.01, seed=1)
        >>> array = memscal.calibrate_array(scan).array
        >>> close, outside = array.bound([[0.5e-3, 0.0], [4e-3, 0.0]], shear=0.0)[:, 0, 0]
        >>> bool(close < outside)
        True
        """
        return bound(self, places, force, indenter, shear)

    def stream(
        self,
        rate: float = 1000.0,
        limit: tuple[ArrayLike, ArrayLike] | None = None,
        drift: tuple[float, float] | None = None,
        indenter: Touch = "point",
    ) -> Stream:
        """Return a stream: frames are pushed into it, and it says what presses, drift or not.

        Baselines are tracked by a Kalman filter in blocks of 0.2 s, in which a contact is a diffuse
        nuisance: drift is common to the sensors, a contact is local, and stays however long it
        lasts.  What presses in the first block is taken for the baseline.  A sensor that is dead,
        has not changed for 1 s and two frames, or that alone contradicts all others for most of a
        second, is left out (``left_out``); one that was stuck returns when it changes.  Contacts
        are assumed to be without shear: one of Q over P moves the place by about 0.35 h Q/P, h
        being the film's thickness.

        A frame is judged by the baselines at the end of the last block.  However a stream is cut
        into what is pushed, its records are the same but for rounding.

        A frame has a contact from six standard deviations on: where weak ones matter, average
        frames before they are pushed.  Readings that are rounded so coarsely that a sound sensor
        does not change for 1 s are taken for stuck, if not at an end of its range.

        Parameters
        ----------
        rate : float
            Frames per second.
        limit : (low, high), optional
            Readings at or beyond them are left out, in the readings' SI unit, for all sensors or
            (n,) each; that of the scan without it.
        drift : (common, own), optional
            Standard deviations of the change of baselines in 1 s, in the readings' SI unit: in
            common, and of each sensor by itself.  Without it that of three strengths is taken under
            which the readings are most probable, each with an own part of a tenth of the common
            one.  State it where single sensors drift as much as all: if by 2.5 % of the largest
            reading in 5 minutes, a force of half the scan's that is held for 3 minutes is else 5 %
            off (rms; the worst of 20 streams 12 %) at a stated 3 %, and a contact may remain.
        indenter : "point", Rod or Sphere
            What presses.

        Raises
        ------
        InputError
            If the rate is not above zero, limits or drift make no sense, the indenter is another
            one, the sensors lie in a row that is along neither x nor y, or no more are used than a
            contact has unknowns: 2 in a row, 3 in a grid.

        Examples
        --------
        >>> import memscal
        >>> import numpy as np
        >>> scan = memscal.simulate(array=(1, 5), pitch=2e-3, crosstalk=0.01, seed=1)
        >>> array = memscal.calibrate_array(scan).array
        >>> stream = array.stream(rate=100)
        >>> random = np.random.default_rng(1)
        >>> def frames(readings):
        ...     return random.multivariate_normal(readings, array.noise, size=100)
        >>> rest = stream.push(frames(np.zeros(5)))
        >>> held = stream.push(frames(array.predict([[0.5e-3, 0.0]], force=0.8)[0]))
        >>> bool(rest["contact"].any()), round(float(held["force"].mean()), 2)
        (False, 0.8)
        """
        return Stream(self, rate, limit, drift, indenter)

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
    >>> import memscal, tempfile
    >>> scan = memscal.simulate(array=(1, 3), pitch=2e-3, crosstalk=0.01, seed=1)
    >>> array = memscal.calibrate_array(scan).array
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     array.save(f"{folder}/array.h5")
    ...     memscal.load_array(f"{folder}/array.h5").sensors == array.sensors
    True
    """
    with open_hdf5(path, accept_altered=accept_altered) as file:
        if file.schema == ARTIFACT_SCHEMA:
            raise FormatError(
                f"{file.name} is the artifact of a single sensor, not of an array.",
                why="An array's artifact has the sensors that were calibrated together.",
                cure="Calibrate a scan of all sensors (memscal calibrate), or use the functions "
                "for one sensor, such as memscal.load_apparatus.",
            )
        array = SensorArray(**files.read_open(file).stated())
        vars(array)["source"] = file.source
    return array
