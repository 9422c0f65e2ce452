"""Readings in motion: sliding contacts, sensors that are slow, and creep."""
