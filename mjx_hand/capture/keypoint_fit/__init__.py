"""Shape, wrist and rotations from keypoints."""
