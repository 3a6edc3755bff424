"""The command line: its commands, the tour, the bench."""
