"""The frozen dataclasses that the data live in: no input or output, no algorithms."""
