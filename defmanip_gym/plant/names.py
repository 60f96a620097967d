"""Names of the model's elements, shared by the builder and everything that reads the model."""

BASE = "base"
BASE_X, BASE_Y, BASE_YAW = "base_x", "base_y", "base_yaw"
BASE_SITE = "base_center"
UPPER_ARM, FOREARM = "upper_arm", "forearm"
SHOULDER, ELBOW = "shoulder", "elbow"
GRASP_SITE = "grasp"
GRASP_FORCE = "grasp_force"
ROOT_DAMPER = "swing_from_vertical"
GRIPPER, WRIST, LEVEL_RODS = "gripper", "wrist", "level_rods"
DRIVE, STEERING, SHOULDER_MOTOR, ELBOW_MOTOR = "drive", "steering", "shoulder_motor", "elbow_motor"
NO_SLIP = "no_lateral_slip"
TRACKING_CAMERA, SIDE_CAMERA, TOP_CAMERA = "track", "side", "top"
GRASP_CAMERA, OVERVIEW_CAMERA = "grasp", "overview"
GOAL_SITE = "goal"

# order of T_r = (f_b, α_b, τ1, τ2) in ctrl
ACTUATORS = (DRIVE, STEERING, SHOULDER_MOTOR, ELBOW_MOTOR)


def segment(index: int) -> str:
    """Return the name of a beam segment's body, counted from 0 at the grasp."""
    return f"beam_segment_{index}"


def segment_hinge(index: int) -> str:
    """Return the name of the hinge above a beam segment."""
    return f"beam_hinge_{index}"


def segment_geom(index: int) -> str:
    """Return the name of a beam segment's geom."""
    return f"beam_geom_{index}"
