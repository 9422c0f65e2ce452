"""Sizes up to which memscal works, checked before any work; docs/sizes.md states them."""

from memscal.errors import InputError

#: Points that a calibration takes: of lines, of a raster, and with a stated correlation of noise,
#: of which the cube of their number is worked with.
MOST_OF_LINES = 2_000_000
MOST_OF_RASTER = 1_000_000
MOST_CORRELATED = 4_000
#: Points of one load of a contact, and where their noise is correlated; of all loads that are
#: compared; and readings of one load that share noise, by a correlation or with the shear: of each
#: coefficient there is a matrix over them.
MOST_OF_CONTACT = 100_000
MOST_OF_CORRELATED_CONTACT = 2_000
MOST_COMPARED = 25_000
MOST_COMPARED_TOGETHER = 500
#: Rows and columns of a table, and pixels along a side of a reference that is a field.
MOST_ROWS = 20_000_000
MOST_COLUMNS = 1_000
MOST_PIXELS = 2_048
#: Tags of XML in the sheets of a workbook (four for a cell), and in all else of it: of each of them
#: a reader makes an object.
MOST_TAGS = 3_000_000
MOST_OTHER_TAGS = 300_000
#: Bytes of a table, of an HDF5 file and of all that is held of one, of one array in it as it is
#: held, and of any other file (a mesh, an image).
MOST_TABLE_BYTES = 2**32
MOST_HDF5_BYTES = 2**30
MOST_ARRAY_BYTES = 8 * MOST_ROWS
MOST_FILE_BYTES = 2**28


def too_large(
    what: str,
    size: int,
    most: int,
    of: str,
    *,
    cure: str,
    why: str = "",
    error: type[InputError] = InputError,
) -> InputError:
    """Return the error for what exceeds a size: it states the size, the limit and what to do."""
    return error(f"{what} has {size:,} {of}, but at most {most:,} are taken.", why=why, cure=cure)
