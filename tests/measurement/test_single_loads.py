"""A scan taken apart by load: nothing is lost, nothing is mixed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.builders import make_scan
from helpers.contacts import LOADS, contact_scan

from memscal.errors import InputError
from memscal.measurement.measured_profile import single_loads
from memscal.model.provenance import SourceFile


def test_every_line_goes_to_the_part_of_its_load() -> None:
    scan = contact_scan(repeats=2, record_loads=True)
    parts = single_loads(scan)
    np.testing.assert_allclose([part.load for part in parts], LOADS, rtol=0.02)
    assert scan.normal_load is not None
    together = np.concatenate([part.scan.u_zz for part in parts])
    assert np.sort(together, axis=None).tolist() == np.sort(scan.u_zz, axis=None).tolist()
    for part in parts:
        assert part.scan.u_zz.shape == (2, scan.x.size)
        assert part.scan.normal_load is not None
        assert np.all(np.abs(part.scan.normal_load / part.load - 1) < 0.15)


def test_the_common_uncertainty_of_the_load_grows_with_the_load() -> None:
    scan = contact_scan(load_uncertainty=0.01)
    spreads = [part.scan.load_uncertainty for part in single_loads(scan)]
    np.testing.assert_allclose(spreads, 0.01 * np.array(LOADS), rtol=1e-12)


@pytest.mark.parametrize("kind", ["line", "repeats", "raster"])
def test_a_scan_that_records_no_load_is_one_part(kind: str) -> None:
    scan = make_scan(kind, normal_load=None)
    [part] = single_loads(scan)
    assert part.scan is scan
    assert (part.load, part.label) == (1.0, "1 N")


@pytest.mark.parametrize("kind", ["line", "raster"])
def test_a_line_or_a_raster_has_one_load(kind: str) -> None:
    [part] = single_loads(make_scan(kind))
    assert part.load == pytest.approx(1.01)


def test_a_line_at_several_loads_is_refused_by_its_number() -> None:
    scan = contact_scan()
    assert scan.normal_load is not None
    loads = scan.normal_load.copy()
    loads[2, :5] = 0.5
    mixed = replace(scan, normal_load=loads, source=SourceFile("mixed.h5", ""))
    with pytest.raises(InputError, match=r"mixed\.h5, line 3: its loads go from 0\.5 to 1\.37 N"):
        single_loads(mixed)


def test_a_line_without_any_load_is_refused_by_its_number() -> None:
    scan = contact_scan()
    assert scan.normal_load is not None
    loads = scan.normal_load.copy()
    loads[1] = np.nan
    with pytest.raises(InputError, match="line 2: every load is missing"):
        single_loads(replace(scan, normal_load=loads))
