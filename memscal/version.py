"""The version of the program; the files' schemas have versions of their own."""

__version__ = "0.1.0"
