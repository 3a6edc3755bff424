"""What accuracy costs in time, as tables and pictures: ways of computing forward dynamics, work and precision of integration."""
