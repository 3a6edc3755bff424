"""The models on which a conjecture is true: chains and trees, with and without rotors, of every kind of hinge."""

import pycraft as pc

pc.truth("Ω = Υ + ψ̃*Υ + Υψ̃", smallest_case=False).plot()
