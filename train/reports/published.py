"""What the paper (arXiv 2512.07359) reports for its own twin: to stand beside our figures, not to be matched by rows.

It does not define its success, and its demonstrations are not public.
"""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Published:
    """A row of the paper's results.

    Attributes:
        success: share of rollouts, 0 to 1.
        tracking_error_cm: mean object position error (cm).
    """

    success: float
    tracking_error_cm: float


PAPER = {
    "power": Published(0.730, 0.83),
    "pinch": Published(0.823, 0.95),
    "lateral": Published(0.802, 0.75),
    "cylindrical": Published(0.722, 0.87),
    "spherical": Published(0.816, 0.87),
    "all": Published(0.779, 0.85),
}
