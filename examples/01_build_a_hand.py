"""Build a hand of one person's proportions, write it as URDF and MJCF, and load it in MuJoCo.

    python examples/01_build_a_hand.py

The same from a shell: `mjx-hand build --out my_hand --shape 1.0 -0.5`.
"""

from pathlib import Path

import mujoco
import numpy as np

import mjx_hand
from mjx_hand.rigid.export.mesh_folder import filling
from mjx_hand.rigid.export.mjcf import write_mjcf
from mjx_hand.rigid.export.urdf import write_urdf
from mjx_hand.rigid.rigid_hand import finger_tips

OUT = Path("outputs/examples/my_hand")


def main() -> None:
    """Compare two people's hands and write the second."""
    hand = mjx_hand.load_hand()  # the open hand; load_hand("MANO_RIGHT.pkl") for a licensed one
    flat = np.zeros(20)  # hinge angles, rad
    mean, mine = (mjx_hand.build_rigid_hand(hand, shape) for shape in (None, [1.0, -0.5]))
    for name, rigid in {"mean": mean, "mine": mine}.items():
        reach = np.linalg.norm(np.asarray(finger_tips(flat, rigid)), axis=1)
        print(f"{name}: {1e3 * rigid.link_mass.sum():.0f} g, wrist to middle finger tip {1e3 * reach[1]:.1f} mm")

    with filling(OUT) as folder:  # all files or none
        write_urdf(mine, folder)
        write_mjcf(mine, folder, base="fixed")

    model = mujoco.MjModel.from_xml_path(str(OUT / "right_hand.xml"))
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.5 * model.actuator_ctrlrange[:, 1]  # half way to every upper limit
    mujoco.mj_step(model, data, nstep=round(1.0 / model.opt.timestep))
    print(f"{OUT / 'right_hand.xml'}: {model.nq} hinges, {model.nu} actuators, {model.nmesh} meshes")
    print(f"after one second of half-closing: {np.rad2deg(data.qpos).mean():.1f} degrees per hinge on average")


if __name__ == "__main__":
    main()
