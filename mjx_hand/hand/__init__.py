"""The skinned hand: open or licensed."""
