"""Spherical grasp: a ball from above, fingers spread around it, thumb opposite."""

from envs.grasps.grasp_type import Box, Contact, GraspType, Wrap

GRASP = GraspType(
    name="spherical",
    object_kind="sphere",
    object_size=((0.0275, 0.0, 0.0), (0.0375, 0.0, 0.0)),
    object_mass=(0.2, 0.6),
    object_friction=(0.8, 1.0),
    # a frame of four slats, which the ball dips into a little
    support=(
        Box((0.024, 0.004, 0.008), (0.0, 0.02, 0.008)),
        Box((0.024, 0.004, 0.008), (0.0, -0.02, 0.008)),
        Box((0.004, 0.016, 0.008), (0.02, 0.0, 0.008)),
        Box((0.004, 0.016, 0.008), (-0.02, 0.0, 0.008)),
    ),
    rest=0.012,
    contacts=(
        *(Contact(f"{finger}{phalanx}", 0.6) for finger in ("index", "middle", "ring", "pinky") for phalanx in (2, 3)),
        Contact("thumb3", 0.6),
    ),
    posture=(
        *(-0.30, 0.81, 0.60, 0.33),
        *(-0.03, 0.50, 0.74, 0.57),
        *(0.30, 0.90, 0.90, 0.63),
        *(0.31, 0.67, 0.63, 0.44),
        *(0.21, 0.66, 0.31, 0.21),
    ),
    # palm down, fingers along world +x, thumb towards world +y
    wrist_rotation=((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    approach=(0.0, 0.0, 0.08),
    closing=Wrap(
        opened=(
            *(-0.30, 0.30, 0.30, 0.20),
            *(-0.03, 0.25, 0.35, 0.20),
            *(0.35, 0.30, 0.40, 0.20),
            *(0.25, 0.30, 0.35, 0.20),
            *(0.45, 0.70, 0.00, 0.00),
        ),
        finger_torque=(0.4, 0.22, 0.1),
        thumb_torque=(0.7, 0.35, 0.15),
        place=(0.004, -0.041, -0.002),
    ),
    lift=(0.11, 0.15),
    carry=(0.06, 0.10),
    turn=(0.35, 0.52),
)
