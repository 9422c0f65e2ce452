"""Units at the door: the table, pint behind it, and what is refused."""

import numpy as np
import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from memscal.errors import UnitError
from memscal.formats import units
from memscal.formats.units import dimension_of, from_si, to_si
from memscal.model.quantities import DIMENSIONS

PINT = pint.UnitRegistry()


@pytest.mark.parametrize("unit", sorted({*units._CANONICAL} - {"", *units.ARBITRARY}))
def test_the_table_agrees_with_pint(unit):
    dimension, power = units._CANONICAL[unit]
    stated = DIMENSIONS[dimension].si
    si = "dimensionless" if stated == "1" else stated
    quantity = PINT.Quantity(1.0, PINT.parse_units("dimensionless" if unit == "1" else unit))
    assert quantity.to(si).magnitude == pytest.approx(10.0**power, rel=1e-12)


@pytest.mark.parametrize(("value", "unit", "dimension", "si"), [
    (0.25, "mm", "length", 0.25e-3), (561.0, "um", "length", 561e-6),
    (128.8, "mm", "length", 128.8e-3), (3.1, "mV", "voltage", 3.1e-3),
    (2.2, "MPa", "stress", 2.2e6),
])  # fmt: skip
def test_decimal_numbers_are_read_as_python_would_write_them_in_si(value, unit, dimension, si):
    assert to_si(value, unit, dimension, "here") == si


@pytest.mark.parametrize(("unit", "dimension", "factor"), [
    ("inch", "length", 0.0254), ("micrometer", "length", 1e-6),
    ("psi", "stress", 6894.757293168361), ("bar", "stress", 1e5), ("N/mm^2", "stress", 1e6),
    ("N / mm ** 2", "stress", 1e6), ("pound_force", "force", 4.4482216152605),
    ("mm**-2", "per area", 1e6), ("cm^-1", "wavenumber", 100.0),
    ("radian/millimeter", "wavenumber", 1e3), ("mV/bar", "voltage per stress", 1e-8),
    ("percent", "dimensionless", 0.01), ("mm/m", "dimensionless", 1e-3),
])  # fmt: skip
def test_other_units_are_converted_as_tables_of_units_say(unit, dimension, factor):
    assert to_si(2.0, unit, dimension, "here") == pytest.approx(2 * factor, rel=1e-12)
    assert dimension_of(unit, "here") == dimension


@pytest.mark.parametrize(
    "unit",
    [
        "9**9**9**9",
        "m**99999999",
        "mm" * 100,
        "__import__('os')",
        "m; rm",
        "(" * 40,
        "m**(9**9)",
        "1e300*m",
        "\x1b[2Jm",
        "mm mm mm mm V",
        "degC",
    ],
)
def test_text_that_is_no_unit_of_length_is_refused_at_once(unit):
    with pytest.raises(UnitError, match="here") as caught:
        to_si(1.0, unit, "length", "here")
    assert "\x1b" not in str(caught.value)


@pytest.mark.parametrize("dimension", [d for d in DIMENSIONS if d != "dimensionless"])
def test_only_a_dimensionless_number_may_be_bare(dimension):
    with pytest.raises(UnitError, match="has no unit") as caught:
        to_si(1.0, None, dimension, "scan.h5: /entry/x")
    assert DIMENSIONS[dimension].stored in caught.value.cure
    assert to_si(0.5, None, "dimensionless", "here") == 0.5


@given(st.floats(1e-100, 1e100), st.sampled_from(sorted(DIMENSIONS)))
def test_what_a_writer_converts_a_reader_converts_back(value, dimension):
    stored, unit = from_si(value, dimension)
    np.testing.assert_allclose(to_si(stored, unit, dimension, ""), value, rtol=4.5e-16)


@pytest.mark.parametrize("unit", ["km", "furlong"])
def test_a_value_that_no_number_holds_in_si_is_infinite_without_a_warning(unit):
    assert to_si(np.finfo(np.float64).max, unit, "length", "x") == np.inf
