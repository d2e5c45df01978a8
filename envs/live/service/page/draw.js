// Surfaces in WebGL: as many as the twin has links, each with its pose.

import { multiply, placed } from "./matrix.js";

const VERTEX = `
attribute vec3 place, normal;
uniform mat4 seen, posed;
varying vec3 facing, world;
void main() {
  vec4 there = posed * vec4(place, 1.0);
  facing = mat3(posed) * normal;
  world = there.xyz;
  gl_Position = seen * there;
}`;
const FRAGMENT = `
precision mediump float;
varying vec3 facing, world;
uniform vec3 colour;
uniform float ground;
void main() {
  vec3 n = normalize(facing);
  float light = 0.45 + 0.45 * max(dot(n, normalize(vec3(-0.4, -0.5, 1.0))), 0.0) + 0.15 * max(dot(n, normalize(vec3(0.7, 0.6, 0.2))), 0.0);
  vec3 shown = colour;
  if (ground > 0.5) {
    vec2 cell = abs(fract(world.xy / 0.05 + 0.5) - 0.5) * 0.05;
    shown = mix(colour * 0.93, colour, smoothstep(0.0004, 0.0012, min(cell.x, cell.y)));
    shown = mix(shown, vec3(0.933, 0.941, 0.953), smoothstep(0.35, 0.6, length(world.xy)));
  }
  gl_FragColor = vec4(shown * min(light, 1.05), 1.0);
}`;

export class Drawing {
  constructor(gl) {
    this.gl = gl;
    this.program = link(gl, VERTEX, FRAGMENT);
    this.at = {};
    for (const name of ["seen", "posed", "colour", "ground"]) this.at[name] = gl.getUniformLocation(this.program, name);
    this.moving = [];
    this.still = [];
    const g = 0.6;
    const table = { colour: [0.93, 0.93, 0.92], smooth: true };
    this.table = this.surface(table, new Float32Array([-g, -g, 0, g, -g, 0, g, g, 0, -g, g, 0]), new Uint32Array([0, 1, 2, 0, 2, 3]));
    this.table.pose = placed([0, 0, 0, 1, 0, 0, 0]);
  }

  // What a scene message says.
  show(scene) {
    for (const { buffer } of [...this.moving, ...this.still]) this.gl.deleteBuffer(buffer);
    const made = (said) => this.surface(said, numbers(said.vertices, Float32Array), numbers(said.faces, Uint32Array));
    this.moving = scene.moving.map(made);
    this.still = scene.still.map((said) => Object.assign(made(said), { pose: placed(said.pose) }));
  }

  move(poses) {
    this.moving.forEach((surface, k) => (surface.pose = placed(poses, 7 * k)));
  }

  // One eye: `projection` and `view` are its matrices, the view from the world of the table.
  draw(projection, view) {
    const { gl, at } = this;
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(at.seen, false, multiply(projection, view));
    for (const surface of [this.table, ...this.still, ...this.moving]) {
      if (!surface.pose) continue;
      gl.bindBuffer(gl.ARRAY_BUFFER, surface.buffer);
      for (const [name, first] of [["place", 0], ["normal", 12]]) {
        const place = gl.getAttribLocation(this.program, name);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, first);
      }
      gl.uniformMatrix4fv(at.posed, false, surface.pose);
      gl.uniform3fv(at.colour, surface.colour);
      gl.uniform1f(at.ground, surface === this.table ? 1 : 0);
      gl.drawArrays(gl.TRIANGLES, 0, surface.count);
    }
  }

  // Triangles one after another, each corner with its place and its normal.
  surface(said, vertices, faces) {
    const { gl } = this;
    const corners = new Float32Array(6 * faces.length);
    const normals = said.smooth ? smoothNormals(vertices, faces) : null;
    for (let f = 0; f < faces.length; f += 3) {
      const flat = faceNormal(vertices, faces, f);
      for (let k = 0; k < 3; k++) {
        const v = faces[f + k];
        corners.set(vertices.subarray(3 * v, 3 * v + 3), 6 * (f + k));
        corners.set(normals ? normals.subarray(3 * v, 3 * v + 3) : flat, 6 * (f + k) + 3);
      }
    }
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    return { buffer, count: faces.length, colour: said.colour, pose: null };
  }
}

function faceNormal(vertices, faces, f) {
  const [a, b, c] = [0, 1, 2].map((k) => vertices.subarray(3 * faces[f + k], 3 * faces[f + k] + 3));
  const [u, v] = [b, c].map((p) => [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
  return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
}

function smoothNormals(vertices, faces) {
  const sums = new Float32Array(vertices.length);
  for (let f = 0; f < faces.length; f += 3) {
    const normal = faceNormal(vertices, faces, f);
    for (let k = 0; k < 3; k++) for (let c = 0; c < 3; c++) sums[3 * faces[f + k] + c] += normal[c];
  }
  return sums;
}

function numbers(base64, Kind) {
  return new Kind(Uint8Array.from(atob(base64), (c) => c.charCodeAt(0)).buffer);
}

function link(gl, ...sources) {
  const program = gl.createProgram();
  sources.forEach((source, k) => {
    const shader = gl.createShader(k ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  });
  gl.linkProgram(program);
  return program;
}
