"""Fleets: many scans calibrated in shards, their tables, summary and figure."""
