"""Every file that is read or written: one safe HDF5 reader, one atomic writer, units at the door."""
