"""What a run leaves behind: ``run.vtkhdf``, its fields for ParaView and for going on, and ``history.csv``, a row an increment.

:func:`open` reads both from the first; :class:`Recorder` writes them so that what is recorded stays readable, whatever
happens to the process or the disk.
"""

from bipot.results.history import History, open
from bipot.results.recorder import Existing, Recorder

__all__ = ["Existing", "History", "Recorder", "open"]
