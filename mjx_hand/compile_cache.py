"""JAX's persistent compilation cache in the user's own cache folder.

Compiling costs seconds to minutes a function, running it milliseconds: commands and tests keep what they compiled.
The folder holds nothing but what can be made anew, and may be deleted at any time.
"""

import os
from pathlib import Path

import jax

from mjx_hand.errors import InputError

VARIABLE = "MJX_HAND_CACHE"


def cache_folder() -> Path:
    """Where compiled functions are kept: `$MJX_HAND_CACHE`, else `mjx-hand/jax` in the user's cache folder."""
    if chosen := os.environ.get(VARIABLE):
        return Path(chosen).expanduser()
    # The XDG base directory specification: a relative path there counts as not set.
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (base if base.is_absolute() else Path.home() / ".cache") / "mjx-hand" / "jax"


def enable_compile_cache() -> Path:
    """Make JAX keep compiled functions in `cache_folder()`, which is returned; call before the first computation.

    Raises:
        InputError: the folder cannot be written.
    """
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot keep compiled functions in {folder}: {error.strerror}; "
            f"set {VARIABLE} to a folder that you may write to"
        ) from None
    # XLA logs, as an error, that two tuning flags of a cached CPU function are no real features of this CPU. The
    # features themselves are part of the cache's key, so a function made for another CPU is never loaded.
    jax.config.update("jax_logging_level", "CRITICAL")
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)  # JAX's own second would skip most of ours
    return folder
