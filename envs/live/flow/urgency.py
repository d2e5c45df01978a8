"""`hurry`: threads that have to be in time, beside others that only have to be done."""

import contextlib
import os
import sys
import threading

_PRIORITY = -10  # of Linux' nice values: above a browser that draws on the same cores


def hurry() -> None:
    """Have the system prefer this thread, where it lets one choose: Linux lets root."""
    if hasattr(os, "setpriority") and sys.platform == "linux":
        with contextlib.suppress(PermissionError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _PRIORITY)
