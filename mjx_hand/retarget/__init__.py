"""Recordings onto the hinges of the rigid hand."""
