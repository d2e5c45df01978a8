"""Recordings of known truth: simulated markers and keypoints, and what goes wrong in real ones."""
