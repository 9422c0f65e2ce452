"""``python -m memscal`` is the command ``memscal``."""

import sys

from memscal.cli import main

if __name__ == "__main__":
    sys.exit(main())
