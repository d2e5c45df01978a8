"""The optimiser of keypoint retargeting: kinematic trees, objectives, projected Newton steps."""
