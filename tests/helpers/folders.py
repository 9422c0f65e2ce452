"""Folders of files that tests read."""

from pathlib import Path

DATA = Path(__file__).parents[1] / "data"
SHIPPED = Path(__file__).parents[2] / "calibration_data"
