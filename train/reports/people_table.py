"""How a policy's scores spread over people, as a table."""

from collections.abc import Mapping

from mjx_hand.view.report import Table
from train.reports.score_table import score_text

_SHOWN = ("kept", "chord", "hold", "manip_trans_object", "tracking_error_cm")
_NOTE = "All seeds together, the person with least first. Kept: never lost (CHORD), and held to the end."


def people_table(people: Mapping[str, Mapping[str, float]]) -> Table:
    """A row a person of `envs.evaluation.people.person_scores`."""
    ordered = sorted(people.items(), key=lambda item: (item[1]["kept"], -item[1]["tracking_error_cm"]))
    shown = [name for name in _SHOWN if ordered and name in ordered[0][1]]
    titles = {"kept": "kept", "chord": "CHORD", "hold": "held 5 s", "manip_trans_object": "ManipTrans"}
    rows = [(person, *(score_text(name, scores[name]) for name in shown)) for person, scores in ordered]
    return Table(("person", *(titles.get(name, "tracking error") for name in shown)), rows, _NOTE)
