"""Measurement with a calibrated sensor: from voltages to the stress at the film's base."""
