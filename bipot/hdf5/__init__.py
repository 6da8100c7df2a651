"""HDF5 files of others: what they declare is checked before it is read."""
