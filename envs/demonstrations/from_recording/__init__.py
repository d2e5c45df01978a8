"""Demonstrations from a real recording: the grasp is searched for in the engine."""
