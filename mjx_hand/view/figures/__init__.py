"""Figures of errors, fits, skins and learning curves."""
