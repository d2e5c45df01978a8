"""What the hand meets besides the object, by what MuJoCo does with it."""

import dataclasses
import itertools

import mujoco
import numpy as np
import pytest

from envs.hand_contacts import CONTACTS
from envs.physics import make_engine
from envs.scene import OBJECT, SUPPORT, TABLE, scene_spec
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.bodies.human_body import human_body
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, HINGES
from mjx_hand.hand.load import load_hand
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.build import build_rigid_hand

BALL = ObjectDescription(kind="sphere", size=np.array([0.01, 0, 0]), mass=0.1, friction=1.0)
BLOCK = np.array([[0.05, 0.05, 0.02]]), np.array([[0.5, 0.0, 0.02]])
GROUND = {TABLE, f"{SUPPORT}0"}


def scene(contacts: str, hand=None) -> mujoco.MjModel:
    hand = build_rigid_hand(load_hand()) if hand is None else hand
    return scene_spec(hand, BALL, *BLOCK, np.eye(3), contacts=contacts).compile()


def partners(model: mujoco.MjModel) -> set[frozenset[str]]:
    """Names of the geoms that may touch."""
    kind, meets = model.geom_contype, model.geom_conaffinity
    found = {
        (i, j) for i, j in itertools.combinations(range(model.ngeom), 2) if kind[i] & meets[j] or kind[j] & meets[i]
    }
    found |= {(int(a), int(b)) for a, b in zip(model.pair_geom1, model.pair_geom2, strict=True)}
    return {frozenset((model.geom(i).name, model.geom(j).name)) for i, j in found}


def finger(geom: str) -> str | None:
    return next((name for name in FINGERS if geom.startswith(name)), None)


def settled(model: mujoco.MjModel, hinges: dict[str, float], drop: float = 0.3) -> mujoco.MjData:
    """A second of the hand at a height, told to reach these hinge angles; the ball lies far away."""
    data = mujoco.MjData(model)
    data.qpos[2] = drop
    data.ctrl[2] = drop
    data.qpos[-7:-4] = [1.0, 1.0, 0.01]
    for name, angle in hinges.items():
        data.ctrl[6 + HINGES.index(name)] = angle
    mujoco.mj_step(model, data, 250)
    assert np.isfinite(data.qpos).all()
    return data


def deepest(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """The deepest overlap (m) of capsules of two fingers."""
    geoms = [g for g in range(model.ngeom) if finger(model.geom(g).name)]
    apart = [
        mujoco.mj_geomDistance(model, data, a, b, 0.01, None)
        for a, b in itertools.combinations(geoms, 2)
        if finger(model.geom(a).name) != finger(model.geom(b).name)
    ]
    return -min(apart)


@pytest.mark.parametrize("contacts", CONTACTS)
def test_each_choice_adds_what_it_names(contacts):
    model = scene(contacts)
    hand = {model.geom(g).name for g in range(model.ngeom)} - GROUND - {OBJECT}
    added = partners(model) - partners(scene("object"))
    with_ground = {pair for pair in added if pair & GROUND}
    itself = added - with_ground
    every = {frozenset((one, other)) for one in hand for other in GROUND}
    assert with_ground == (every if contacts in ("ground", "all") else set())
    assert all(pair <= hand for pair in itself)
    of_fingers = {pair for pair in itself if all(finger(geom) for geom in pair)}
    assert len(of_fingers) == (15 * 12 // 2 if contacts in ("self", "all") else 0)
    assert all(len({finger(geom) for geom in pair}) == 2 for pair in of_fingers)
    # The rest: the palm with links that no joint joins to it.
    assert {geom[-9] for pair in itself - of_fingers for geom in pair if finger(geom)} <= {"2", "3"}
    assert len(itself - of_fingers) == (5 * 10 if contacts in ("self", "all") else 0)


def test_fingers_that_cross_stop_each_other():
    """Index and middle finger are told to change sides, whichever way that is."""
    free, met = scene("object"), scene("self")
    ways = [{"index_mcp_abduction": sign * 0.35, "middle_mcp_abduction": -sign * 0.35} for sign in (1, -1)]
    depths = [deepest(free, settled(free, way)) for way in ways]
    assert max(depths) > 0.005
    assert deepest(met, settled(met, ways[int(np.argmax(depths))])) < 0.002


def test_a_hand_lowered_into_the_table_stops_on_it():
    lows = {}
    for contacts in ("object", "ground"):
        model = scene(contacts)
        data = settled(model, {}, drop=-0.01)
        lows[contacts] = min(
            data.geom_xpos[g][2] - model.geom_size[g][0] - model.geom_size[g][1] * abs(data.geom_xmat[g][8])
            for g in range(model.ngeom)
            if model.geom(g).name not in GROUND | {OBJECT}
        )
    assert lows["object"] < -0.01
    assert lows["ground"] > -0.005


def test_a_robots_hulls_that_overlap_at_rest_pass_through_each_other():
    """The human hand as a robot's, with a thumb so thick that it reaches into the index finger."""
    rigid = build_rigid_hand(load_hand())
    radius = np.array(rigid.capsule_radius)
    radius[[k for k, link in enumerate(rigid.capsule_links) if link > 0]] *= 1.5
    thick = dataclasses.replace(rigid, capsule_radius=radius)
    robot = dataclasses.replace(human_body(thick), rigid=None)
    person, machine = scene("self", thick), scene("self", robot)
    assert machine.npair < person.npair == 140
    data = mujoco.MjData(machine)
    data.qpos[2] = 0.3
    mujoco.mj_forward(machine, data)
    assert not [c for c in data.contact if OBJECT not in (machine.geom(c.geom[0]).name, machine.geom(c.geom[1]).name)]


def test_environments_have_what_the_task_says(demonstrations, hands):
    for contacts, pairs in (("object", 0), ("all", 140)):
        env = TrackingEnv(demonstrations[:1], hands[:1], "native", Task(contacts=contacts))
        assert [model.npair for model in env.models] == [pairs]
        assert env.engine.models[0].npair == pairs


def test_mjx_has_the_same_pairs_with_a_little_friction():
    given = scene("all")
    engine = make_engine("mjx", [given], 5)
    (model,) = engine.models
    assert model.npair == given.npair == 140
    assert (given.pair_dim == 1).all()
    assert (model.pair_dim == 3).all()
    np.testing.assert_allclose(model.pair_friction, 0.001)


def test_what_is_no_choice_is_refused():
    with pytest.raises(InputError, match=r"task\.contacts is 'none'; valid: object, ground, self, all"):
        Task(contacts="none")
