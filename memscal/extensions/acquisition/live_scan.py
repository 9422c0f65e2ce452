"""A scan that is calibrated while it is recorded."""

import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from itertools import zip_longest
from typing import Any

import numpy as np

from memscal.calibration.calibrate import Calibration, calibrate
from memscal.errors import InputError, require_names
from memscal.extensions.acquisition.positions import require_whole
from memscal.extensions.planning.design import require_targets
from memscal.formats.units import reading_of, to_si
from memscal.model.arrays import Values
from memscal.model.scan import Scan

_LOG = logging.getLogger("memscal")

Document = Mapping[str, Any]
"""A document of a run of Bluesky."""


class LiveScan:
    """A scan of what is read so far, calibrated as it grows; it never stops what records it.

    Called with the name and the document of a run of `Bluesky <https://blueskyproject.io>`_ it
    takes positions and readings from its events; any other script calls :meth:`add`.  What goes
    wrong meanwhile, in a document or a calibration, is written to the log ``memscal`` and to
    ``error``, and is no result yet.

    Parameters
    ----------
    x, u : str
        Keys of position and reading in the data of the events: of the stage its readback, not its
        setpoint.  Only streams whose descriptor has both count, and never the stream ``baseline``:
        what Bluesky reads before and after a run, with the rod lifted, is no reading of the scan.
    x_unit, u_unit : str
        Their units, which documents do not state.
    every : int
        After so many readings each it is calibrated; 0: at the end of the run alone.
    calibrate : callable
        What makes a :class:`memscal.Calibration` of a :class:`memscal.Scan`.
    **stated
        Fields of :class:`memscal.Scan` that the readings do not tell: ``film``, ``indenter``,
        ``load`` ...

    Attributes
    ----------
    result : Calibration or None
        The newest calibration; ``None`` before the first one, and where the newest try failed.
    error : str
        Why there is no result, or what was wrong with the newest document; else empty.

    Raises
    ------
    InputError
        Before the run: if a unit cannot be read, ``every`` is no whole number of at least zero, or
        a scan has no such field.

    Examples
    --------
    >>> import memscal
    >>> from memscal.acquire import LiveScan
    >>> made = memscal.simulate(seed=1)
    >>> live = LiveScan("x", "u", x_unit="m", u_unit="V", every=33,
    ...                 film=made.film, indenter=made.indenter, load=made.load)
    >>> for x, u in zip(made.x, made.u_zz):
    ...     live.add(x, u)
    >>> live.calibrate() is live.result, live.reached(A=0.03), live.error
    (True, True, '')
    """

    def __init__(
        self,
        x: str,
        u: str,
        *,
        x_unit: str,
        u_unit: str,
        every: int = 0,
        calibrate: Callable[[Scan], Calibration] = calibrate,
        **stated: Any,
    ) -> None:
        to_si(0.0, x_unit, "length", "x of the run (x_unit)")
        reading_of(u_unit, "u of the run (u_unit)")
        require_names("A scan has no field", stated, Scan.__dataclass_fields__)
        require_whole("The number of readings after which is calibrated (every)", every)
        self.keys = (x, u)
        self.units: Values = {"x_unit": x_unit, "u_unit": u_unit}
        self.every = every
        self.stated = stated
        self.result: Calibration | None = None
        self.error = ""
        self._function = calibrate
        self._rows: list[tuple[float, ...]] = []
        self._streams = set[str]()
        self._found = set[str]()
        self._run: str | None = None

    def __call__(self, name: str, document: Document) -> None:
        """Take a document of a run: start, descriptor, event, event_page or stop."""
        try:
            self._take(name, document)
        except Exception as failure:  # noqa: BLE001 - one that is raised would stop the run
            self._note(f"A document {name!r} is not as it should be: {failure!r}.")

    def add(self, x: float, u: float, load: float | None = None, time: float | None = None) -> None:
        """Take a reading: position and reading in their units, load in N, time in s.

        Like a call it never raises: what is no number is left out, and said in ``error``.
        """
        try:
            self._add(x, u, load, time)
        except Exception as failure:  # noqa: BLE001 - see above
            self._note(f"The reading {u!r} at {x!r} is left out: {failure}.")

    def scan(self) -> Scan:
        """Return what was read so far as a scan.

        Raises
        ------
        InputError
            If nothing was read, or the readings and what is stated make no scan.
        """
        if not self._rows:
            if self._found:
                require_names("No stream of the run has", self.keys, sorted(self._found))
            raise InputError(
                f"No reading of {' and '.join(self.keys)} has arrived.",
                why="Only events of a stream that has both keys, and is not the baseline, count.",
                cure="Compare the keys with those of the run's descriptor.",
            )
        x, u, load, time = np.array(self._rows).T
        known: Values = {"load_column": load, "time": time - time[0]}
        known = {name: values for name, values in known.items() if np.isfinite(values).any()}
        return replace(Scan.from_arrays(x, u, **self.units, **known), **self.stated)

    def calibrate(self) -> Calibration:
        """Calibrate what was read so far, and keep it as ``result``; errors are raised."""
        self.result = None
        try:
            self.result = self._function(self.scan())
        except Exception as failure:
            self.error = str(failure) or repr(failure)
            raise
        self.error = ""
        return self.result

    def reached(self, **targets: float) -> bool:
        """Whether the newest result is as sure as is wanted.

        Parameters
        ----------
        **targets
            Largest relative standard uncertainty of ``A``, ``sigma`` or ``fwhm``, such as 0.015,
            and the least resolved wavenumber, ``resolved``, in rad/m; as of :func:`memscal.design`.

        Raises
        ------
        InputError
            If there is no target, or no such one.
        """
        if not targets:
            raise InputError(
                "No target is given that the result is to reach.", cure="Give one, such as A=0.015."
            )
        wanted = require_targets(targets, "repeats")
        if self.result is None:
            return False
        apparatus = self.result.apparatus
        for name, value in wanted.items():
            if name == "resolved_wavenumber":
                enough = apparatus.resolved_wavenumber >= value
            else:
                parameters = apparatus.parameters
                known = name in parameters
                enough = known and parameters.uncertainty(name) <= value * abs(parameters[name])
            if not enough:
                return False
        return True

    def _take(self, name: str, document: Document) -> None:
        if name == "descriptor":
            self._describe(document)
        elif name in ("event", "event_page") and document["descriptor"] in self._streams:
            for x, u, time in self._readings(name, document):
                if x is not None and u is not None:
                    self.add(x, u, time=time)
        elif name == "stop" and self._run in (None, document.get("run_start", self._run)):
            self._try()

    def _describe(self, document: Document) -> None:
        """Count the stream of a descriptor if it has both keys; forget the run before."""
        keys = document["data_keys"].keys()
        self._found.update(keys)
        if {*self.keys} <= keys and document.get("name") != "baseline":
            run = document.get("run_start")
            if run != self._run:
                self._rows.clear()
                self._streams.clear()
                self.result = None
            self._run = run
            self._streams.add(document["uid"])

    def _readings(self, name: str, document: Document) -> Iterable[Any]:
        """Return position, reading and time of each event; None where it has none."""
        x, u = self.keys
        values = [document["data"].get(key) for key in (x, u)]
        values.append(document.get("timestamps", {}).get(u))
        if name == "event":
            return [values]
        return zip_longest(*([] if column is None else column for column in values))

    def _add(self, x: Any, u: Any, load: Any, time: Any) -> None:
        numbers = [np.nan if number is None else float(number) for number in (x, u, load, time)]
        if not np.isfinite(numbers[:2]).all():
            raise InputError("position and reading must be finite numbers")
        self._rows.append(tuple(numbers))
        if self.every and len(self._rows) % self.every == 0:
            self._try()

    def _try(self) -> None:
        try:
            self.calibrate()
        except Exception:  # noqa: BLE001 - kept as error
            self._note(f"No result yet of {len(self._rows)} readings: {self.error}")

    def _note(self, text: str) -> None:
        self.error = text
        _LOG.warning(text)
