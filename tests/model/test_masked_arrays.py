"""Readings that numpy or pandas mark as missing."""

import numpy as np
import pandas as pd
import pytest

import memscal
from memscal.errors import InputError

X = np.linspace(-6e-3, 6e-3, 13)
MASK = np.abs(X) == 1e-3
#: Under the mask stands what a detector that saturates would leave there.
U = np.where(MASK, 9.0, 2e-3 * np.exp(-((X / 2e-3) ** 2)))
MASKED = np.ma.array(U, mask=MASK)
NULLABLE = pd.array(np.where(MASK, np.nan, U), dtype="Float64")
LAYOUT = memscal.TableLayout(x_unit="m", u_unit="V")


@pytest.mark.parametrize("u", [MASKED, MASKED.astype("f4"), [*MASKED.tolist()], NULLABLE])
@pytest.mark.parametrize(
    "scan_of",
    [
        lambda u: memscal.Scan(x=X, u_zz=u),
        lambda u: memscal.Scan(x=X, u_zz=[u, u]),
        lambda u: memscal.Scan(x=X, u_zz=0 * X, channels={"u_xz": u}).channels["u_xz"],
        lambda u: memscal.Scan.from_arrays(X, u),
        lambda u: memscal.Scan.from_arrays(X, [u, u]),
        lambda u: memscal.import_table({"x": X, "u": u}, x="x", u="u", layout=LAYOUT),
        lambda u: memscal.import_table(pd.DataFrame({"x": X, "u": u}), x=1, u="u", layout=LAYOUT),
    ],
)
def test_a_masked_reading_is_missing(scan_of, u):
    scan = scan_of(u)
    read = np.atleast_2d(getattr(scan, "u_zz", scan))[-1]
    np.testing.assert_array_equal(np.isnan(read), MASK)
    np.testing.assert_allclose(read[~MASK], U[~MASK], rtol=1e-6)


@pytest.mark.parametrize(
    "make",
    [
        lambda masked: memscal.Scan(x=masked, u_zz=X),
        lambda masked: memscal.Scan(x=X, u_zz=X, repeat=masked.astype(int)),
        lambda masked: memscal.Scan(x=X, u_zz=X, branch=0 * masked.astype(int)),
        lambda masked: memscal.StressProfile(r=X - X[0], sigma_zz=masked, load=1.0),
        lambda masked: memscal.Profile(r=X - X[0], z=masked),
    ],
)
def test_what_cannot_be_missing_is_refused_where_it_is_masked(make):
    with pytest.raises(InputError, match=r"not finite|no whole numbers|names no branch"):
        make(MASKED)
