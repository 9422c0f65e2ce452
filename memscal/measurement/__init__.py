"""Measuring with a calibrated sensor: from voltages back to the stress at the film's base."""
