"""Plots, videos, the browser's viewer, reports."""
