"""Files that programs of acquisition record: HDF5 and NeXus, TDMS, SPEC and Bluesky."""
