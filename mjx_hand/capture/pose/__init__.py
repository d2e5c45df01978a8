"""What the fits of markers and of keypoints share: joint ranges, the pose's prior, the wrist."""
