"""`Newest`: a place for one item, of which the newest wins."""

import threading
from typing import Generic, TypeVar

Kind = TypeVar("Kind")


class Newest(Generic[Kind]):
    """Hands the newest of what is put in to whoever takes it; what nobody took in time is gone.

    So a stage that is slow works on what is new, and never delays the one before it.

    Attributes:
        replaced: how many were gone before anybody took them.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._held: Kind | None = None
        self.replaced = 0

    def put(self, item: Kind) -> None:
        """Put in; what was there is replaced."""
        with self._changed:
            self.replaced += self._held is not None
            self._held = item
            self._changed.notify()

    def take(self, seconds: float = 0.0) -> Kind | None:
        """Take out; None where nothing comes within that time."""
        with self._changed:
            if self._held is None and seconds > 0:
                self._changed.wait_for(lambda: self._held is not None, seconds)
            item, self._held = self._held, None
            return item
