"""TDMS files of LabVIEW, through npTDMS, after a look at what they claim."""

import io
import logging
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import PurePath
from typing import Any

import numpy as np

from memscal.errors import FormatError, InputError, UnsafeFileError
from memscal.extensions.recorded.columns import RecordedColumns
from memscal.formats.files import FilePath, damage_named, read_bytes
from memscal.formats.tables.dialect import cut_head
from memscal.formats.tables.sheets import installed
from memscal.formats.units import is_unit
from memscal.model.arrays import Values
from memscal.model.provenance import source_of
from memscal.model.sizes import too_large

_LEAD_IN = 28
_BIG_ENDIAN = 0x40
_NEW_LIST = 0x04
#: Each segment is an object, and may copy the list of all channels before it: so many bytes of
#: them, each time counted, are taken.  Each scale may refer twice to the one before.
_MOST_LISTED = 2**28
_SEGMENT = 500
_MOST_SCALES = 12
#: Properties that state a unit, and the column that the step of a waveform makes.
_UNITS = ("unit_string", "NI_UnitDescription", "unit", "units")
_TIME = "wf_increment"
_DEFRAGMENT = "Get the file again, or let LabVIEW defragment it (TDMS Defragment)."


def open_channels(path: FilePath, named: Values, **reading: Any) -> RecordedColumns:
    """Open the channels by group/channel; the waveform of the readings makes a column of times."""
    name = PurePath(path).name
    data = read_bytes(path)
    nptdms = installed("nptdms", "A TDMS file", "recorded")
    channels = {}
    with damage_named(f"{name} cannot be read as TDMS"), _warnings_refused():
        _require_whole(name, data)
        file = nptdms.TdmsFile.open(io.BytesIO(data))
        for group in file.groups():
            for channel in group.channels():
                channels[f"{group.name}/{channel.name}"] = channel
                _require_bounded(f"{name}: {channel.path}", (file, group, channel), len(data))
        used = {column: channels[column] for column in named.values() if column in channels}
        arrays = channels | {column: channel[:] for column, channel in used.items()}
        units = [_unit_of(channel) for channel in channels.values()]
        signal = used.get(named["u_zz"], ())
        waveform = signal.properties if signal else {}
        timed = waveform.get("wf_xunit_string") in (None, "", "s")
        step = float(waveform.get(_TIME, 0.0)) if timed else 0.0
    _require_one_clock(name, used)
    defaults = {}
    if step > 0:
        arrays[_TIME] = np.arange(len(signal)) * step
        units.append("s")
        defaults = {"time": _TIME} if named["time"] is None else {}
    rows = len(signal) or max(map(len, channels.values()), default=0)
    source = source_of(name, data)
    return RecordedColumns(source, arrays, units, rows, defaults, **reading)


@contextmanager
def _warnings_refused() -> Iterator[None]:
    """Refuse what npTDMS warns of, and goes on: the file is not what it claims to be."""

    def refuse(record: logging.LogRecord) -> bool:
        raise ValueError(record.getMessage())

    names = [name for name in logging.root.manager.loggerDict if name.startswith("nptdms.")]
    for name in names:
        logging.getLogger(name).addFilter(refuse)
    try:
        yield
    finally:
        for name in names:
            logging.getLogger(name).removeFilter(refuse)


def _require_whole(name: str, data: bytes) -> None:
    """Refuse a file that does not end with a segment: readings would be missing in silence."""
    position = 0
    known = 0
    listed = 0
    while position < len(data) and listed <= _MOST_LISTED:
        contents = struct.unpack_from("<I", data, position + 4)[0]
        order = ">" if contents & _BIG_ENDIAN else "<"
        size, added = struct.unpack_from(f"{order}QQ", data, position + 12)
        position += _LEAD_IN + size
        known = added if contents & _NEW_LIST else known + added
        listed += known + _SEGMENT
    if position != len(data):
        raise FormatError(
            f"{name} does not end where its last segment does.",
            why="It was cut short, not closed, or is in too many pieces.",
            cure=_DEFRAGMENT,
        )


def _require_bounded(where: str, owners: Sequence[Any], size: int) -> None:
    """Refuse a channel, the last of its owners, that claims more than the file can hold."""
    if len(owners[-1]) > size:
        cure = "Get the file again from where it came from."
        raise too_large(where, len(owners[-1]), size, "values", cure=cure, error=UnsafeFileError)
    for owner in owners:
        scales = int(owner.properties.get("NI_Number_Of_Scales", 0))
        if scales > _MOST_SCALES:
            cure = "Save it with scaled values."
            raise too_large(where, scales, _MOST_SCALES, "scales", cure=cure, error=UnsafeFileError)


def _unit_of(channel: Any) -> str:
    """Return the unit in a channel's properties, or in its name, or of its time stamps."""
    if channel.dtype.kind == "M":
        return "s"
    stated = [channel.properties[name] for name in _UNITS if channel.properties.get(name)]
    unit = str([*stated, *cut_head(channel.name)[1:], ""][0]).strip()
    return unit if is_unit(unit) else unit.lower()  # Volts


def _require_one_clock(name: str, channels: Values) -> None:
    """Refuse channels that were not sampled together: their rows do not belong together."""
    steps = {column: channel.properties.get(_TIME) for column, channel in channels.items()}
    lengths = {column: len(channel) for column, channel in channels.items()}
    for what, stated in ((_TIME, steps), ("the number of values", lengths)):
        if len({*stated.values()} - {None}) > 1:
            raise InputError(
                f"{name}: {what} differs between the channels: {stated}.",
                why="A row is what was read at one time.",
                cure="Name channels of one rate; get the file again if it may have been cut.",
            )
