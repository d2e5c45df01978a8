import dataclasses
import sys
from pathlib import Path

from train.settings.config import Config


def arguments(config: Config, out: Path, **distributed: object) -> list[str]:
    """The command line of a tiny experiment."""
    ppo = {field.name: getattr(config.ppo, field.name) for field in dataclasses.fields(config.ppo)}
    values = {name: list(value) if isinstance(value, tuple) else value for name, value in ppo.items()}
    return [
        *(sys.executable, "-m", "train.ppo", f"out={out}", f"demonstrations={config.demonstrations}"),
        *(
            "name=tiny",
            "engine=native",
            "data.people=1",
            "data.heldout_people=1",
            "data.trials=1",
            "data.heldout_trials=1",
            "randomize.share=0",
        ),
        f"checks.every={config.checks.every}",
        *(f"ppo.{name}={value}".replace(" ", "") for name, value in values.items()),
        *(f"distributed.{name}={value}" for name, value in distributed.items()),
    ]
