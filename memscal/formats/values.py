"""Single values of a safe file by kind, its schema, and its digest."""

import json
import math
import re
from collections.abc import Iterator
from typing import Any

from memscal.errors import FormatError, InputError, SchemaVersionError
from memscal.formats.hdf5 import writer
from memscal.formats.hdf5.reader import SafeFile
from memscal.formats.hdf5.writer import CONTENTS_PATH, SCHEMA_VERSION, VERSION_ATTRIBUTE
from memscal.formats.units import dimension_of, to_si
from memscal.model.arrays import FloatArray, Values
from memscal.model.quantities import DIMENSIONS

_MAX_ITEMS = 10_000


def require_schema(file: SafeFile, schema: str) -> str:
    """Return the schema version; refuse another schema or a newer major version."""
    stored = file.attribute("/", writer.SCHEMA_ATTRIBUTE)
    if stored != schema:
        held = "no memscal schema" if stored is None else f'the schema "{stored}"'
        raise FormatError(
            f'{file.name} has {held}, but "{schema}" is needed here.',
            why=f"The root attribute {writer.SCHEMA_ATTRIBUTE} names what a file holds.",
            cure="Give the right file, or make one with `memscal import` or `memscal calibrate`.",
        )
    version = str(file.attribute("/", VERSION_ATTRIBUTE) or "")
    major = version.partition(".")[0]
    if not re.fullmatch("[0-9]{1,9}", major):
        raise FormatError(
            f'{file.name} has the schema version "{version[:80]}", which is not a version.',
            cure=f'Set the root attribute {VERSION_ATTRIBUTE}, such as "{SCHEMA_VERSION}".',
        )
    newest = SCHEMA_VERSION.partition(".")[0]
    if int(major) > int(newest):
        raise SchemaVersionError(
            f"{file.name} was written by a newer memscal: {schema} version {version}.",
            why=f"This memscal reads versions up to {newest}.x and would misread it.",
            cure="Upgrade memscal.",
        )
    if int(major) < int(newest):
        raise SchemaVersionError(
            f"{file.name} has {schema} version {version}, which is not read any more.",
            cure="Write it again with the current memscal.",
        )
    return version


def units_of(file: SafeFile, path: str) -> str | None:
    """Return the unit that stands at a path, or ``None``."""
    units = file.attribute(path, "units")
    if isinstance(units, tuple) and len(units) == 1:
        units = units[0]
    return None if units is None else str(units)


def require_array(
    file: SafeFile, path: str, dimension: str, *, ndim: int | None = None
) -> FloatArray:
    """Return the array at a path in SI units."""
    if not file.has(path):
        raise FormatError(
            f"{file.where(path)} is missing.",
            why=f"It should hold a {dimension}.",
            cure=f'Write it, with an attribute units such as "{DIMENSIONS[dimension].si}".',
        )
    values = file.array(path)
    if ndim is not None and values.ndim != ndim:
        raise FormatError(
            f"{file.where(path)} has {values.ndim} dimensions, but {ndim} are expected.",
            cure="Check the shape of the array.",
        )
    return to_si(values, units_of(file, path), dimension, file.where(path))


def require_scalar(file: SafeFile, path: str, dimension: str) -> float:
    """Return the one number at a path in SI units; an array of one is accepted."""
    return only_number(file, path, require_array(file, path, dimension))


def only_number(file: SafeFile, path: str, values: FloatArray) -> float:
    """Return the one number that is stored at a path."""
    if values.size != 1:
        raise FormatError(
            f"{file.where(path)} has {values.size} values, but one number is expected."
        )
    return values.item()


def any_scalar(file: SafeFile, path: str) -> tuple[float, str]:
    """Return a number of any dimension in SI units, with its SI unit."""
    dimension = dimension_of(units_of(file, path) or "1", file.where(path))
    return require_scalar(file, path, dimension), DIMENSIONS[dimension].si


def require_text(file: SafeFile, path: str) -> str:
    """Return the text at a path."""
    if not file.has(path):
        raise FormatError(f"{file.where(path)} is missing.", why="It should hold text.")
    return file.text(path)


def optional_text(file: SafeFile, path: str) -> str:
    """Return the text at a path, empty where there is none."""
    return file.text(path) if file.has(path) else ""


def _finite(text: str) -> float:
    """Return a number of JSON, which has no others."""
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is no finite number")
    return number


def json_value(file: SafeFile, path: str, kind: type[list[Any] | Values], default: Any) -> Any:
    """Return JSON of a given type (``list`` or ``dict``), or the default where there is none."""
    if not file.has(path):
        return default
    try:
        value = json.loads(file.text(path), parse_constant=_finite, parse_float=_finite)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{file.where(path)} is not JSON: {error}.", cure="Write the file again."
        ) from error
    if not isinstance(value, kind):
        raise FormatError(f"{file.where(path)} should hold a JSON {kind.__name__}.")
    if len(value) > _MAX_ITEMS:
        raise FormatError(f"{file.where(path)} lists {len(value):,} items.")
    return value


def text_list(file: SafeFile, path: str) -> list[str]:
    """Return the texts of a JSON list, such as names; none where there is no list."""
    return [str(text) for text in json_value(file, path, list, [])]


_PATH = re.compile(r"/|(?:/[a-z][a-z0-9_]*)+")


def has_no_digest(file: SafeFile, schema: str | None) -> bool:
    """Return whether a file has no digest and needs none: other programs write such, too."""
    needs_none = schema in (writer.SCAN_SCHEMA, writer.REFERENCE_SCHEMA, None)
    return needs_none and file.attribute("/", writer.DIGEST_ATTRIBUTE) is None


def require_unaltered(file: SafeFile, schema: str | None) -> None:
    """Refuse a file whose content is not what was written; or record it, where that is accepted."""
    if file.verified or has_no_digest(file, schema):
        return
    problem = altered(file)
    if problem:
        file.refuse_altered(problem)


def altered(file: SafeFile) -> str:
    """Return how a file differs from what was written, or ``""``; then only that can be read."""
    stated = file.attribute("/", writer.DIGEST_ATTRIBUTE)
    if stated is None:
        return f"its root attribute {writer.DIGEST_ATTRIBUTE} is missing"
    contents = json_value(file, CONTENTS_PATH, dict, None)
    if contents is None:
        return f"the list of its contents ({CONTENTS_PATH}) is missing"
    missing = [path for path in contents if not (_PATH.fullmatch(path) and file.has(path))]
    if missing:
        return f"{missing[0]} is missing"
    if writer.content_digest(stored_items(file, contents)) != stated:
        return "its content does not fit its digest"
    file.limit_to(contents)
    return ""


def stored_items(file: SafeFile, contents: Values) -> Iterator[writer.DigestItem]:
    """Yield what the list of contents names, as it stands in the file."""
    for path, names in sorted(contents.items()):
        if not isinstance(names, list):
            raise FormatError(f"{file.where(CONTENTS_PATH)} does not list attributes for {path}.")
        attributes = {str(name): file.attribute(path, str(name)) for name in names}
        if file.is_group(path):
            yield path, None, attributes
        elif file.is_text(path):
            yield path, file.text(path), attributes
        else:
            yield path, file.array(path), attributes
