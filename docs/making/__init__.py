"""What the site is made of: `make docs`, or `python -m making build/docs` with docs/ on the path.

Pages that are committed (docs/, notebooks/, and those that the tools wrote) are copied with their places, so that a link between two of
them is the same in the repository and in the site; pages that follow from the code are written beside them; Sphinx makes both HTML.
"""
