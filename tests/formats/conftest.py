"""Files of formats are written into an empty folder."""

import pytest


@pytest.fixture(autouse=True)
def _work_in_an_empty_folder(folder):
    """Begin each test in a folder of its own."""
