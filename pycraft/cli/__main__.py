"""`python -m pycraft.cli`: the command line without its script."""

from .commands import app

app()
