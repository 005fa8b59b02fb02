// SPDX-License-Identifier: Apache-2.0
// Draws the scene with WebGL: in space, and as outlines over the camera's picture.

import { cross, css, inverseRigid, lookAt, multiply, normalized, perspective, pinhole, poseMatrix, scale, seriesColor, sub, add, transform, warmColor, warmOpacity } from './drawing.js';

const meshVertex = `#version 300 es
in vec3 position; in vec3 normal; uniform mat4 toClip; uniform mat4 toWorld; out vec3 n;
void main() { gl_Position = toClip * vec4(position, 1.0); n = mat3(toWorld) * normal; }`;
const meshFragment = `#version 300 es
precision highp float; in vec3 n; uniform vec4 color; uniform float lit; out vec4 result;
void main() {
  vec3 m = normalize(n);
  float light = 0.50 + 0.32 * abs(dot(m, normalize(vec3(0.35, -0.5, 0.8)))) + 0.18 * abs(m.z);
  result = vec4(color.rgb * mix(1.0, light, lit), color.a);
}`;
const paintVertex = `#version 300 es
in vec3 position; in vec4 tint; uniform mat4 toClip; uniform float radius; out vec4 t;
void main() { gl_Position = toClip * vec4(position, 1.0); gl_PointSize = clamp(radius / gl_Position.w, 2.0, 64.0); t = tint; }`;
const paintFragment = `#version 300 es
precision highp float; in vec4 t; uniform float radius; out vec4 result;
void main() {
  float fade = 1.0;
  if (radius > 0.0) { vec2 d = 2.0 * gl_PointCoord - 1.0; fade = max(0.0, 1.0 - dot(d, d)); }
  result = vec4(t.rgb, t.a * fade);
}`;
const edgeVertex = `#version 300 es
void main() { vec2 p = vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0; gl_Position = vec4(p, 0.0, 1.0); }`;
// Outlines where labels change, and a tint within. Labels are the red channel in 255ths; 0 is nothing.
const edgeFragment = `#version 300 es
precision highp float; uniform sampler2D labels; uniform vec3 colors[8]; uniform int thick; uniform bool dashed; out vec4 result;
int at(ivec2 p) { return int(texelFetch(labels, clamp(p, ivec2(0), textureSize(labels, 0) - 1), 0).r * 255.0 + 0.5); }
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy);
  int mine = at(p), shown = mine; bool edge = false;
  for (int i = -1; i <= 1; ++i) for (int j = -1; j <= 1; ++j) {
    int other = at(p + thick * ivec2(i, j));
    if (other != mine) { edge = true; if (shown == 0) shown = other; }
  }
  if (shown == 0) discard;
  if (edge && dashed && int(gl_FragCoord.x + gl_FragCoord.y) / (5 * thick) % 2 == 1) discard;
  float alpha = edge ? 1.0 : mine == 0 ? 0.0 : dashed ? 0.10 : 0.22;
  result = vec4(colors[(shown - 1) % 8], alpha);
}`;

function makeProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.bindAttribLocation(program, 0, 'position');
  gl.bindAttribLocation(program, 1, 'normal');
  gl.bindAttribLocation(program, 2, 'tint');
  gl.linkProgram(program);
  const at = {};
  for (const name of ['toClip', 'toWorld', 'color', 'lit', 'radius', 'labels', 'colors', 'thick', 'dashed'])
    at[name] = gl.getUniformLocation(program, name);
  return { program, at };
}

// Triangles with the normals of their planes: edges stay sharp.
function flatTriangles({ vertices, triangles }) {
  const data = new Float32Array(triangles.length * 6);
  const corner = (i) => [vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]];
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [corner(triangles[t]), corner(triangles[t + 1]), corner(triangles[t + 2])];
    const n = normalized(cross(sub(b, a), sub(c, a)));
    [a, b, c].forEach((p, k) => data.set([...p, ...n], 6 * (t + k)));
  }
  return data;
}

// One canvas, its programs, and the meshes of the scene on its card.
class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = this.gl = canvas.getContext('webgl2', { antialias: true, premultipliedAlpha: false });
    if (!gl) return;
    this.mesh = makeProgram(gl, meshVertex, meshFragment);
    this.paint = makeProgram(gl, paintVertex, paintFragment);
    this.meshes = new Map();
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }
  setMeshes(named) {
    const gl = this.gl;
    for (const { vao, buffer } of this.meshes.values()) { gl.deleteVertexArray(vao); gl.deleteBuffer(buffer); }
    this.meshes.clear();
    for (const [key, mesh] of named) {
      const data = flatTriangles(mesh), vao = gl.createVertexArray(), buffer = gl.createBuffer();
      gl.bindVertexArray(vao);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      for (const [i, offset] of [[0, 0], [1, 12]]) {
        gl.enableVertexAttribArray(i);
        gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 24, offset);
      }
      let radius = 0;
      for (let i = 0; i < mesh.vertices.length; i += 3) radius = Math.max(radius, Math.hypot(mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2]));
      this.meshes.set(key, { vao, buffer, count: data.length / 6, radius });
    }
    gl.bindVertexArray(null);
  }
  fit() {
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const w = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), h = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== w || this.canvas.height !== h) { this.canvas.width = w; this.canvas.height = h; }
    this.gl.viewport(0, 0, w, h);
  }
  drawMesh(key, pose, clipFromWorld, color, lit = 1) {
    const mesh = this.meshes.get(key);
    if (!mesh || !pose) return;
    const gl = this.gl, toWorld = poseMatrix(pose), { at } = this.mesh;
    gl.useProgram(this.mesh.program);
    gl.uniformMatrix4fv(at.toClip, false, multiply(clipFromWorld, toWorld));
    gl.uniformMatrix4fv(at.toWorld, false, toWorld);
    gl.uniform4fv(at.color, color);
    gl.uniform1f(at.lit, lit);
    gl.bindVertexArray(mesh.vao);
    gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
  }
  // `numbers`: x, y, z, r, g, b, a for each corner; with a radius (pixels at 1 m) they are points.
  drawPaint(kind, numbers, clipFromWorld, radius = 0) {
    if (!numbers.length) return;
    const gl = this.gl;
    this.scratch ??= gl.createBuffer();
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.scratch);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STREAM_DRAW);
    gl.useProgram(this.paint.program);
    gl.enableVertexAttribArray(0);
    gl.enableVertexAttribArray(2);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 28, 0);
    gl.vertexAttribPointer(2, 4, gl.FLOAT, false, 28, 12);
    gl.uniformMatrix4fv(this.paint.at.toClip, false, clipFromWorld);
    gl.uniform1f(this.paint.at.radius, radius);
    gl.drawArrays(kind, 0, numbers.length / 7);
    gl.disableVertexAttribArray(2);
  }
}

const shade = (rgb, alpha) => [rgb[0] / 255, rgb[1] / 255, rgb[2] / 255, alpha];

function namedMeshes(scene) {
  const named = new Map();
  for (const model of scene.models) named.set('model ' + model.name, model.mesh);
  scene.supports.forEach((s, i) => named.set('support ' + i, s.mesh));
  scene.robot.forEach((r, i) => named.set('robot ' + i, r.mesh));
  return named;
}
const modelKey = (scene, name) => {
  const of = scene.objects.find((o) => o.name === name);
  return 'model ' + (of ? of.model : '');
};
const bodies = (list, poses) => list.map((body, i) => ({ body, pose: poses ? poses[i] : body.pose }));

// The scene in space, turned by hand.
export class SpaceView {
  constructor(canvas, labels, onPick) {
    this.painter = new Painter(canvas);
    this.labels = labels;
    this.onPick = onPick;
    this.orbit = { target: [0, 0, 0.1], distance: 1.6, yaw: -0.9, pitch: 0.55 };
    this.listen(canvas);
  }
  get works() { return !!this.painter.gl; }
  setScene(scene) {
    if (!this.works) return;
    this.scene = scene;
    this.painter.setMeshes(namedMeshes(scene));
    this.needsFrame = true;
  }
  // Everything that moves, near enough to fill the picture.
  frame(step) {
    const points = step.objects.filter((o) => o.state !== 'lost').map((o) => o.pose.slice(0, 3));
    for (const pose of step.robot) points.push(pose.slice(0, 3));
    step.supports.forEach((pose, i) => {  // not a floor: it would make all else small
      const mesh = this.painter.meshes.get('support ' + i);
      if (mesh && mesh.radius < 0.5) points.push(pose.slice(0, 3));
    });
    if (!points.length) return;
    const low = points[0].map((_, k) => Math.min(...points.map((p) => p[k])));
    const high = points[0].map((_, k) => Math.max(...points.map((p) => p[k])));
    this.orbit.target = scale(add(low, high), 0.5);
    this.orbit.distance = Math.max(0.9, 2.2 * Math.hypot(...sub(high, low)));
    const eye = step.camera.pose.slice(0, 3), from = sub(eye, this.orbit.target);
    this.orbit.yaw = Math.atan2(from[1], from[0]) + 0.5;
    this.orbit.pitch = 0.5;
    this.needsFrame = this.turned = false;
  }
  isOutOfSight(step) {
    const clip = this.clipFromWorld();
    return step.objects.some((o) => {
      const [x, y, , w] = transform(clip, o.pose.slice(0, 3));
      return o.state === 'tracked' && (w <= 0 || Math.max(Math.abs(x), Math.abs(y)) > 0.85 * w);
    });
  }
  // From where the camera of the robot is.
  fromCamera(step) {
    const m = poseMatrix(step.camera.pose), eye = step.camera.pose.slice(0, 3), ahead = [m[8], m[9], m[10]];
    const distance = Math.max(0.3, Math.hypot(...sub(eye, this.orbit.target)));
    this.turned = true;
    this.orbit = { target: add(eye, scale(ahead, distance)), distance, yaw: Math.atan2(-ahead[1], -ahead[0]), pitch: Math.asin(Math.max(-1, Math.min(1, -ahead[2]))) };
  }
  eye() {
    const { target, distance, yaw, pitch } = this.orbit;
    return add(target, scale([Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)], distance));
  }
  clipFromWorld() {
    const { canvas } = this.painter;
    return multiply(perspective(0.8, canvas.width / canvas.height, 0.02 * this.orbit.distance, 60 * this.orbit.distance),
      lookAt(this.eye(), this.orbit.target, [0, 0, 1]));
  }
  // `colors` by object; `answer` is what shownEnds() takes from a prediction.
  draw(step, { dark, ghosts, selected, colors, answer }) {
    if (!this.works || !this.scene || !step) return;
    const { painter, scene } = this, { gl } = painter;
    painter.fit();
    // Until somebody turns the scene, what is tracked stays in sight.
    if (this.needsFrame || (!this.turned && this.isOutOfSight(step))) this.frame(step);
    const back = dark ? [0.102, 0.118, 0.145] : [0.914, 0.925, 0.945];
    gl.clearColor(...back, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const clip = this.clip = this.clipFromWorld();
    bodies(scene.supports, step.supports).forEach(({ body, pose }, i) => painter.drawMesh('support ' + i, pose, clip, [...body.color.map((c) => 0.55 * c + (dark ? 0.15 : 0.42)), 1]));
    bodies(scene.robot, step.robot).forEach(({ pose }, i) => painter.drawMesh('robot ' + i, pose, clip, dark ? [0.55, 0.58, 0.64, 1] : [0.42, 0.45, 0.5, 1]));
    for (const object of step.objects) {
      const model = scene.models.find((m) => 'model ' + m.name === modelKey(scene, object.name));
      if (object.state === 'tracked' && model) painter.drawMesh(modelKey(scene, object.name), object.pose, clip, [...model.color, 1]);
    }
    if (!scene.supports.length) this.drawGrid(clip, dark);
    this.drawCamera(step, clip, dark);
    gl.depthMask(false);
    if (answer) this.drawAnswer(answer, clip);
    step.objects.forEach((object) => {
      const color = colors.get(object.name), key = modelKey(scene, object.name);
      const seen = object.state === 'tracked';
      if (!seen) gl.disable(gl.DEPTH_TEST);  // what is hidden is drawn through what hides it
      if (!seen && object.state !== 'lost') painter.drawMesh(key, object.pose, clip, shade(color, 0.35));
      if (ghosts) for (const pose of object.ghosts) painter.drawMesh(key, pose, clip, shade(color, object.name === selected ? 0.1 : 0.05), 0.5);
      if (object.region) {
        const numbers = [];
        for (let i = 0; i < object.region.length; i += 3) numbers.push(...object.region.slice(i, i + 3), ...shade(color, 0.45));
        painter.drawPaint(gl.POINTS, numbers, clip, 0.04 * painter.canvas.height);
      }
      gl.enable(gl.DEPTH_TEST);
    });
    this.drawLabels(step, selected, colors);
  }
  // Where no support is known, the plane z = 0 in tenths of a metre.
  drawGrid(clip, dark) {
    const [x, y] = this.orbit.target.map((c) => Math.round(10 * c) / 10), numbers = [];
    for (let i = -10; i <= 10; ++i) {
      const color = shade(dark ? [120, 130, 145] : [140, 148, 160], i % 5 === 0 ? 0.7 : 0.3), c = i / 10;
      numbers.push(x + c, y - 1, 0, ...color, x + c, y + 1, 0, ...color, x - 1, y + c, 0, ...color, x + 1, y + c, 0, ...color);
    }
    this.painter.drawPaint(this.painter.gl.LINES, numbers, clip);
  }
  drawCamera(step, clip, dark) {
    for (const camera of step.cameras ?? [step.camera]) if (camera && camera.width) this.drawOneCamera(camera, clip, dark);
  }
  drawOneCamera({ pose, width, height, fx, fy, cx, cy }, clip, dark) {
    const m = poseMatrix(pose), reach = 0.12;
    const corner = (u, v) => transform(m, [(u - cx) / fx * reach, (v - cy) / fy * reach, reach]).slice(0, 3);
    const eye = pose.slice(0, 3), c = [corner(0, 0), corner(width, 0), corner(width, height), corner(0, height)];
    const color = shade(dark ? [200, 205, 215] : [70, 76, 88], 0.9), numbers = [];
    c.forEach((p, i) => numbers.push(...eye, ...color, ...p, ...color, ...p, ...color, ...c[(i + 1) % 4], ...color));
    this.painter.drawPaint(this.painter.gl.LINES, numbers, clip);
  }
  // Where things end: the heat map on the lowest end, final poses by their weights, and the typical runs.
  drawAnswer({ runs, ends }, clip) {
    const { painter } = this, { gl } = painter;
    for (const { run, color } of runs) {
      const { states } = run.trajectory, count = states.length ? states[0].objects.length : 0, numbers = [];
      for (let k = 0; k < count; ++k)
        for (let i = 1; i < states.length; ++i)
          for (const of of [states[i - 1], states[i]]) numbers.push(...of.objects[k].X_WO.position, ...shade(color, 0.9));
      painter.drawPaint(gl.LINES, numbers, clip);
    }
    for (const { end, colorOf } of ends) {
      this.drawHeatMap(end, clip);
      for (const part of end.components.slice(0, 12)) {
        const { position, rotation } = part.mean, alpha = Math.min(0.7, 0.1 + 2 * part.weight);
        painter.drawMesh(modelKey(this.scene, end.object), [...position, ...rotation.quaternion_wxyz], clip, shade(colorOf(part.outcome), alpha));
      }
    }
  }
  // Between the middles of the cells the mass goes over evenly.
  drawHeatMap({ heat_map: { cell, x0, y0, nx, ny, mass }, components, mean_position }, clip) {
    const most = Math.sqrt(Math.max(...mass, 1e-12)), numbers = [];
    const z = Math.min(...components.map((c) => c.mean.position[2]), mean_position[2]) - 0.002;
    const at = (x, y) => x < 0 || y < 0 || x >= nx || y >= ny ? 0 : Math.sqrt(mass[y * nx + x]) / most;
    const corner = (x, y) => { const value = at(x, y); return [x0 + (x + 0.5) * cell, y0 + (y + 0.5) * cell, z, ...shade(warmColor(value), warmOpacity(value))]; };
    for (let y = -1; y < ny; ++y)
      for (let x = -1; x < nx; ++x) {
        if (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1) < 0.02) continue;
        numbers.push(...corner(x, y), ...corner(x + 1, y), ...corner(x + 1, y + 1), ...corner(x, y), ...corner(x + 1, y + 1), ...corner(x, y + 1));
      }
    this.painter.drawPaint(this.painter.gl.TRIANGLES, numbers, clip);
  }
  drawLabels(step, selected, colors) {
    const { canvas } = this.painter, spans = [];
    for (const object of step.objects) {
      if (object.state === 'lost') continue;
      const mesh = this.painter.meshes.get(modelKey(this.scene, object.name));
      const top = [object.pose[0], object.pose[1], object.pose[2] + 0.7 * (mesh ? mesh.radius : 0.05)];
      const [x, y, , w] = transform(this.clip, top);
      if (w <= 0 || Math.abs(x) > w || Math.abs(y) > w) continue;
      const span = document.createElement('span');
      span.textContent = object.state === 'tracked' ? object.name : object.name + ' (' + object.state + ')';
      span.style.left = (0.5 + 0.5 * x / w) * canvas.clientWidth + 'px';
      span.style.top = (0.5 - 0.5 * y / w) * canvas.clientHeight + 'px';
      span.style.borderColor = css(colors.get(object.name));
      if (object.name === selected) span.style.fontWeight = '700';
      spans.push(span);
    }
    this.labels.replaceChildren(...spans);
  }
  // The object whose middle is nearest to the pixel.
  pick(step, px, py) {
    let best = null;
    const { canvas } = this.painter;
    for (const object of step.objects) {
      const [x, y, , w] = transform(this.clip, object.pose.slice(0, 3));
      if (w <= 0) continue;
      const away = Math.hypot((0.5 + 0.5 * x / w) * canvas.clientWidth - px, (0.5 - 0.5 * y / w) * canvas.clientHeight - py);
      if (away < 60 && (!best || away < best.away)) best = { away, name: object.name };
    }
    return best ? best.name : null;
  }
  listen(canvas) {
    const pointers = new Map();
    let moved = 0;
    const turn = (dx, dy) => {
      this.orbit.yaw -= 0.008 * dx;
      this.orbit.pitch = Math.max(-1.5, Math.min(1.5, this.orbit.pitch + 0.008 * dy));
    };
    const shift = (dx, dy) => {
      const back = normalized(sub(this.eye(), this.orbit.target)), right = normalized(cross([0, 0, 1], back)), up = cross(back, right);
      const per = 0.85 * this.orbit.distance / canvas.clientHeight;
      this.orbit.target = add(this.orbit.target, add(scale(right, -dx * per), scale(up, dy * per)));
    };
    const changed = () => { this.turned = true; canvas.dispatchEvent(new Event('turned')); };
    canvas.addEventListener('pointerdown', (e) => { pointers.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); moved = 0; });
    canvas.addEventListener('pointermove', (e) => {
      const before = pointers.get(e.pointerId);
      if (!before) return;
      const now = [e.clientX, e.clientY], [dx, dy] = sub(now, before);
      moved += Math.abs(dx) + Math.abs(dy);
      if (pointers.size === 2) {
        const other = [...pointers.entries()].find(([id]) => id !== e.pointerId)[1];
        this.orbit.distance *= Math.hypot(...sub(before, other)) / Math.max(1, Math.hypot(...sub(now, other)));
        shift(dx / 2, dy / 2);
      } else if (e.shiftKey || e.buttons === 2) shift(dx, dy);
      else turn(dx, dy);
      pointers.set(e.pointerId, now);
      changed();
    });
    const end = (e) => {
      if (pointers.delete(e.pointerId) && e.type === 'pointerup' && moved < 4) {
        const box = canvas.getBoundingClientRect();
        this.onPick(e.clientX - box.left, e.clientY - box.top);
      }
    };
    for (const kind of ['pointerup', 'pointercancel']) canvas.addEventListener(kind, end);
    canvas.addEventListener('contextmenu', (e) => e.preventDefault());
    canvas.addEventListener('wheel', (e) => { e.preventDefault(); this.orbit.distance = Math.max(0.05, Math.min(20, this.orbit.distance * Math.exp(0.0012 * e.deltaY))); changed(); }, { passive: false });
  }
}

// Outlines of the belief over the camera's picture; dashed where an object is not seen.
export class OverlayView {
  constructor(canvas) {
    this.painter = new Painter(canvas);
    const { gl } = this.painter;
    if (gl) this.edge = makeProgram(gl, edgeVertex, edgeFragment);
  }
  setScene(scene) {
    if (!this.painter.gl) return;
    this.scene = scene;
    this.painter.setMeshes(namedMeshes(scene));
  }
  target(w, h) {
    const { gl } = this.painter;
    if (this.labels && this.labels.w === w && this.labels.h === h) return this.labels;
    if (this.labels) { gl.deleteFramebuffer(this.labels.frame); gl.deleteTexture(this.labels.texture); gl.deleteRenderbuffer(this.labels.depth); }
    const texture = gl.createTexture(), depth = gl.createRenderbuffer(), frame = gl.createFramebuffer();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, w, h, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, w, h);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    this.labels = { texture, depth, frame, w, h };
    return this.labels;
  }
  clear() {
    const { gl } = this.painter;
    if (!gl) return;
    this.painter.fit();
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }
  draw(step, indexes) {
    const { painter, scene } = this, { gl } = painter;
    if (!gl || !scene) return;
    this.clear();
    if (!step.camera.width) return;
    const clip = multiply(pinhole(step.camera), inverseRigid(poseMatrix(step.camera.pose)));
    const seen = step.objects.filter((o) => o.state === 'tracked' || o.state === 'doubtful');
    const hidden = step.objects.filter((o) => o.state === 'unseen');
    this.outline(clip, step, seen, indexes, true);
    if (hidden.length) this.outline(clip, step, hidden, indexes, false);
  }
  outline(clip, step, objects, indexes, occluded) {
    const { painter, scene } = this, { gl } = painter, { canvas } = painter;
    const target = this.target(canvas.width, canvas.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.disable(gl.BLEND);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const label = (n) => [n / 255, 0, 0, 1];
    if (occluded) {
      bodies(scene.supports, step.supports).forEach(({ pose }, i) => painter.drawMesh('support ' + i, pose, clip, label(0), 0));
      bodies(scene.robot, step.robot).forEach(({ pose }, i) => painter.drawMesh('robot ' + i, pose, clip, label(0), 0));
    }
    for (const object of objects) painter.drawMesh(modelKey(scene, object.name), object.pose, clip, label(1 + indexes.get(object.name)), 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.enable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(this.edge.program);
    gl.bindVertexArray(null);
    gl.bindTexture(gl.TEXTURE_2D, target.texture);
    gl.uniform1i(this.edge.at.labels, 0);
    gl.uniform1i(this.edge.at.thick, Math.max(1, Math.round(canvas.width / 600)));
    gl.uniform1i(this.edge.at.dashed, occluded ? 0 : 1);
    gl.uniform3fv(this.edge.at.colors, new Float32Array(Array.from({ length: 8 }, (_, i) => seriesColor(i).map((c) => c / 255)).flat()));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}
