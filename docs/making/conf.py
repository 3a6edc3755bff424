"""Sphinx configuration of the site (`make docs`). `docs/making` first collects committed and generated pages in one folder."""

from pathlib import Path

import mathjax  # django-static-mathjax: MathJax as files, so that pages need no network

project = "PyCraft"
author = "the PyCraft authors"
copyright = author
html_title = "PyCraft"
root_doc = "docs/index"

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "sphinx_design", "making.docstrings"]
suppress_warnings = ["ref.python"]  # types in docstrings are prose, and some words are members of two classes

# ---- pages
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "attrs_inline"]
myst_heading_anchors = 4
nb_execution_mode = "cache"
nb_execution_cache_path = str(Path(__file__).parents[2] / "build" / "docs" / "notebooks")
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_ipywidgets_js = {}
nb_merge_streams = True

# ---- docstrings: plain text with the star of the adjoint; `docs/making/docstrings.py` defines their markup
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 90
autodoc_member_order = "bysource"
default_role = "code"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_custom_sections = [("Source", "notes_style"), ("Cost", "notes_style")]

# ---- looks
html_theme = "furo"
html_copy_source = False
html_show_sourcelink = False
html_static_path = ["../static", str(Path(mathjax.__file__).parent / "static/mathjax/es5/tex-svg-full.js")]
html_favicon = "../static/favicon.svg"
html_css_files = ["pycraft.css"]
html_js_files = [("search_in_files.js", {"priority": 200})]  # before Sphinx's own search requests pages
mathjax_path = "tex-svg-full.js"
mathjax3_config = {"svg": {"fontCache": "global", "scale": 0.95}, "tex": {"tags": "none"}}
pygments_style = "friendly"
pygments_dark_style = "monokai"
html_theme_options = {"navigation_with_keys": False}
