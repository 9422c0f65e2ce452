"""Radial profiles and their two-dimensional fields: Hankel transforms, grids, kernels."""
