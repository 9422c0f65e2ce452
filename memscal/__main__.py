"""``python -m memscal`` is the command ``memscal``."""

from __future__ import annotations

import sys

from memscal.cli import main

if __name__ == "__main__":
    sys.exit(main())
