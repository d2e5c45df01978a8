"""The hand's pose, wrist, shape and skin offsets from markers."""
