"""Build of the documentation site: `make docs`, or `python -m making build/docs` with docs/ on the path.

Committed pages (docs/, notebooks/, and pages written by tools) are copied with their paths, so that a link between two of
them is the same in the repository and in the site. Pages generated from the code are written beside them; Sphinx converts both to HTML.
"""
