"""Settings for all tests."""

from __future__ import annotations

from hypothesis import settings

# A deadline is a clock: on a busy machine it would fail what is right.
settings.register_profile("memscal", deadline=None, print_blob=True)
settings.load_profile("memscal")
