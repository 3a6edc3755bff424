"""Models: the multibody system, loaders (URDF, SDF, MJCF, TOML), generators and the robots of the package."""
