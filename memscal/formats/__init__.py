"""Every file that is read or written: one safe reader, one atomic writer, units at the door."""
