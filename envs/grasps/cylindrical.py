"""Cylindrical grasp: an upright bottle or can in the whole hand, thumb against fingers."""

from envs.grasps.grasp_type import Contact, GraspType, Wrap

GRASP = GraspType(
    name="cylindrical",
    object_kind="cylinder",
    object_size=((0.0275, 0.085, 0.0), (0.0375, 0.085, 0.0)),
    object_mass=(0.3, 0.9),
    object_friction=(0.8, 1.0),
    contacts=(
        *(Contact(f"{finger}{phalanx}", 0.6) for finger in ("index", "middle", "ring", "pinky") for phalanx in (2, 3)),
        Contact("thumb3", 0.7),
    ),
    posture=(
        *(0.03, 0.99, 0.47, 0.58),
        *(-0.01, 1.14, 0.51, 0.65),
        *(-0.10, 0.81, 0.68, 0.50),
        *(-0.02, 1.01, 0.64, 0.45),
        *(0.44, 0.81, -0.10, 0.38),
    ),
    # fingers along world +x, palm towards world +y, thumb up
    wrist_rotation=((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    approach=(-0.05, -0.06, 0.0),
    closing=Wrap(
        opened=(
            *(0.05, 0.20, 0.15, 0.10),
            *(0.00, 0.20, 0.15, 0.10),
            *(0.00, 0.20, 0.15, 0.10),
            *(0.00, 0.20, 0.15, 0.10),
            *(0.50, 0.80, -0.20, -0.10),
        ),
        finger_torque=(0.5, 0.28, 0.12),
        thumb_torque=(0.8, 0.4, 0.2),
        place=(0.029, -0.039, -0.001),
    ),
    lift=(0.11, 0.15),
    carry=(0.06, 0.10),
    turn=(0.35, 0.52),
)
