"""How the documentation site is built: ``make docs``, or ``sphinx-build -W -n docs docs/_build/html``.

``-D plot_gallery=0`` leaves the examples of the gallery unexecuted.
"""

import os
import sys
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]

import bipot  # noqa: E402

project, author, release = "bipot", "The bipot developers", bipot.__version__
copyright = author

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
    "docstrings",
    "existing",
    "reference",
]
exclude_patterns = ["_build", "gallery/*.md5", "gallery/*.py", "gallery/*.ipynb", "gallery/*.zip"]
templates_path = []
nitpicky = True

myst_enable_extensions = ["deflist", "colon_fence"]
myst_heading_anchors = 3
# Two classes of one short name in an annotation (Limits) are no broken link; a missing one still is a warning.
suppress_warnings = ["config.cache", "ref.python"]

autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "signature"
autodoc_class_signature = "mixed"
# Arrays by the library's own names for them, which say the kind of their numbers.
autodoc_type_aliases = {name: name for name in ("Floats", "Ints", "Bools")}

sphinx_gallery_conf = {
    "examples_dirs": str(HERE.parent / "examples"),
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "download_all_examples": False,
    "reset_modules": ("matplotlib", "beside.own_file"),
    "show_memory": False,
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "copyfile_regex": r".*\.(msh|csv)$",
    "remove_config_comments": True,
}

html_theme = "pydata_sphinx_theme"
html_title = f"bipot {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "header_links_before_dropdown": 7,
    "navbar_persistent": ["search-button"],
    "navbar_end": ["theme-switcher"],
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_show_sourcelink = False
