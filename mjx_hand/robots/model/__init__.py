"""A robot hand's description as a model for physics: links, shapes, inertias, gains."""
