"""Files of a data set that its recordings name: where they are, and its calibrations."""
