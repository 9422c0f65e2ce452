"""Scans of an array of three sensors under one film."""

from dataclasses import replace

import numpy as np
from helpers.builders import make_scan

from memscal import Scan

NAMES = ("T00", "T01", "µ 2")


def make_array_scan(kind: str = "line", **changes) -> Scan:
    """Three sensors that read 1, 2 and 3 times the scan of one of them."""
    one = make_scan(kind)
    stated = {
        "u_zz": np.multiply.outer([1.0, 2.0, 3.0], one.u_zz),
        "u_zz_errors": [1e-5, 2e-5, 3e-5],
        "sensors": NAMES,
        "layout": [[-2e-3, 0], [0, 0], [2e-3, 1e-4]],
        "layout_uncertainty": 1e-5,
        "used": [True, True, False],
        "reading_low": -1.0,
        "reading_high": [3.3, 3.3, 5.0],
        "board": [0, 0, 1],
        "channels": {},
    }
    return replace(one, **{**stated, **changes})
