"""Learning, its states on disk, and what a training survives."""
