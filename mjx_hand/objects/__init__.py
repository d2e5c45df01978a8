"""Objects that hands hold: descriptions, distances, surface points, convex pieces."""
