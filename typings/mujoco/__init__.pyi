# MuJoCo's classes come from compiled code without type stubs.
from typing import Any

def __getattr__(name: str) -> Any: ...
