"""What is stated of a table of readings: how it is read, what was pressed on what, how well."""

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, Literal

from memscal.model.arrays import FloatArray, keyword_value_record
from memscal.model.film import ElasticFilm
from memscal.model.indenter import RoundIndenter
from memscal.model.instrument import Equipment, LoadCell, StressSensor, User
from memscal.model.stress import StressProfile


@keyword_value_record
class TableLayout:
    """How a table of readings is read; what is left out is found in it.

    Parameters
    ----------
    x_unit, u_unit, load_unit : str, optional
        Units of ``x`` and ``y``, of all channels, and of the column of loads (by default N), where
        the table states none.
    time_unit : str, optional
        Unit of the times, where the table states none.
    speed : float, optional
        That of the stage, in m/s, which the scan keeps; where no column states positions it moves
        on with the time.
    step : float, optional
        Length, in m, from each place to the next: ``x`` counts the places or, of a log with holds
        and without ``x``, the presses that a load or a depth tells are counted.
    u_sign : int
        -1 where the voltage falls when the indenter presses.
    holds : bool
        The table is a log in the order of time: holds are found, and each is averaged.
    depth_unit : str, optional
        Unit of the depth that tells the presses, where the table states none.
    baseline : "before-each", optional
        The reading before each press is subtracted from its hold.
    ceiling : float, optional
        In the unit of ``u``, after ``u_sign``: readings at or above it, where amplifier or
        converter is at its end, are left out.
    sheet : str, optional
        Sheet of a workbook, by default the first.
    scan : int, optional
        Of a file of SPEC or Bluesky with several scans: the number after #S, or counted from 1.
    skip_rows : int, optional
        Lines before the header, or before the first reading where there is no header.
    missing : sequence of str
        Words, or numbers as text, that mean a missing value.
    delimiter, decimal : str, optional
        What separates cells; decimal mark.

    Examples
    --------
    >>> import memscal
    >>> table = {"x": [-1.0, 0.0, 1.0], "U": [-1.0, -3.0, -1.0]}
    >>> layout = memscal.TableLayout(x_unit="mm", u_unit="mV", u_sign=-1)
    >>> memscal.import_table(table, x="x", u="U", layout=layout).u_zz
    array([0.001, 0.003, 0.001])
    """

    x_unit: str | None = None
    u_unit: str | None = None
    load_unit: str | None = None
    time_unit: str | None = None
    speed: float | None = None
    step: float | None = None
    u_sign: int = 1
    holds: bool = False
    depth_unit: str | None = None
    baseline: Literal["before-each"] | None = None
    ceiling: float | None = None
    sheet: str | None = None
    scan: int | None = None
    skip_rows: int | None = None
    missing: Sequence[str] = ()
    delimiter: str | None = None
    decimal: str | None = None


@keyword_value_record
class ScanConditions:
    """What was pressed on what, under which load, and measured by what: no table states it.

    Parameters
    ----------
    film, indenter, load : ElasticFilm, RoundIndenter, float, optional
        What was pressed on what, and the nominal load in N, by default the median of its column.
        Film and indenter, where both are stated, are held against the positions.
    rod_friction : float, optional
        0 where a rod slides freely under the film, ``inf`` where it sticks.
    motion : str
        ``"rest"`` of a noise record: readings in time with nothing pressed, without positions.
    sliding_friction, sliding_friction_uncertainty : float, optional
        Tangential over normal load of a sliding indenter, where it was measured.
    averaging_length, dwell_time : float, optional
        Way over which each reading is the mean, in m; time at each place before it, in s.
    lubrication, lubricant : str
        ``"dry"`` or ``"lubricated"``, and the name of the lubricant.
    layout : path, data frame or mapping, optional
        Where the sensors of an array are: a table with columns sensor (the name), x, y and,
        optionally, x_errors and y_errors, with units in the heads; each sensor exactly once.
    sensor, load_cell, stage, user
        What measured the stress, the load and the position, and who measured.
    direction : str, optional
        ``"x"`` or ``"y"``: which way a line ran across the sensor, by default as its columns say.
    title, start_time, end_time : str
        Free text; times in ISO 8601.
    reference, synthetic : StressProfile, mapping, optional
        A base stress that travels with the scan; the known truth of synthetic data.

    Examples
    --------
    >>> import memscal
    >>> rod = memscal.Rod(radius=0.25e-3)
    >>> conditions = memscal.ScanConditions(indenter=rod, load=1.0, lubrication="dry")
    >>> table = {"x [mm]": [-1.0, 0.0, 1.0], "U [mV]": [1.0, 3.0, 1.0]}
    >>> memscal.import_table(table, x="x", u="U", conditions=conditions).load
    1.0
    """

    film: ElasticFilm | None = None
    indenter: RoundIndenter | None = None
    load: float | None = None
    rod_friction: float | None = None
    motion: str = ""
    sliding_friction: float | None = None
    sliding_friction_uncertainty: float | None = None
    averaging_length: float | None = None
    dwell_time: float | None = None
    lubrication: str = ""
    lubricant: str = ""
    layout: Any = None
    sensor: StressSensor = field(default_factory=StressSensor)
    load_cell: LoadCell = field(default_factory=LoadCell)
    stage: Equipment = field(default_factory=Equipment)
    user: User = field(default_factory=User)
    direction: str | None = None
    title: str = ""
    start_time: str = ""
    end_time: str = ""
    reference: StressProfile | None = None
    synthetic: Mapping[str, float | str] | None = None


@keyword_value_record
class ScanUncertainties:
    """Standard uncertainties of the readings, loads and positions of a table.

    Parameters
    ----------
    noise : float, optional
        Of each reading, in the unit of ``u``.
    load_uncertainty, load_scatter : float, optional
        Of the load, common to all points, in N; and of each point's own, relative.
    x_error, position_scale_uncertainty : float, optional
        Of each position, in m; and of the stage's scale, relative.
    position_errors_by_repeat : bool
        Whether errors of positions are new in each repeat; else the repeats share them.
    gain_uncertainty, gain_curvature_uncertainty, roundness_uncertainty : float, optional
        As in :class:`memscal.Scan`, with the next four; relative, or a share.
    line_offset_uncertainty, shear_sensitivity_uncertainty : float, optional
        In m.
    base_slip_uncertainty, baseline_curvature_uncertainty : float, optional
        A share.
    u_zz_correlation : ndarray, optional
        Correlation of the noise between points, as in :class:`memscal.Scan`.

    Examples
    --------
    >>> import memscal
    >>> table = {"x [mm]": [-1.0, 0.0, 1.0], "U [mV]": [1.0, 3.0, 1.0]}
    >>> noisy = memscal.ScanUncertainties(noise=0.01)
    >>> memscal.import_table(table, x="x", u="U", uncertainties=noisy).u_zz_errors
    array([1.e-05, 1.e-05, 1.e-05])
    """

    noise: float | None = None
    load_uncertainty: float | None = None
    load_scatter: float | None = None
    x_error: float | None = None
    position_errors_by_repeat: bool = False
    position_scale_uncertainty: float | None = None
    gain_uncertainty: float | None = None
    gain_curvature_uncertainty: float | None = None
    roundness_uncertainty: float | None = None
    line_offset_uncertainty: float | None = None
    base_slip_uncertainty: float | None = None
    baseline_curvature_uncertainty: float | None = None
    shear_sensitivity_uncertainty: float | None = None
    u_zz_correlation: FloatArray | None = None
