"""Estimate of a radial profile from a scan, with its uncertainty, in data space."""
