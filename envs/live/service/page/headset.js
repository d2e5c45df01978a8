// WebXR: the wearer's hands out, joint by joint, and the twin into the headset, where the wearer's own hand is.

import { inverse, multiply } from "./matrix.js";

const SIDES = ["right", "left"];

// `scene()` and `newest()` say what is shown; `say(text)` tells the wearer. `drew(number)` is told what was drawn.
export function headset(drawing, address, scene, newest, say) {
  const made = { drew: () => {}, presenting: () => session !== null };
  const button = document.getElementById("enter");
  let session = null, space = null, hands = null, drawn = 0;

  function steps() {
    if (!isSecureContext)
      return say("1. This address is not secure, so browsers give it no hands.\n2. Connect the headset by USB and run: adb reverse tcp:PORT tcp:PORT\n3. Open the printed address with localhost in the headset.".replaceAll("PORT", location.port));
    if (!navigator.xr) return say("This browser has no WebXR: it shows the twin, but streams no hands.");
    navigator.xr.isSessionSupported("immersive-vr").then((able) => {
      button.hidden = !able;
      say(able ? "" : "This browser has WebXR, but no headset.");
    });
  }

  async function enter() {
    try {
      session = await navigator.xr.requestSession("immersive-vr", { requiredFeatures: ["hand-tracking"], optionalFeatures: ["local-floor"] });
    } catch (error) {
      return say(`The headset was not entered: ${error.message}`);
    }
    space = await session.requestReferenceSpace("local-floor").catch(() => session.requestReferenceSpace("local"));
    if (drawing) {
      await drawing.gl.makeXRCompatible();
      session.updateRenderState({ baseLayer: new XRWebGLLayer(session, drawing.gl) });
    }
    hands = new WebSocket(address("/hand"));
    hands.onclose = ({ reason }) => say(reason ? `Your hands are not streamed: ${reason}` : "Your hands are no longer streamed.");
    session.onend = () => {
      hands.close();
      session = null;
    };
    session.requestAnimationFrame(picture);
  }

  function picture(time, frame) {
    session?.requestAnimationFrame(picture);
    stream(time, frame);
    if (drawn) made.drew(drawn);
    drawn = 0;
    const layer = frame.session.renderState.baseLayer, pose = frame.getViewerPose(space), shown = scene();
    if (!drawing || !layer || !pose) return;
    const { gl } = drawing;
    gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
    gl.clearColor(0.933, 0.941, 0.953, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!shown || !newest()) return;
    drawing.move(newest().poses);
    drawn = newest().number;
    const sourceFromWorld = inverse(shown.world_from_source);
    for (const view of pose.views) {
      const { x, y, width, height } = layer.getViewport(view);
      gl.viewport(x, y, width, height);
      drawing.draw(view.projectionMatrix, multiply(view.transform.inverse.matrix, sourceFromWorld));
    }
  }

  // Each hand that is tracked, its 25 joints by name; what waits to be sent is not added to.
  function stream(time, frame) {
    if (hands.readyState !== WebSocket.OPEN || hands.bufferedAmount > 0) return;
    const told = { time: time / 1000, hands: [] };
    for (const { handedness, hand } of frame.session.inputSources) {
      if (!hand || !SIDES.includes(handedness)) continue;
      const joints = {};
      for (const [name, joint] of hand) {
        const found = frame.getJointPose(joint, space);
        if (!found) continue;
        const { x, y, z } = found.transform.position;
        joints[name] = [x, y, z];
      }
      if (Object.keys(joints).length === 25) told.hands.push({ side: handedness, joints });
    }
    hands.send(JSON.stringify(told));
  }

  button.onclick = enter;
  steps();
  return made;
}
