"""The files of a run: ``run.vtkhdf``, fields for ParaView and for resuming, and ``history.csv``, a row per increment.

:func:`open` reads fields and rows from the first file. :class:`Recorder` writes both such that what is recorded stays
readable whatever happens to the process or the disk.
"""

from bipot.results.existing import Existing
from bipot.results.history import History, open
from bipot.results.recorder import Recorder

__all__ = ["Existing", "History", "Recorder", "open"]
