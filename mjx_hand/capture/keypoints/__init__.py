"""Keypoints of a hand: names, layouts, sizes, times, side."""
