"""Damaged files, made from valid ones, and a child process that reads them: what must be refused, in words.

``hdf5`` damages a dataset of any HDF5 file and ``whole`` any file as a whole: for a reader of another format they need
a valid file and the name of a dataset. ``fclib``, ``tables`` and ``archives`` hold what only these formats can have
wrong. ``child`` reads them by a function that is named as ``module:function``; ``python -m tests.corpus.flips`` flips
bits of valid files and tells what came of it.
"""
