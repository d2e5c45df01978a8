"""Marker recordings and marker sets: labels, places on the hand, gaps, outliers."""
