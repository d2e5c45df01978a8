"""Physics engines behind one interface."""

from envs.physics.engine import ENGINES, Engine, PhysicsState, default_engine, make_engine

__all__ = ["ENGINES", "Engine", "PhysicsState", "default_engine", "make_engine"]
