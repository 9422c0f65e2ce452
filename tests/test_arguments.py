"""Names that a function does not have are refused, and the nearest one is named."""

from typing import get_args

import pytest

import memscal
from memscal.deconvolution.division import MethodName, create_regulariser, regulariser_names
from memscal.model.film import LAWS, FilmLaw


@pytest.mark.parametrize(
    ("function", "arguments", "words"),
    [
        (
            "calibrate",
            {"methd": "bayesian"},
            r"calibrate\(\) has no argument methd.\nDid you mean m",
        ),
        ("calibrate_many", {"methd": "bayesian"}, "Did you mean method"),
        (
            "calibrate_many",
            {"method": "baysian"},
            "no method named baysian.\nDid you mean bayesian",
        ),
        ("compare", {"loadings": "total"}, "Did you mean loading"),
        ("restore", {"lod": 1.0}, "Did you mean load"),
        ("indent", {"backnd": "fem"}, "Did you mean backend"),
        ("import_table", {"layuot": None}, "Did you mean layout"),
        ("simulate", {"sed": 1}, "Did you mean seed"),
        ("simulate", {"noise": 0.1}, "no argument noise"),
        ("simulate_experiment", {"sed": 1}, "Did you mean seed"),
        ("monte_carlo", {"draw": 1}, "Did you mean draws"),
        ("design", {"stp": 1e-3}, "Did you mean step"),
        ("divide", {"amplitud": 1.0}, "divide.. has no argument amplitud"),
    ],
)
def test_the_nearest_name_is_given_in_place_of_a_wrong_one(function, arguments, words):
    with pytest.raises(memscal.MemscalError, match=words):
        getattr(memscal, function)(*([],) * (function != "simulate"), **arguments)


def test_an_option_of_a_method_and_of_arrays_is_checked_by_its_name():
    with pytest.raises(
        TypeError, match=r"tikhonov has no option amplitud.\nDid you mean amplitude"
    ):
        memscal.calibrate(memscal.simulate(), method="tikhonov", options={"amplitud": 2.0})
    with pytest.raises(TypeError, match=r"x_units.\nDid you mean x_unit"):
        memscal.Scan.from_arrays([0.0], [1.0], x_units="mm")


def test_the_words_that_types_name_are_those_there_are():
    assert {create_regulariser(name).name for name in get_args(MethodName)} <= {
        *regulariser_names()
    }
    assert {*regulariser_names()} <= {*get_args(MethodName)}
    assert get_args(FilmLaw) == LAWS


def test_arrays_take_what_the_records_of_a_table_hold():
    # Sheets, separators and rows to skip are of files, a layout of several columns.
    of_files = {"layout", "sheet", "scan", "skip_rows", "missing", "delimiter", "decimal"}
    records = (memscal.TableLayout, memscal.ScanConditions, memscal.ScanUncertainties)
    held = {name for record in records for name in record.__dataclass_fields__}
    taken = memscal.model.scan.ArrayOptions.__annotations__
    assert held - of_files <= taken.keys()
    assert taken.keys() - held == {*memscal.formats.tables.scan.ARRAYS}
