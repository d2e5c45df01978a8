"""`Finding`: what is not as a hand's, and what becomes of a result for it."""

from collections.abc import Iterable
from dataclasses import dataclass

from mjx_hand.errors import InputError


@dataclass(frozen=True)
class Finding:
    """Something measured that is not as a hand's.

    Attributes:
        what: is measured, such as "bone lengths".
        measured: what it is, with its unit.
        allowed: what it should be.
        advice: what to try: another order, unit, side or rate.
        certain: beyond doubt wrong, so that nothing is written; else a warning.
    """

    what: str
    measured: str
    allowed: str
    advice: str
    certain: bool

    def __str__(self) -> str:
        return f"{self.what}: {self.measured}, expected {self.allowed}; {self.advice}"


def judged(source: str, findings: Iterable[Finding], before: tuple[str, ...] = ()) -> tuple[str, ...]:
    """The warnings that a result carries: those from `before`, and a line for each doubtful finding.

    Raises:
        InputError: a finding is beyond doubt; all such are named.
    """
    findings = list(findings)
    wrong = dict.fromkeys(str(finding) for finding in findings if finding.certain)
    if wrong:
        raise InputError(f"{source}: no hand's motion: {' | '.join(wrong)}")
    return tuple(dict.fromkeys((*before, *map(str, findings))))


def graded(
    what: str, value: float, doubtful: float, wrong: float, measured: str, allowed: str, advice: str
) -> list[Finding]:
    """A finding where `value` is above a bound: a doubtful one, or above the second one that is certain."""
    if not value > doubtful:
        return []
    return [Finding(what, measured, allowed, advice, certain=value > wrong)]
