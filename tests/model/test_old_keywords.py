"""Old keywords go into the records that hold them now."""

import warnings
from dataclasses import dataclass

import pytest

from memscal.model.old_keywords import with_old_keywords


@dataclass(frozen=True)
class Noise:
    """Two numbers."""

    noise: float = 0.0
    drift: float = 0.0


@dataclass(frozen=True)
class Units:
    """One word."""

    unit: str = "V"


def test_old_keywords_change_the_records_that_hold_them_and_are_warned_of():
    with pytest.warns(DeprecationWarning, match="becomes") as caught:
        noise, units = with_old_keywords(
            "scan",
            {"drift": 0.2, "unit": "mV"},
            noise=Noise(noise=0.1),
            units=Units(),
            stacklevel=2,
        )
    assert (noise, units) == (Noise(noise=0.1, drift=0.2), Units(unit="mV"))
    assert str(caught[0].message) == "scan(drift=...) becomes scan(noise=Noise(drift=...))."
    assert caught[0].filename == __file__


def test_without_old_keywords_nothing_is_said():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert with_old_keywords("scan", {}, noise=Noise()) == [Noise()]


def test_a_keyword_that_never_was_is_refused_as_python_does():
    with pytest.raises(TypeError, match=r"scan\(\) got an unexpected keyword argument 'colour'"):
        with_old_keywords("scan", {"colour": "red"}, noise=Noise())
