"""``python -m bipot`` is the command ``bipot``, also where that is not on the path."""

import sys

from bipot.command import main

if __name__ == "__main__":
    sys.exit(main())
