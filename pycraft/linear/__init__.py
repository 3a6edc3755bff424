"""Linear models of motion near a state: construction, modes, controllability and observability, export to other packages."""
