// The page: poses in, newest wins, and a word back on what was drawn; the panel; the keys.

import { Drawing } from "./draw.js";
import { headset } from "./headset.js";
import { looking, perspective } from "./matrix.js";

const by = (id) => document.getElementById(id);
const token = new URLSearchParams(location.search).get("token");
export const address = (path) => `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${path}?token=${encodeURIComponent(token)}`;

const canvas = by("view");
const software = drawnInSoftware();
const gl = canvas.getContext("webgl", { xrCompatible: !software, antialias: !software });
const drawing = gl && new Drawing(gl);
let sharpness = software ? 0.5 : 1; // of the canvas: less where pictures would come late
let pace = 0; // ms between pictures, smoothed
let before = 0;
const eye = { around: -0.9, above: 0.5, away: 0.75, centre: [-0.03, 0, 0.09] };
let socket = null;
let newest = null; // what is to be drawn
let drawn = 0; // what was drawn at the last picture, and is on the screen by the next
let scene = null;
let shown = -1; // the number of the picture on the screen
let turned = true; // whether it has to be drawn anew though the twin stands still
const xr = headset(drawing, address, () => scene, () => newest, say);

function connect() {
  socket = new WebSocket(address("/view"));
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => {
    if (typeof data !== "string") {
      const [number, tracked] = new Uint32Array(data, 0, 2);
      newest = { number, tracked: tracked === 1, poses: new Float32Array(data, 8) };
      return;
    }
    const told = JSON.parse(data);
    if (told.moving && drawing) drawing.show((scene = told));
    if (told.panel) panel(told.panel);
  };
  socket.onclose = ({ reason }) => {
    by("state").textContent = reason || "not connected; trying again";
    setTimeout(connect, 1000);
  };
}

function wish(what) {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ wish: what }));
}

function tell(number) {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ drawn: number }));
}

// Whether this computer has no graphics card that the browser uses.
function drawnInSoftware() {
  const probe = document.createElement("canvas").getContext("webgl");
  const told = probe?.getExtension("WEBGL_debug_renderer_info");
  const name = told ? probe.getParameter(told.UNMASKED_RENDERER_WEBGL) : "";
  probe?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

// Draw fewer pixels where pictures take long.
function keepPace(now) {
  pace += 0.05 * (Math.min(now - before, 200) - pace);
  before = now;
  if (pace > 30 && sharpness > 0.25) [sharpness, pace] = [0.8 * sharpness, 17];
}

function picture(now) {
  requestAnimationFrame(picture);
  keepPace(now);
  if (xr.presenting()) return;
  if (drawn) tell(drawn);
  drawn = 0;
  if (!drawing) return;
  if (newest?.number === shown && !turned) return;
  turned = false;
  const scale = sharpness * devicePixelRatio;
  const width = Math.round(scale * canvas.clientWidth), height = Math.round(scale * canvas.clientHeight);
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.clearColor(0.933, 0.941, 0.953, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  if (newest && scene) {
    drawing.move(newest.poses);
    shown = drawn = newest.number;
  }
  const flat = eye.away * Math.cos(eye.above);
  const [x, y, z] = eye.centre;
  const from = [x + flat * Math.cos(eye.around), y + flat * Math.sin(eye.around), z + eye.away * Math.sin(eye.above)];
  drawing.draw(perspective(0.7, width / height, 0.02, 5), looking(from, eye.centre));
}
xr.drew = tell;

const STAGES = { source: "waiting", tracking: "tracking", retargeting: "retargeting", physics: "physics", sending: "sending", wire: "frame to wire", picture: "age of picture", behind: "physics behind" };

function panel(told) {
  by("state").textContent = `${told.source}: ${told.state}`;
  by("notice").textContent = told.notice;
  by("record").className = told.recording ? "on" : "";
  by("record").textContent = told.recording ? "Stop recording" : "Record";
  by("stages").replaceChildren(
    ...Object.entries(STAGES).map(([name, label]) => {
      const row = document.createElement("tr");
      const { p50, p99, count } = told.stages_ms[name];
      row.append(...[label, count ? p50.toFixed(1) : "–", count ? p99.toFixed(1) : "–"].map((text) => {
        const cell = document.createElement("td");
        cell.textContent = text;
        return cell;
      }));
      return row;
    }),
  );
  const { frames, replaced, lost, refused, pictures_dropped } = told.counts;
  by("counts").textContent = `${frames} frames, ${replaced} overtaken, ${lost} without a hand, ${refused} refused; ${pictures_dropped} pictures dropped`;
}

function say(text) {
  by("xr").textContent = text;
}

addEventListener("keydown", (event) => {
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
  const what = { " ": "reset", r: "record", R: "record" }[event.key];
  if (!what) return;
  event.preventDefault();
  wish(what);
});
by("reset").onclick = (event) => (wish("reset"), event.target.blur());
by("record").onclick = (event) => (wish("record"), event.target.blur());
canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
canvas.onpointermove = (event) => {
  if (!event.buttons) return;
  turned = true;
  eye.around -= 0.008 * event.movementX;
  eye.above = Math.min(1.5, Math.max(-0.2, eye.above + 0.008 * event.movementY));
};
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  turned = true;
  eye.away = Math.min(3, Math.max(0.2, eye.away * Math.exp(0.001 * event.deltaY)));
}, { passive: false });

if (!drawing) by("notice").textContent = "this browser has no WebGL: figures only";
connect();
requestAnimationFrame(picture);
addEventListener("resize", () => (turned = true));
