"""memscal-scan: the sensor's voltage against the indenter's position, as HDF5."""

import re
from collections.abc import Iterator, Mapping

import numpy as np

from memscal.errors import FormatError, placed
from memscal.formats import groups
from memscal.formats.digest import require_schema, require_unaltered
from memscal.formats.files import FilePath
from memscal.formats.groups import read_record, write_record
from memscal.formats.hdf5 import writer
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.hdf5.writer import Group, Nodes, si
from memscal.formats.units import reading_of
from memscal.model import records
from memscal.model.arrays import Axes, FloatArray, Values
from memscal.model.notation import Reading
from memscal.model.quantities import by_name
from memscal.model.scan import BRANCHES, LIKE_SIGNAL, Scan, branch_numbers, require_rod_friction
from memscal.model.sizes import too_large
from memscal.readings.ceiling import without_clipped

_CHANNELS = ("u_xz", "u_xz_errors", "u_yz", "u_yz_errors")
_DATA = "/entry/data"
_SIGNAL = f"{_DATA}/u_zz"
_NOISE = "/entry/noise_record"
_DECLARED = by_name(records.SCAN_DATA.quantities)
# The other arrays have the shape of the signal, which is that of the scan.
_OWN_SHAPE = {"x", "y", "x_errors", "y_errors", "u_zz_correlation"}
_AS_SIGNAL = _DECLARED.keys() - _OWN_SHAPE
_POINTS = ("point",)
#: Fields of a layout, and how the names end of what its two columns are in files.
_LAYOUTS = (("layout", ""), ("layout_uncertainty", "_errors"))
_PAIRS = ("point", "point_prime")
_BRANCHES = ", ".join(["0 not stated", *(f"{i} {name}" for name, i in BRANCHES.items())])
_SYNTHETIC = (
    "The data of this file are synthetic: calculated from the known truth below, not measured."
)


def read_scan(path: FilePath, *, accept_altered: bool = False) -> Scan:
    """Read a scan from a memscal-scan file.

    Parameters
    ----------
    path : path
        The file; units in it are converted to SI.
    accept_altered : bool
        Accept a file whose content does not fit its digest: ``source.altered`` records it.

    Returns
    -------
    Scan
        With ``source`` naming the file and its SHA-256.

    Raises
    ------
    FormatError, UnitError, UnsafeFileError, SchemaVersionError
        If the file does not hold a scan that this version can read, or was changed after it was
        written; the message names the file and the HDF5 path.

    Examples
    --------
    >>> import tempfile
    >>> from memscal.model.film import ElasticFilm
    >>> from memscal.model.indenter import Rod
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> scan = Scan(x=[-1e-3, 0, 1e-3], u_zz=[1e-3, 3e-3, 1e-3], load=1.0,
    ...             indenter=Rod(radius=0.25e-3), film=film)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_scan(scan, f"{folder}/scan.h5")
    ...     read_scan(f"{folder}/scan.h5").u_zz
    array([0.001, 0.003, 0.001])
    """
    with open_hdf5(path, accept_altered=accept_altered) as file:
        return scan_from(file)


def scan_from(file: SafeFile, most: int | None = None, schema: str = writer.SCAN_SCHEMA) -> Scan:
    """Read the scan of an open file of a schema; one of more than ``most`` points is refused."""
    require_schema(file, schema)
    if most is not None:
        size = file.claimed_number(_SIGNAL)
        if size > most:
            cure = "Average neighbouring readings, thin the raster, or leave out repeats."
            raise too_large(file.name, size, most, "points", cure=cure)
    require_unaltered(file)
    load = read_record(records.LOAD, file, "/entry/indenter", defaults={"load": None})
    with placed(file.where("/entry/indenter/friction_coefficient")):
        require_rod_friction(load.get("rod_friction"))
    stated = groups.read_circumstances(file)
    stated["title"] = file.optional_text("/entry/title")
    stated["notes"] = file.optional_text("/entry/notes/data")
    reading = reading_of(file.units_of(_SIGNAL) or "V", file.where(_SIGNAL))
    if file.attribute(_DATA, "axes") in ("time", ("time",)):
        # Under an indenter it is a dwell record, else a noise record.
        return Scan(
            **(load | _read_rest(file, _DATA, reading)),
            **stated,
            source=file.source,
        )
    axes = _find_axes(file)
    points = axes == _POINTS
    only_y = axes is not None and not file.has(f"{_DATA}/x")
    along = "y" if only_y or axes == ("y",) else "x"
    arrays = _read_arrays(file, along, reading)
    if axes is not None and axes[-1] not in (along, *_POINTS):
        arrays |= {name: arrays[name].T for name in arrays.keys() & _AS_SIGNAL}
    # Each point has the number of its pass; elsewhere ``repeat`` only counts rows.
    repeat = file.array(f"{_DATA}/repeat") if points and file.has(f"{_DATA}/repeat") else None
    if "branch" in arrays:
        arrays["branch"] = branch_numbers(file.where(f"{_DATA}/branch"), arrays["branch"])
    reference = None
    if file.has("/entry/reference"):
        reference = groups.read_profile(file, load=load["load"])
    contact = read_record(records.SAMPLE, file, "/entry/sample")
    contact["lubrication"] = contact.get("lubrication", "").strip().lower()
    return Scan(
        x=arrays.pop(along),
        y=arrays.pop("y", None),
        x_errors=arrays.pop(f"{along}_errors", None),
        repeat=repeat,
        direction=along,
        channels={name: arrays.pop(name) for name in _CHANNELS if name in arrays},
        **arrays,
        **load,
        unit=reading.si,
        **contact,
        **stated,
        reference=reference,
        noise_record=_read_record(file),
        synthetic=_read_synthetic(file),
        source=file.source,
    )


def _read_record(file: SafeFile) -> Scan | None:
    """Read the noise record that travels with a scan."""
    if not file.has(_NOISE):
        return None
    reading = reading_of(file.units_of(f"{_NOISE}/u_zz") or "V", file.where(_NOISE))
    return Scan(**_read_rest(file, _NOISE, reading))


def _read_rest(file: SafeFile, path: str, reading: Reading) -> Values:
    """Read a noise record: readings in time, at rest."""
    arrays = {}
    for name in ("time", "u_zz"):
        dimension = _DECLARED[name].read_in(reading).dimension
        arrays[name] = file.require_array(f"{path}/{name}", dimension, ndim=1)
    arrays["x"] = np.zeros(arrays["u_zz"].size)
    return {**arrays, "motion": "rest", "unit": reading.si}


def _read_arrays(file: SafeFile, along: str, reading: Reading) -> Values:
    """Read the positions and the readings; :class:`Scan` compares their shapes."""
    unused = {"repeat", "y_errors"} if along == "x" else {"repeat", "x", "x_errors"}
    arrays = read_record(records.TAKEN_FOR_GRANTED.read_in(reading), file, _DATA)
    for name, quantity in _DECLARED.items():
        path = f"{_DATA}/{quantity.key}"
        if name not in unused and (file.has(path) or name in (along, "u_zz")):
            ndim = len(quantity.axes) if name in _OWN_SHAPE else None
            dimension = quantity.read_in(reading).dimension
            arrays[name] = file.require_array(path, dimension, ndim=ndim)
    for name, ending in _LAYOUTS:
        x, y = (arrays.pop(f"layout_{axis}{ending}", np.nan) for axis in "xy")
        if np.ndim(x) or np.ndim(y):
            arrays[name] = np.column_stack(np.broadcast_arrays(x, y))
    if "reading_high" in arrays and "sensors" not in arrays:
        ceiling = file.only_number(f"{_DATA}/reading_high", arrays.pop("reading_high"))
        arrays["u_zz"], number = without_clipped(arrays["u_zz"], ceiling)
        arrays["at_ceiling"] = arrays.get("at_ceiling", 0) + number
    return arrays


def write_scan(scan: Scan, path: FilePath, *, overwrite: bool = False) -> None:
    """Write a scan as a memscal-scan file, whole or not at all.

    Parameters
    ----------
    scan : Scan
        The scan; its ``source`` is not written.
    path : path
        The file.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    OutputError
        If the file exists or cannot be written.

    Examples
    --------
    >>> import memscal, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_scan(memscal.simulate(points=33), f"{folder}/scan.h5")
    ...     read_scan(f"{folder}/scan.h5").kind
    'line'
    """
    writer.write_tree(
        writer.file_tree(writer.SCAN_SCHEMA, scan_entry(scan)), path, overwrite=overwrite
    )


def scan_entry(scan: Scan) -> Group:
    """Return the entry of a file that holds a scan."""
    children: Nodes = {"title": scan.title} if scan.title else {}
    children |= groups.circumstances(scan)
    children["data"] = _rest_group(scan) if scan.motion == "rest" else _data_group(scan)
    if scan.motion != "rest" or scan.indenter:
        children["indenter"] = groups.indenter_group(scan.indenter, scan)
    if scan.noise_record is not None:
        children["noise_record"] = _rest_group(scan.noise_record)
    children["sample"] = groups.sample_group(scan)
    children["instrument"] = groups.instrument_group(scan)
    if scan.notes:
        children["notes"] = writer.note(scan.notes)
    if scan.reference is not None:
        children |= groups.profile_groups(scan.reference)
    if scan.synthetic is not None:
        children["synthetic"] = _synthetic_group(scan.synthetic)
    return Group("NXentry", children, {"default": "data"})


def _data_group(scan: Scan) -> Group:
    along = scan.direction
    points = scan.kind == "points"
    forms = {"points": _POINTS, "line": (along,), "repeats": ("repeat", along)}
    axes = forms.get(scan.kind, ("y", "x"))
    data: Nodes = {"point": writer.index_axis("point", scan.x.size)} if points else {}
    if scan.sensors:
        data["sensor"] = writer.index_axis("sensor", len(scan.sensors))
    data |= _nodes(scan, axes if points else ("y",), y=scan.y)
    if scan.repeat is not None:
        data["repeat"] = writer.Number(scan.repeat, "1", axes)
    elif scan.kind == "repeats":
        data["repeat"] = writer.index_axis("repeat", scan.shape[0])
    if scan.branch is not None:
        data["branch"] = writer.Number(scan.branch, "1", axes, {"meaning": _BRANCHES})
    positions = {along: scan.x, f"{along}_errors": scan.x_errors}
    data |= _nodes(scan, axes if points else (along,), **positions)
    # What was at the end of the range is missing.
    stated = dict(vars(scan))
    for name in ("line_offset", "position_errors_by_repeat", "at_ceiling", "sensors"):
        stated[name] = stated[name] or None
    for name, ending in _LAYOUTS:
        if stated[name] is not None:
            stated[f"layout_x{ending}"], stated[f"layout_y{ending}"] = stated[name].T
    data |= write_record(records.TAKEN_FOR_GRANTED.read_in(scan.reading), stated).children
    data |= _nodes(scan, (), reading_high=scan.reading_high)
    data |= _nodes(scan, axes, u_zz=scan.u_zz)
    if scan.u_zz_correlation is not None:
        pairs = zip(_PAIRS, scan.u_zz_correlation.shape, strict=True)
        data |= {axis: writer.index_axis(axis, size) for axis, size in pairs}
        data |= _nodes(scan, _PAIRS, u_zz_correlation=scan.u_zz_correlation)
    like_signal = {name: getattr(scan, name) for name in LIKE_SIGNAL}
    data |= _nodes(scan, axes, **like_signal, **scan.channels)
    axes = ("sensor", *axes)[-scan.u_zz.ndim :]
    return Group("NXdata", data, {"signal": "u_zz", "axes": axes})


def _rest_group(record: Scan) -> Group:
    data = _nodes(record, ("time",), time=record.time, u_zz=record.u_zz)
    return Group("NXdata", data, {"signal": "u_zz", "axes": ("time",)})


def _nodes(scan: Scan, axes: Axes, **arrays: FloatArray | None) -> Nodes:
    """Return arrays along some axes; those with one more run along the sensors, too."""
    return {
        _DECLARED[name].key: si(
            array,
            _DECLARED[name].read_in(scan.reading).dimension,
            ("sensor", *axes)[-array.ndim :],
        )
        for name, array in arrays.items()
        if array is not None
    }


def _find_axes(file: SafeFile) -> Axes | None:
    """Return the axes of the readings as they are stored; none where the shape alone tells them."""
    shape = file.array(_SIGNAL).shape if file.has(_SIGNAL) else ()
    several = file.has(f"{_DATA}/sensor_names")
    present = tuple(name for name in "yx" if file.has(f"{_DATA}/{name}"))
    forms = [_POINTS, present[:1]]
    if len(shape) - several == 2:
        form = present if len(present) == 2 else ("repeat", *present)
        forms = [form] if several else [form, form[::-1]]
    if several:
        forms = [("sensor", *form) for form in forms]
    stated = set(_stated_axes(file, len(shape)))
    fitting = [form for form in forms if stated.issubset(enumerate(form))]
    if not fitting:
        words = ", ".join(f"{name} as axis {i}" for i, name in sorted(stated))
        raise FormatError(
            f"{file.where(_DATA)} states of its axes: {words}.",
            why="A scan is stored along [x], [repeat, x], [y], [repeat, y] or [point], or [y, x] "
            f"where {_DATA}/y makes it a raster; a square one that is turned would look right. An "
            f"array of sensors, with names in {_DATA}/sensor_names, has sensor before these.",
            cure="Transpose the data, or correct what states its axes.",
        )
    if len(fitting) == 1:
        return fitting[0][several:]
    if shape[several:-1] == shape[1 + several :] != ():
        raise FormatError(
            f"{file.where(_SIGNAL)} is as long as wide, and nothing states which axis is which.",
            cure=f"Add the attribute axes to {_DATA}, such as {list(form)}.",
        )
    return None


def _stated_axes(file: SafeFile, rank: int) -> Iterator[tuple[int, str]]:
    """Yield the name of each axis of the readings that a file states, in whatever way."""
    for path in (_DATA, _SIGNAL):
        names = file.attribute(path, "axes") if file.has(path) else None
        if isinstance(names, str):
            names = tuple(re.findall(r"[\w.]+", names))
        if not isinstance(names, tuple) or len(names) != rank:
            continue
        # A signal may have names of its own for its axes.
        if path == _DATA or not {"x", "y"}.isdisjoint(names):
            yield from enumerate(map(str, names))
    if rank > 1:  # of points all axes are one
        for name in ("x", "y", "repeat"):
            index = file.attribute(_DATA, f"{name}_indices")
            if isinstance(index, int):
                yield index, name
            for i in file.scaled_by(_SIGNAL, f"{_DATA}/{name}"):
                yield i, name


def _synthetic_group(truth: Mapping[str, float | str]) -> Group:
    values = {
        name: value if isinstance(value, str) else si(value, groups.parameter_dimension(name))
        for name, value in truth.items()
    }
    names = writer.to_json(list(truth))
    return Group("NXcollection", {"description": _SYNTHETIC, **values, "names": names})


def _read_synthetic(file: SafeFile) -> Values | None:
    path = "/entry/synthetic"
    if not file.is_group(path):
        return None
    truth = {}
    for name in file.text_list(f"{path}/names"):
        item = f"{path}/{name}"
        truth[name] = file.text(item) if file.is_text(item) else file.any_scalar(item)[0]
    return truth
