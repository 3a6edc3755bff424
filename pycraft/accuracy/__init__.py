"""What accuracy costs: trajectories, errors and times of the ways to compute."""
