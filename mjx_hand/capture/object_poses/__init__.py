"""Poses of recorded objects: from files, from clusters of markers, from data sets."""
