"""The twin of the hand in front of you: a tracker's keypoints, physics in real time, and a page that shows it."""
