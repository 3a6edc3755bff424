"""Linear models of motion near a state: what they are made of, their modes, what their inputs reach, and ways out to other packages."""
