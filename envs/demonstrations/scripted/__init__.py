"""Demonstrations by scripted grasps in the engine, captured as a laboratory would."""
