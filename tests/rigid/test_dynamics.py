"""Forward kinematics and mass matrices of the written descriptions in four engines, against our own arrays.

Tolerances: positions 1e-5 m and rotations 1e-5, mass matrices 1e-5 of their largest entry, besides what the URDF's
small links between two hinges and at the finger tips weigh (1e-5 kg and 1e-9 kg m^2 each).
"""

from pathlib import Path

import mujoco
import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports] (its wheel puts it where Python finds it, by a .pth file)
import pytest
import yourdfpy

from mjx_hand.hand.joints import HINGE_LINKS, HINGES, LINKS, NUM_HINGES, PARENTS, WRIST_SLIDES, WRIST_TURNS
from mjx_hand.rigid.export.mjcf import write_mjcf
from mjx_hand.rigid.export.urdf import write_urdf
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics

TOLERANCE = 1e-5
SMALL_LINKS = 2e-7  # kg m^2: what a tip of 1e-5 kg, 10 cm from a knuckle, and the links between two hinges can add


def moved_by(link: int) -> set[int]:
    """The hinges that move a link."""
    chain = set()
    while link > 0:
        chain |= {h for h in range(NUM_HINGES) if HINGE_LINKS[h] == link}
        link = PARENTS[link]
    return chain


def expected_mass_matrix(rigid: RigidHand, row: np.ndarray) -> np.ndarray:
    """Kinetic energy's matrix from link Jacobians by finite differences of our own forward kinematics (float64)."""
    step = 1e-6
    rows = np.concatenate([row[None] + step * np.eye(NUM_HINGES), row[None] - step * np.eye(NUM_HINGES), row[None]])
    turn, position = kinematics64(rigid, rows)
    centre = position + np.einsum("blij,lj->bli", turn, rigid.link_com)
    velocity = (centre[:NUM_HINGES] - centre[NUM_HINGES:-1]) / (2 * step)  # (20, 16, 3)
    rate = np.einsum("hlij,lkj->hlik", (turn[:NUM_HINGES] - turn[NUM_HINGES:-1]) / (2 * step), turn[-1])
    spin = np.stack([rate[..., 2, 1], rate[..., 0, 2], rate[..., 1, 0]], axis=-1)
    inertia = turn[-1] @ rigid.link_inertia @ np.swapaxes(turn[-1], -1, -2)
    linear = np.einsum("alc,l,blc->ab", velocity, rigid.link_mass, velocity)
    return linear + np.einsum("alc,lcd,bld->ab", spin, inertia, spin)


def kinematics64(rigid: RigidHand, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`forward_kinematics` again in float64, by Rodrigues' formula and loops."""
    turn, position = np.tile(np.eye(3), (len(rows), 16, 1, 1)), np.zeros((len(rows), 16, 3))
    for link in range(1, 16):
        parent = PARENTS[link]
        local = np.tile(np.eye(3), (len(rows), 1, 1))
        for hinge in (h for h in range(NUM_HINGES) if HINGE_LINKS[h] == link):
            x, y, z = rigid.hinge_axis[hinge]
            cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            angle = rows[:, hinge, None, None]
            local = local @ (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
        turn[:, link] = turn[:, parent] @ local
        position[:, link] = position[:, parent] + turn[:, parent] @ rigid.link_offset[link]
    return turn, position


@pytest.fixture(scope="module", params=["fixed", "wrist joints"])
def written(request, rigid, tmp_path_factory) -> tuple[Path, Path, bool]:
    """URDF, MJCF and whether the six joints of the wrist are there."""
    folder, movable = tmp_path_factory.mktemp("hand"), request.param == "wrist joints"
    mjcf = write_mjcf(rigid, folder, base="actuated" if movable else "fixed")
    return write_urdf(rigid, folder, wrist_joints=movable), mjcf, movable


def test_our_own_kinematics_agree(rigid, angles):
    for ours, again in zip(forward_kinematics(angles, rigid), kinematics64(rigid, angles.astype(float)), strict=True):
        np.testing.assert_allclose(ours, again, atol=2e-6)


def check(rigid, row, rotations, positions, mass_matrix, small_links: float) -> None:
    turn, position = kinematics64(rigid, row[None].astype(float))
    np.testing.assert_allclose(rotations, turn[0], atol=TOLERANCE)
    np.testing.assert_allclose(positions, position[0], atol=TOLERANCE)
    expected = expected_mass_matrix(rigid, row.astype(float))
    np.testing.assert_allclose(mass_matrix, expected, atol=1e-5 * expected.max() + small_links)


@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
def test_mujoco(rigid, angles, written, kind):
    model = mujoco.MjModel.from_xml_path(str(written[0] if kind == "urdf" else written[1]))
    model.dof_armature[:] = 0  # which the MJCF alone has
    data = mujoco.MjData(model)
    place = [model.joint(name).qposadr[0] for name in HINGES]
    for row in angles:
        data.qpos[place] = row
        mujoco.mj_forward(model, data)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        bodies = [data.body(name) for name in LINKS]
        check(
            rigid,
            row,
            [body.xmat.reshape(3, 3) for body in bodies],
            [body.xpos - bodies[0].xpos for body in bodies],
            full[np.ix_(place, place)],
            SMALL_LINKS if kind == "urdf" else 0.0,
        )


def test_pinocchio(rigid, angles, written):
    model = pinocchio.buildModelFromUrdf(str(written[0]))
    data = model.createData()
    place = [model.joints[model.getJointId(name)].idx_q for name in HINGES]
    for row in angles:
        q = pinocchio.neutral(model)
        q[place] = row
        pinocchio.framesForwardKinematics(model, data, q)
        found = [data.oMf[model.getFrameId(name)] for name in LINKS]
        upper = np.triu(pinocchio.crba(model, data, q))
        full = upper + np.triu(upper, 1).T
        check(
            rigid,
            row,
            [pose.rotation for pose in found],
            [pose.translation for pose in found],
            full[np.ix_(place, place)],
            SMALL_LINKS,
        )


def test_pybullet(rigid, angles, written):
    bullet = pytest.importorskip("pybullet", reason="PyBullet is not installed: it is not among the locked packages")
    client = bullet.connect(bullet.DIRECT)
    try:
        flags = bullet.URDF_USE_INERTIA_FROM_FILE
        body = bullet.loadURDF(str(written[0]), useFixedBase=True, flags=flags, physicsClientId=client)
        joints = [bullet.getJointInfo(body, k, client) for k in range(bullet.getNumJoints(body, client))]
        index = {info[12].decode(): k for k, info in enumerate(joints)}
        hinge = {info[1].decode(): k for k, info in enumerate(joints)}
        movable = [info[1].decode() for info in joints if info[2] != bullet.JOINT_FIXED]
        place = [movable.index(name) for name in HINGES]
        for row in angles:
            for name, angle in zip(HINGES, row.tolist(), strict=True):
                bullet.resetJointState(body, hinge[name], angle, physicsClientId=client)
            state = {
                name: bullet.getLinkState(body, k, computeForwardKinematics=True, physicsClientId=client)
                for name, k in index.items()
            }
            if "wrist" in state:
                root = np.array(state["wrist"][4])
                links = LINKS
            else:  # the root link has no state of its own; its frame is the world's up to its centre of mass
                local = bullet.getDynamicsInfo(body, -1, client)[3]
                root = np.array(bullet.getBasePositionAndOrientation(body, client)[0]) - np.array(local)
                links = LINKS[1:]
            turns = [np.array(bullet.getMatrixFromQuaternion(state[name][5])).reshape(3, 3) for name in links]
            positions = [np.array(state[name][4]) - root for name in links]
            if len(links) == 15:
                turns, positions = [np.eye(3), *turns], [np.zeros(3), *positions]
            q = [dict(zip(HINGES, row.tolist(), strict=True)).get(name, 0.0) for name in movable]
            full = np.array(bullet.calculateMassMatrix(body, q, physicsClientId=client))
            check(rigid, row, turns, positions, full[np.ix_(place, place)], SMALL_LINKS)
    finally:
        bullet.disconnect(client)


def test_yourdfpy(rigid, angles, written):
    robot = yourdfpy.URDF.load(str(written[0]))
    wrist = [*WRIST_SLIDES, *WRIST_TURNS] if written[2] else []
    assert sorted(robot.actuated_joint_names) == sorted([*wrist, *HINGES])
    for row in angles:
        robot.update_cfg(dict(zip(HINGES, row.tolist(), strict=True)))
        found = np.stack([robot.get_transform(name, "wrist") for name in LINKS])
        turn, position = kinematics64(rigid, row[None].astype(float))
        np.testing.assert_allclose(found[:, :3, :3], turn[0], atol=TOLERANCE)
        np.testing.assert_allclose(found[:, :3, 3], position[0], atol=TOLERANCE)
