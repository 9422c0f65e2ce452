"""Readings of a scan, before anything is fitted: holds of a log, places, lengths and units."""
