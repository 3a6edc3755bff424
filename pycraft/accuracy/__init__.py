"""Cost of accuracy: certificates of values, the accuracy table of a model, work and precision of integration."""
