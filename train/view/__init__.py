"""Rollouts as scenes and videos."""
