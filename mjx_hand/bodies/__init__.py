"""Hands as physics and learning have them, human and robot."""
