"""Measures this machine: engines, solver settings, projection, retargeting."""
