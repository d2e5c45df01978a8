"""Settings, which are frozen dataclasses, from what configuration files hold."""

import dataclasses
from typing import Any


def from_dict(cls: Any, values: Any) -> Any:
    """A dataclass from nested dictionaries. Configuration files have lists where frozen dataclasses have tuples."""
    given = {}
    for field in dataclasses.fields(cls):
        if field.name in values:
            value = values[field.name]
            if isinstance(value, dict):
                value = from_dict(field.type, value)
            given[field.name] = tuple(value) if isinstance(value, list) else value
    return cls(**given)
