"""JAX's persistent compilation cache in the user's own cache folder.

Compiling costs seconds to minutes a function, running it milliseconds: commands and tests keep what they compiled.
The folder holds nothing but what can be made anew, and may be deleted at any time.
"""

import os
import sys
from pathlib import Path

import jax

from mjx_hand.errors import InputError

VARIABLE = "MJX_HAND_CACHE"
JAX_VARIABLE = "JAX_COMPILATION_CACHE_DIR"  # JAX's own


def cache_folder() -> Path:
    """Where compiled functions are kept.

    `$MJX_HAND_CACHE`, else `$JAX_COMPILATION_CACHE_DIR`, else `mjx-hand/jax` in the user's cache folder.

    Raises:
        RuntimeError: nothing is said, and the user has no home.
    """
    if chosen := os.environ.get(VARIABLE) or os.environ.get(JAX_VARIABLE):
        return Path(chosen).expanduser()
    # The XDG base directory specification: a relative path there counts as not set.
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (base if base.is_absolute() else Path.home() / ".cache") / "mjx-hand" / "jax"


def enable_compile_cache() -> Path | None:
    """Make JAX keep compiled functions in `cache_folder()`, which is returned; call before the first computation.

    Where that is below a home that cannot be written, as on many compute nodes, it says so, and nothing is kept.

    Raises:
        InputError: a folder that `$MJX_HAND_CACHE` names cannot be written.
    """
    # XLA logs, as an error, that two tuning flags of a cached CPU function are no real features of this CPU. The
    # features themselves are part of the cache's key, so a function made for another CPU is never loaded.
    jax.config.update("jax_logging_level", "CRITICAL")
    folder: Path | None = None
    try:
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise PermissionError(13, os.strerror(13))
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or error
        what = f"cannot keep compiled functions in {folder or 'the home folder'}: {reason}"
        if os.environ.get(VARIABLE):
            raise InputError(f"{what}; set {VARIABLE} to a folder that you may write to") from None
        print(f"mjx-hand: {what}; going on without, set {VARIABLE} to a folder that you may write to", file=sys.stderr)
        jax.config.update("jax_compilation_cache_dir", None)
        return None
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)  # JAX's own second would skip most of ours
    return folder
