"""Scenes as videos and pictures, rendered off screen."""
