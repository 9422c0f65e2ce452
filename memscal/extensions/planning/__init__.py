"""Planning of a scan: its expected uncertainties, without simulation."""
