"""What a scan that is not made yet would tell: its expected uncertainties, without simulation."""
