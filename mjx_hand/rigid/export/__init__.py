"""Descriptions of the rigid hand for simulators: MJCF, URDF and their meshes."""
