"""Hands frame by frame, as trackers list them, and which of them are one hand."""
