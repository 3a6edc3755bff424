"""Other tools' conventions: Pinocchio, MuJoCo, SciPy. The only place that knows them."""
