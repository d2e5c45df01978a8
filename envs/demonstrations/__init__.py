"""Demonstration sets: made, checked, shown."""
