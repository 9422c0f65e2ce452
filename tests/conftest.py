"""Settings for all tests."""

from __future__ import annotations

import os

# Before numpy loads: threads on matrices as small as ours cost ten times the work itself.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

from hypothesis import settings  # noqa: E402

# A deadline is a clock: on a busy machine it would fail what is right.
settings.register_profile("memscal", deadline=None, print_blob=True)
settings.load_profile("memscal")
