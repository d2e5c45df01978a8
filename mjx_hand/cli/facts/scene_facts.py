"""What is in a scene, as labels and texts for people."""

import numpy as np

from mjx_hand.cli.facts import facts_of
from mjx_hand.motion import RecordedObject, RecordedScene
from mjx_hand.motion.scene import NO_SURFACE
from mjx_hand.motion.scene_notes import scene_notes, wrist_distance


def scene_facts(found: RecordedScene) -> facts_of.Facts:
    """Of a scene: its hands, its objects, and what is to be noticed."""
    facts: list[tuple[str, str]] = []
    for hand in found.hands:
        about = dict(facts_of.motion(hand))
        facts.append(("hand", about["hand"]))
        facts += [(f"  {label}", about[label]) for label in ("gaps", "wrist")]
        facts += [("  warning", warning) for warning in hand.warnings]
    facts.append(("frames", f"{found.num_frames} at {found.fps:g}/s ({found.num_frames / found.fps:.1f} s)"))
    facts += [(f"object {each.name}", _object(found, each)) for each in found.objects]
    up = "not known" if found.up is None else ", ".join(f"{x:.3g}" for x in found.up)
    facts += [("up", up), ("units", "metres, radians, seconds; quaternions wxyz")]
    facts.append(("source", found.source or "not said"))
    return (*facts, *(("note", note) for note in scene_notes(found)))


def _object(scene: RecordedScene, found: RecordedObject) -> str:
    place = found.position[found.seen]
    moved = float(np.linalg.norm(np.ptp(place, axis=0)))
    gaps = int((~found.seen).sum())
    parts = [_shape(found), f"moves within {1e3 * moved:.0f} mm"]
    if gaps:
        parts.append(f"not seen in {gaps} frames")
    if found.hinge is not None:
        angle = np.rad2deg(found.hinge.angle)
        parts.append(f"turns about {found.hinge.parent} from {angle.min():.0f} to {angle.max():.0f}°")
    near = [(hand.side, wrist_distance(hand, found)) for hand in scene.hands]
    parts += [f"{np.nanmin(d):.2f} m from the {side} wrist" for side, d in near if np.isfinite(d).any()]
    return ", ".join(parts)


def _shape(found: RecordedObject) -> str:
    if found.kind == NO_SURFACE:
        return "poses alone"
    if found.kind == "mesh":
        size = " x ".join(f"{1e3 * s:.0f}" for s in np.ptp(found.vertices, axis=0))
        return f"mesh of {len(found.faces)} triangles, {size} mm"
    size = " x ".join(f"{1e3 * s:.0f}" for s in found.size if s > 0)
    return f"{found.kind}, {size} mm (half extents or radius)"
