"""Tables of numbers from other programs."""
