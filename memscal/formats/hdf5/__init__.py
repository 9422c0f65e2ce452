"""HDF5 files: one safe reader and one writer, with HDF5's loading of plugins switched off."""

import os
import sys

# HDF5 loads and runs any shared library on its plugin path that claims a filter a file names.
# "::" turns this off, but only before the library starts; where the caller has imported
# h5py already the choice was theirs, and the reader's own list of filters still holds.
if "h5py" not in sys.modules:
    os.environ.setdefault("HDF5_PLUGIN_PRELOAD", "::")
