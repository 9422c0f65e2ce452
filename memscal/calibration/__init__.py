"""The steps of a calibration between the estimated profile and the artifact."""
