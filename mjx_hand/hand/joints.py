"""The names and order of a MANO-layout hand's joints (Romero et al. 2017, https://mano.is.tue.mpg.de).

The order is MANO's own: wrist, then index, middle, pinky, ring, thumb, three joints each from the
knuckle outwards. Every array in this project that has a joint, link or finger axis follows it.
"""

FINGERS = ("index", "middle", "pinky", "ring", "thumb")
LINKS = ("wrist", *(f"{finger}{k}" for finger in FINGERS for k in (1, 2, 3)))
PARENTS = (-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11, 0, 13, 14)
TIP_LINKS = (3, 6, 9, 12, 15)  # the distal link of each finger

NUM_LINKS = len(LINKS)  # 16
NUM_BALL_JOINTS = NUM_LINKS - 1  # 15 rotations in a MANO pose

# Of the 15 ball joints, those approximated by two axes (MCP, thumb CMC) and by one (all others).
TWO_DOF = (0, 3, 6, 9, 12)
ONE_DOF = (1, 2, 4, 5, 7, 8, 10, 11, 13, 14)

# The 20 hinge joints: each finger's abduction and flexion at its base, then the two hinges outwards.
HINGES = tuple(
    f"{finger}_{name}"
    for finger in FINGERS
    for name in (
        ("cmc_abduction", "cmc_flexion", "mcp_flexion", "ip_flexion")
        if finger == "thumb"
        else ("mcp_abduction", "mcp_flexion", "pip_flexion", "dip_flexion")
    )
)
NUM_HINGES = len(HINGES)  # 20
FLEXES = tuple(name.endswith("_flexion") for name in HINGES)  # which of them flex; the others spread
# The link that each hinge moves: two hinges move the finger's first link, one each of the others.
HINGE_LINKS = tuple(1 + 3 * f + k for f in range(5) for k in (0, 0, 1, 2))

# Joints that carry the wrist of an actuated hand: slides along its base's axes, then turns, R = Rx Ry Rz.
WRIST_SLIDES = ("wrist_x", "wrist_y", "wrist_z")
WRIST_TURNS = ("wrist_roll", "wrist_pitch", "wrist_yaw")
