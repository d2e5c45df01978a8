"""Keypoints onto the joints of any robot hand, or of the human one."""
