"""A scan while it is recorded: the order of its places, and its calibration as readings arrive."""

from memscal.extensions import hook

positions = hook("positions")
LiveScan = hook("LiveScan")
