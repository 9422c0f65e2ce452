"""Public names of memscal.acquire, for type checkers."""

from memscal.extensions.acquisition.live_scan import LiveScan as LiveScan
from memscal.extensions.acquisition.positions import positions as positions
