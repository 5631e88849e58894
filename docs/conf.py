"""Settings of Sphinx: `make docs` builds the pages into docs/_build/html, without any network."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import ilg_circuit

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

project = "ilg_circuit"
author = "ilg_circuit contributors"
release = version = ilg_circuit.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_copybutton",
    "sphinx_design",
    "gallery",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "from_code",
    "strip_page",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "gallery/*.ipynb", "gallery/*.py", "gallery/*.zip", "**/README.md"]
nitpicky = False
default_role = "code"
html_math_renderer = "mathml"
smartquotes = False

myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4

add_module_names = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True  # attributes are fields of a class; its properties describe themselves

html_theme = "pydata_sphinx_theme"
html_title = "ilg_circuit"
html_static_path = ["_static"]
html_css_files = ["ilg.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "show_nav_level": 1,
    "navigation_depth": 2,
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
}
html_sidebars = {"index": [], "tutorial/*": [], "genindex": [], "search": []}
copyright = "ilg_circuit contributors, GPL-3.0-or-later"

sphinx_gallery_conf = {
    "examples_dirs": str(HERE / "_build" / "examples"),
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"__",
    "within_subsection_order": "gallery.example_order",
    "image_scrapers": ("gallery.pictures",),
    "reset_modules": ("matplotlib",),
    "capture_repr": (),
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 3600,
    "plot_gallery": "True",
    "abort_on_example_error": True,
    "write_computation_times": False,
    "thumbnail_size": (480, 320),
    "image_srcset": ["2x"],
}
