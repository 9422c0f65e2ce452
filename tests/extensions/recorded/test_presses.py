"""Presses of a log without positions: the n-th lies n steps from the first, or all is refused."""

import numpy as np
import pytest

from memscal import TableLayout, import_table
from memscal.errors import InputError

ONE = np.concatenate([np.zeros(20), [0.3, 0.7], np.ones(20), [0.6, 0.2]])
LAYOUT = TableLayout(u_unit="mV", holds=True, step=0.5e-3)


@pytest.mark.parametrize("named", [{"load_column": "F"}, {"depth": "F"}])
@pytest.mark.parametrize("wait", [0, 200])
def test_the_nth_hold_lies_n_steps_from_the_first(named, wait):
    press = np.append(np.zeros(wait), np.tile(ONE, 5))
    noisy = press + np.random.default_rng(1).normal(0, 0.02, press.size)
    table = {"F": noisy, "U": press * np.append(np.zeros(wait), np.arange(5.0).repeat(ONE.size))}
    found = import_table(table, u="U", **named, layout=LAYOUT)
    np.testing.assert_allclose([found.x, found.u_zz], np.outer([5e-4, 1e-3], np.arange(5)))
    table["F"][wait + 93] += 1.0
    with pytest.raises(InputError, match="6 presses that are counted"):
        import_table(table, u="U", **named, layout=LAYOUT)
