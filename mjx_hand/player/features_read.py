"""The features that an exported policy reads, as its contract lists them."""

from mjx_hand.errors import InputError
from mjx_hand.player.exported_policy import ExportedPolicy
from mjx_hand.player.features import Feature, feature_table
from mjx_hand.player.observed_state import HUMAN_NAMES, HandNames


def features_read(
    policy: ExportedPolicy, hand: HandNames = HUMAN_NAMES, name: str = "the policy", live: bool = False
) -> list[Feature]:
    """The features that a policy reads, in its order.

    Args:
        policy: as exported.
        hand: names of its joints, fingers and links.
        name: what messages call the policy.
        live: whether it is to read nothing that only demonstrations tell.

    Raises:
        InputError: a feature that there is not, or another number of them than the policy was made for.
    """
    contract = policy.contract
    table = feature_table(policy.residual_scale, contract["lookahead"], contract["object_kinds"], hand)
    known = {feature.name: feature for feature in table if not (live and feature.of_demonstration)}
    inputs = contract["inputs"]
    for entry in inputs:
        feature, size = entry["name"], entry["size"]
        if feature not in known or known[feature].size != size:
            raise InputError(
                f"{name} reads {feature!r} ({size} numbers), which this version of mjx-hand does not know"
                f"{' of a live hand' if live else ''}; export the policy again with this version"
            )
    if sum(entry["size"] for entry in inputs) != policy.offset.size:
        raise InputError(f"the contract of {name} does not list its {policy.offset.size} features; export it again")
    return [known[entry["name"]] for entry in inputs]
