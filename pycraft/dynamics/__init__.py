"""The direct calls: dynamics, sensitivities, Jacobians and trajectories of a model, numbers without algebra."""
