"""Radial profiles and the two-dimensional axisymmetric fields that they stand for."""
