"""Forms of keypoint files, one a module."""
