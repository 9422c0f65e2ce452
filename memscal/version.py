"""The version of the program; the files' schemas have versions of their own."""

from __future__ import annotations

__version__ = "0.1.0"
