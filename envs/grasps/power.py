"""Power grasp: the whole fist around a handle that lies on two posts, palm on top."""

from envs.grasps.grasp_type import Box, Contact, GraspType, Wrap

GRASP = GraspType(
    name="power",
    object_kind="capsule",
    object_size=((0.017, 0.1, 0.0), (0.023, 0.1, 0.0)),
    object_mass=(1.2, 2.0),
    object_friction=(0.6, 0.8),
    object_rotation=((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),  # along world y
    support=(Box((0.03, 0.012, 0.06), (0.0, 0.1, 0.06)), Box((0.03, 0.012, 0.06), (0.0, -0.1, 0.06))),
    rest=0.12,
    contacts=(
        *(Contact(f"{finger}{phalanx}", 0.6) for finger in ("index", "middle", "ring", "pinky") for phalanx in (2, 3)),
        Contact("thumb3", 0.6),
    ),
    posture=(
        *(-0.06, 1.07, 0.93, 0.66),
        *(-0.03, 1.09, 1.02, 0.87),
        *(-0.15, 0.76, 0.92, 0.61),
        *(-0.04, 0.91, 0.95, 0.75),
        *(0.20, 0.80, 0.50, 0.50),
    ),
    # fingers along world +x, palm down, thumb towards world +y
    wrist_rotation=((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    approach=(-0.02, 0.0, 0.08),
    closing=Wrap(
        opened=(
            *(0.00, 0.20, 0.20, 0.15),
            *(0.00, 0.20, 0.20, 0.15),
            *(0.00, 0.20, 0.20, 0.15),
            *(0.00, 0.20, 0.20, 0.15),
            *(0.50, 0.80, -0.10, -0.10),
        ),
        finger_torque=(0.6, 0.6, 0.27),
        thumb_torque=(1.2, 0.6, 0.3),
        place=(0.042, -0.029, -0.012),
    ),
    lift=(0.11, 0.15),
    carry=(0.06, 0.10),
    turn=(0.35, 0.52),
)
