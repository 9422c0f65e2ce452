"""Simulation: synthetic scans from a known truth, which is stored with them."""
