// A headset with one right hand, for a page in a browser that has none: `emulated.joints` is what its tracker sees, the
// places of the 25 joints by name, or null; `emulated.session` the session that the page began.
globalThis.emulated = { joints: null, session: null };
{
  const eye = new DOMPoint(0, 1.5, 0);
  const inverse = { matrix: new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -eye.x, -eye.y, -eye.z, 1]) };
  const view = { projectionMatrix: new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -0.02, 0]), transform: { inverse } };
  class Session {
    constructor() {
      this.renderState = {};
      this.hand = new Map(emulated.names.map((name) => [name, { name }]));
    }
    get inputSources() {
      return emulated.joints ? [{ handedness: "right", hand: this.hand }, { handedness: "none" }] : [];
    }
    updateRenderState(state) { Object.assign(this.renderState, state); }
    async requestReferenceSpace(kind) {
      if (kind !== "local-floor") throw new Error("no other");
      return { kind };
    }
    requestAnimationFrame(callback) {
      requestAnimationFrame((time) => callback(time, {
        session: this,
        getViewerPose: () => ({ views: [view] }),
        getJointPose: ({ name }) => {
          const [x, y, z] = emulated.joints[name];
          return { transform: { position: new DOMPoint(x, y, z) } };
        },
      }));
    }
  }
  globalThis.XRWebGLLayer = class {
    constructor(session, gl) { Object.assign(this, { gl, framebuffer: null }); }
    getViewport() { return { x: 0, y: 0, width: this.gl.drawingBufferWidth, height: this.gl.drawingBufferHeight }; }
  };
  WebGLRenderingContext.prototype.makeXRCompatible = async () => {};
  Object.defineProperty(navigator, "xr", {
    value: {
      isSessionSupported: async (mode) => mode === "immersive-vr",
      requestSession: async (mode, { requiredFeatures }) => {
        if (!requiredFeatures.includes("hand-tracking")) throw new Error("no hands were asked for");
        return (emulated.session = new Session());
      },
    },
  });
}
