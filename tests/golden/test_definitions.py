"""The application definitions that ship are those of the declared records."""

from golden.definitions import DEFINITIONS, FOLDER, definition, path_of

from memscal.formats.hdf5.writer import DEFINED


def test_the_definitions_say_what_the_records_declare():
    # After a change of a record: python tests/golden/definitions.py
    assert set(DEFINITIONS) == set(DEFINED)
    assert {path_of(kind).name for kind in DEFINED} == {path.name for path in FOLDER.glob("*.xml")}
    stale = [k for k in DEFINED if path_of(k).read_text(encoding="utf-8") != definition(k)]
    assert stale == []
