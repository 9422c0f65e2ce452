"""The history of a sensor: whether it has changed, and when it is to be calibrated again."""
