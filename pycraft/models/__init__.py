"""Models: the multibody system, loaders (URDF, MJCF), generators and the robots that come with the package."""
