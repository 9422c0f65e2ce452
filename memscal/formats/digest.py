"""Schema of a safe file, and its digest."""

import re
from collections.abc import Iterator

from memscal.errors import FormatError, SchemaVersionError
from memscal.formats.hdf5 import writer
from memscal.formats.hdf5.reader import SafeFile
from memscal.formats.hdf5.writer import CONTENTS_PATH, SCHEMA_VERSION, VERSION_ATTRIBUTE
from memscal.model.arrays import Values


def require_schema(file: SafeFile, schema: str) -> str:
    """Return the schema version; refuse another schema or a newer major version."""
    stored = file.schema
    if stored != schema:
        held = "no memscal schema" if stored is None else f'the schema "{stored}"'
        cure = "Give the right file, or make one with `memscal import` or `memscal calibrate`."
        if stored == writer.ARRAY_SCHEMA:
            cure = (
                "It is that of an array of sensors, for `memscal locate` and memscal.load_array; "
                "an artifact of one of them is array.sensor(name)."
            )
        raise FormatError(
            f'{file.name} has {held}, but "{schema}" is needed here.',
            why=f"The root attribute {writer.SCHEMA_ATTRIBUTE} names what a file holds.",
            cure=cure,
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


_PATH = re.compile(r"/|(?:/[a-z][a-z0-9_]*)+")


def has_no_digest(file: SafeFile) -> bool:
    """Return whether a file has no digest and needs none: other programs write such, too."""
    needs_none = file.schema in (writer.SCAN_SCHEMA, writer.REFERENCE_SCHEMA, None)
    return needs_none and file.attribute("/", writer.DIGEST_ATTRIBUTE) is None


def require_unaltered(file: SafeFile) -> None:
    """Refuse a file whose content is not what was written; or record it, where that is accepted."""
    if file.verified or has_no_digest(file):
        return
    problem = altered(file)
    if problem:
        file.refuse_altered(problem)


def altered(file: SafeFile) -> str:
    """Return how a file differs from what was written, or ``""``; then only that can be read."""
    stated = file.attribute("/", writer.DIGEST_ATTRIBUTE)
    if stated is None:
        return f"its root attribute {writer.DIGEST_ATTRIBUTE} is missing"
    contents = file.json_value(CONTENTS_PATH, dict, None)
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
