"""Examples of the gallery find the files beside them, as scripts do: sphinx-gallery gives them no ``__file__``."""

import builtins


def own_file(gallery_conf, path):
    """Called before each example: what a module does not define is looked for among the builtins."""
    builtins.__file__ = path
