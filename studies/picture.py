"""A picture of any run: a field on the deformed body with its tools, contact tractions, or an animation.

    python -m studies.picture RESULTS --field mises --at 0.3 [--by tau] [--out FILE]

RESULTS is a folder with ``run.vtkhdf``. ``--at`` is the reduction, or the pseudo-time of a run without one, and the
recorded increment nearest to it is drawn. The picture is put into the folder unless ``--out`` names another place; its
ending says the format, and ``.gif`` animates all steps. The same as ``bipot picture``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from bipot.command import add_picture_options, picture
from studies.command import command, say


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Draw, and say where it is."""
    parser = argparse.ArgumentParser(prog="studies.picture", description="Draw a run.", allow_abbrev=False)
    add_picture_options(parser)
    say(str(picture(parser.parse_args(argv))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
