"""Monte Carlo over the stated inputs, and sweeps of the white noise."""
