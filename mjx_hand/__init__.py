"""From a recording of a human hand to a physics twin of that hand.

    hand = mjx_hand.load_hand()
    rigid = mjx_hand.build_rigid_hand(hand)
    motion = mjx_hand.load_motion("recording.npz")
    angles = mjx_hand.project(motion.rotations, rigid)
    rotations = mjx_hand.joint_rotations(angles, rigid)

Metres, radians, seconds; quaternions wxyz; MANO's joint order and right-hand frame (`mjx_hand.hand`). `__init__.pyi`
lists the public names.
"""

from mjx_hand.cli.terminal.stopping import stop_quietly
from mjx_hand.lazy_exports import lazy_exports

__version__ = "0.2.0"

stop_quietly()

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)  # type: ignore[assignment]  # the stub's names
