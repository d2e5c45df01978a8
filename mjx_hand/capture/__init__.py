"""Recordings in: of markers, of keypoints, of datasets, simulated."""
