"""Cost of accuracy, as tables and pictures: ways of computing forward dynamics, work and precision of integration."""
