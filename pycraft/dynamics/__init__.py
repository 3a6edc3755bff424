"""The direct calls: dynamics, sensitivities, Jacobians and trajectories of a model, values without algebra."""
