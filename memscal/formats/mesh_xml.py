"""XML of a mesh file, parsed without anything that XML can be made to do."""

from __future__ import annotations

from typing import NoReturn
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from memscal.errors import FormatError, UnsafeFileError

__all__ = ["parse_xml"]

# A mesh has a few dozen elements; its numbers are the text inside them.
_MAX_ELEMENTS = 20_000
_MAX_DEPTH = 50


def parse_xml(data: bytes, name: str) -> Element:
    """Return the root element of an XML file that declares no entities.

    A document type is allowed, because XDMF files name one; it is never fetched.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        Its name, for messages.

    Raises
    ------
    UnsafeFileError
        If it declares or uses an entity, or has an absurd number of elements.
    FormatError
        If it is not XML, or ends too early.

    Examples
    --------
    >>> parse_xml(b"<VTKFile><Piece>1 2</Piece></VTKFile>", "film.vtu")[0].text
    '1 2'
    >>> parse_xml(b'<!DOCTYPE a [<!ENTITY b "ha">]><a>&b;</a>', "film.vtu")
    Traceback (most recent call last):
    ...
    memscal.errors.UnsafeFileError: film.vtu declares an XML entity...
    """
    builder = TreeBuilder()
    parser = expat.ParserCreate()
    parser.buffer_text = True
    elements = depth = 0

    def refuse_entity(*_: object) -> NoReturn:
        raise UnsafeFileError(
            f"{name} declares an XML entity, or uses one that is not declared.",
            why="An entity can stand for another file, or for gigabytes of text.",
            cure="Save the mesh again from the program that wrote it: no mesh needs entities.",
        )

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal elements, depth
        elements, depth = elements + 1, depth + 1
        if elements > _MAX_ELEMENTS or depth > _MAX_DEPTH:
            raise UnsafeFileError(
                f"{name} has more than {_MAX_ELEMENTS:,} XML elements, or more than {_MAX_DEPTH} "
                "inside each other.",
                why="A mesh has a few dozen.",
                cure="Check that it is the right file.",
            )
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = refuse_entity
    parser.SkippedEntityHandler = refuse_entity
    parser.ExternalEntityRefHandler = refuse_entity
    try:
        parser.Parse(data, True)
        return builder.close()
    except (expat.ExpatError, AssertionError, LookupError, ValueError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(
            f"{name} cannot be read as XML: {error}.",
            why="The file is damaged or incomplete, or not what its name says.",
            cure="Get the file again from where it came from.",
        ) from error
