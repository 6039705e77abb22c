// Viewer of a page that emboss-render writes. It needs WebGL 2 and DecompressionStream, and no network.
'use strict';

const $ = (id) => document.getElementById(id);
const scene = JSON.parse($('scene').textContent);

// --- Numbers as the page packs them -----------------------------------------------------------------

// The bytes of an element with base64 text of a zlib stream.
async function unpacked(id) {
  const text = atob($(id).textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  $(id).remove();
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Planes of low and high bytes of zigzag differences: rows of `axes` times `count` numbers, each row
// the difference from the row before, and each number that from its neighbour.
function rowsOf(bytes, rows, axes, count) {
  const all = rows * axes * count, result = [];
  let at = 0, before = new Uint16Array(axes * count);
  for (let row = 0; row < rows; ++row) {
    const now = new Uint16Array(axes * count);
    for (let axis = 0; axis < axes; ++axis) {
      let sum = 0;
      for (let i = 0, to = axis; i < count; ++i, to += axes, ++at) {
        const zigzag = bytes[at] | bytes[all + at] << 8;
        sum += (zigzag >> 1) ^ -(zigzag & 1);
        now[to] = before[to] + sum;
      }
    }
    result.push(now);
    before = now;
  }
  return result;
}

function cornersOf(bytes, count) {
  const corners = new Uint32Array(count);
  let last = 0;
  for (let i = 0; i < count; ++i) {
    const zigzag = (bytes[i] | bytes[count + i] << 8 | bytes[2 * count + i] << 16 | bytes[3 * count + i] << 24) >>> 0;
    last = (last + ((zigzag >>> 1) ^ -(zigzag & 1))) >>> 0;
    corners[i] = last;
  }
  return corners;
}

// --- Vectors and matrices (column by column, as WebGL takes them) --------------------------------------

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(...a);
const unit = (a) => plus([0, 0, 0], a, 1 / (norm(a) || 1));

function rotated(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return plus(plus(plus([0, 0, 0], v, c), cross(axis, v), s), axis, dot(axis, v) * (1 - c));
}

// --- Camera -------------------------------------------------------------------------------------------

const box = scene.box, middle = plus(box[0], minus(box[1], box[0]), 0.5), size = norm(minus(box[1], box[0])) || 1;
const camera = {...scene.camera};

function axesOf() {
  const back = unit(minus(camera.eye, camera.target)), right = unit(cross(camera.up, back));
  return {right, up: cross(back, right), back};
}

function orbit(across, down) {
  const {right} = axesOf();
  let from = rotated(minus(camera.eye, camera.target), camera.up, -across);
  const side = rotated(right, camera.up, -across), lifted = rotated(from, side, -down);
  if (Math.abs(dot(unit(lifted), unit(camera.up))) < 0.999) from = lifted;
  camera.eye = plus(camera.target, from);
}

function shift(across, down) {
  const {right, up} = axesOf(), step = plus(plus([0, 0, 0], right, -across * mmPerPixel()), up, down * mmPerPixel());
  camera.eye = plus(camera.eye, step);
  camera.target = plus(camera.target, step);
}

function zoom(factor) {
  const from = minus(camera.eye, camera.target), length = norm(from) * factor;
  if (length > size / 1000 && length < size * 100) camera.eye = plus(camera.target, from, factor);
}

function look(from, up) {
  camera.target = middle;
  camera.up = up;
  camera.eye = plus(middle, unit(from), size / 2 / Math.sin(camera.fov * Math.PI / 360));
}

const tangent = () => Math.tan(camera.fov * Math.PI / 360);
const shorter = () => Math.min(stage.width, stage.height);
// Of a plane through the target, in pixels of the screen.
const mmPerPixel = () => 2 * norm(minus(camera.eye, camera.target)) * tangent() / shorter();

function matrices() {
  const {right, up, back} = axesOf(), e = camera.eye;
  const view = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, -dot(right, e), -dot(up, e), -dot(back, e), 1];
  const far = norm(minus(e, middle)) + size, near = Math.max(far - 2 * size, far / 2000);
  const x = shorter() / stage.width / tangent(), y = shorter() / stage.height / tangent();
  const projection = [x, 0, 0, 0, 0, y, 0, 0, 0, 0, -(far + near) / (far - near), -1, 0, 0, -2 * far * near / (far - near), 0];
  return {view, projection};
}

// Pixels of a place; nothing behind the camera.
function pixelOf(place) {
  const {right, up, back} = axesOf(), seen = minus(place, camera.eye), depth = -dot(seen, back);
  if (!(depth > 0)) return null;
  const scale = shorter() / 2 / tangent() / depth;
  return [stage.width / 2 + dot(seen, right) * scale, stage.height / 2 - dot(seen, up) * scale];
}

// --- Drawing ------------------------------------------------------------------------------------------

const stage = {width: 1, height: 1, ratio: 1};
const state = {frame: 0, playing: false, field: scene.field, light: scene.light, clip: scene.clip ? 'given' : '', clipAt: 0.5, flip: false, arrows: true, curve: 0};
const canvas = $('canvas'), gl = canvas.getContext('webgl2', {antialias: true, preserveDrawingBuffer: true});
let program, ramp, parts = [], dirty = true;

const vertexShader = `#version 300 es
in vec3 at; in vec3 normal; in float value;
uniform vec3 origin; uniform float unit; uniform mat4 view, projection; uniform vec4 plane;
out vec3 seen, facing; out float share, beyond;
void main() {
  vec3 place = origin + unit * at;
  vec4 eye = view * vec4(place, 1.0);
  seen = eye.xyz;
  facing = mat3(view) * normal;
  share = value;
  beyond = dot(plane.xyz, place) - plane.w;
  gl_Position = projection * eye;
}`;
// Light as emboss-render has it: one over the left shoulder and a weaker one from the right, or that of an endoscope.
const fragmentShader = `#version 300 es
precision highp float;
in vec3 seen, facing; in float share, beyond;
uniform vec3 color; uniform sampler2D ramp; uniform bool field, cut, endoscope; uniform float reach; uniform vec2 middle; uniform float radius, tangent;
out vec4 pixel;
void main() {
  if (cut && beyond > 0.0) discard;
  vec3 n = normalize(facing), base = color;
  if (field) base = share < -0.5 ? vec3(0.6) : texture(ramp, vec2(share, 0.5)).rgb;
  float shade, gloss;
  if (endoscope) {
    vec3 to = vec3(0.0, 3.0, 0.0) - seen;
    float distance = length(to);
    if (!gl_FrontFacing) n = -n;
    vec3 l = to / distance;
    shade = (0.25 + 0.75 * max(0.0, dot(n, l))) * min(1.0, reach / distance);
    gloss = pow(max(0.0, dot(n, normalize(l + normalize(-seen)))), 60.0) * min(1.0, reach / distance);
  } else {
    if (!gl_FrontFacing) n = -n;
    vec3 l = normalize(vec3(-0.5, 0.6, 1.0));
    shade = 0.25 + 0.75 * min(1.0, max(0.0, dot(n, l)) + 0.35 * max(0.0, dot(n, normalize(vec3(1.0, -0.25, 0.2)))));
    gloss = pow(max(0.0, dot(n, normalize(l + vec3(0.0, 0.0, 1.0)))), 60.0);
  }
  vec3 lit = base * shade + (field ? 0.0 : 0.12) * gloss;
  if (cut && !gl_FrontFacing) lit = color * 0.7; // what is seen through the cut looks filled
  if (endoscope) {
    float from = length(gl_FragCoord.xy - middle) / radius, s = clamp((from - 0.35) / 0.65, 0.0, 1.0);
    lit *= (1.0 - 0.5 * s * s * (3.0 - 2.0 * s)) / (1.0 + tangent * tangent * from * from);
    if (from > 1.0) lit = vec3(0.0);
  }
  pixel = vec4(lit, 1.0);
}`;

function compiled() {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertexShader], [gl.FRAGMENT_SHADER, fragmentShader]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  ['at', 'normal', 'value'].forEach((name, place) => gl.bindAttribLocation(made, place, name));
  gl.linkProgram(made);
  const places = {};
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); ++i) {
    const {name} = gl.getActiveUniform(made, i);
    places[name] = gl.getUniformLocation(made, name);
  }
  return {made, places};
}

async function load(part) {
  const corners = cornersOf(await unpacked(part.corners), 3 * part.triangles);
  const rows = rowsOf(await unpacked(part.places), part.frames + 1, 3, part.points);
  const values = part.values ? rowsOf(await unpacked(part.values), part.frames, 1, part.points) : null;
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  const buffers = [0, 1, 2].map((place) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, place < 2 ? 3 : 1, place === 0 ? gl.UNSIGNED_SHORT : gl.FLOAT, false, 0, 0);
    return buffer;
  });
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
  return {...part, corners, rest: rows[0], rows: rows.slice(1), stored: values, array, buffers, shown: -1, colored: ''};
}

function normalsOf(places, corners) {
  const normals = new Float32Array(places.length);
  for (let t = 0; t < corners.length; t += 3) {
    const a = 3 * corners[t], b = 3 * corners[t + 1], c = 3 * corners[t + 2];
    const ux = places[b] - places[a], uy = places[b + 1] - places[a + 1], uz = places[b + 2] - places[a + 2];
    const vx = places[c] - places[a], vy = places[c + 1] - places[a + 1], vz = places[c + 2] - places[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (const i of [a, b, c]) {
      normals[i] += x;
      normals[i + 1] += y;
      normals[i + 2] += z;
    }
  }
  return normals;
}

// The share of the ramp of each point; -1 where there is no value.
function sharesOf(part, row) {
  const field = scene.fields[state.field], shares = new Float32Array(part.points).fill(-1);
  const span = field.greatest - field.least || 1, places = part.rows[row], rest = part.rest;
  for (let i = 0; i < part.points; ++i) {
    let value = NaN;
    if (!field.stored) value = part.step * Math.hypot(places[3 * i] - rest[3 * i], places[3 * i + 1] - rest[3 * i + 1], places[3 * i + 2] - rest[3 * i + 2]);
    else if (part.stored && part.stored[row][i] < 65535) value = field.low + (field.high - field.low) * part.stored[row][i] / 65534;
    if (value === value) shares[i] = Math.min(1, Math.max(0, (value - field.least) / span));
  }
  return shares;
}

function upload(part, place, data) {
  gl.bindBuffer(gl.ARRAY_BUFFER, part.buffers[place]);
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
}

function prepare(part, row, colored) {
  if (part.shown !== row) {
    upload(part, 0, part.rows[row]);
    upload(part, 1, normalsOf(part.rows[row], part.corners));
    if (!part.colored) upload(part, 2, new Float32Array(part.points));
  }
  const field = colored && scene.fields[state.field];
  const key = colored ? [row, state.field, field.least, field.greatest].join() : 'none';
  if (colored && part.colored !== key) upload(part, 2, sharesOf(part, row));
  part.shown = row;
  part.colored = key;
}

// Normal and distance of the clip plane, which hides what its normal points to.
function clipPlane() {
  let normal;
  if (state.clip === 'given') return [...scene.clip.normal, dot(scene.clip.normal, scene.clip.point)];
  if (state.clip === 'view') normal = axesOf().back;
  else normal = ['x', 'y', 'z'].map((axis) => Number(axis === state.clip));
  if (state.flip) normal = plus([0, 0, 0], normal, -1);
  const half = minus(box[1], box[0]).reduce((sum, side, axis) => sum + Math.abs(side * normal[axis]) / 2, 0);
  const at = state.flip ? 1 - state.clipAt : state.clipAt;
  return [...normal, dot(normal, middle) + (2 * at - 1) * half];
}

function draw() {
  dirty = false;
  gl.viewport(0, 0, canvas.width, canvas.height);
  const endoscope = state.light === 'endoscope';
  gl.clearColor(...(endoscope ? [0, 0, 0] : scene.background), 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.useProgram(program.made);
  const u = program.places, {view, projection} = matrices();
  gl.uniformMatrix4fv(u.view, false, view);
  gl.uniformMatrix4fv(u.projection, false, projection);
  gl.uniform1i(u.endoscope, endoscope);
  gl.uniform1f(u.reach, scene.reach || norm(minus(scene.camera.eye, scene.camera.target)));
  gl.uniform2f(u.middle, canvas.width / 2, canvas.height / 2);
  gl.uniform1f(u.radius, Math.min(canvas.width, canvas.height) / 2);
  gl.uniform1f(u.tangent, tangent());
  gl.bindTexture(gl.TEXTURE_2D, ramp);
  for (const part of parts) {
    const row = state.frame - part.first, colored = state.field >= 0 && !part.instrument;
    if (row < 0 || row >= part.frames || hidden.has(part.name)) continue;
    gl.bindVertexArray(part.array);
    prepare(part, row, colored);
    gl.uniform1i(u.field, colored);
    gl.uniform1i(u.cut, Boolean(state.clip) && !part.instrument);
    if (state.clip) gl.uniform4fv(u.plane, clipPlane());
    gl.uniform3fv(u.origin, part.origin);
    gl.uniform1f(u.unit, part.step);
    let first = 0;
    for (const {triangles, color} of part.paints) {
      gl.uniform3fv(u.color, color);
      gl.drawElements(gl.TRIANGLES, 3 * triangles, gl.UNSIGNED_INT, 12 * first);
      first += triangles;
    }
  }
  drawOverlay();
}

// --- Arrows, scale bar and plot -----------------------------------------------------------------------

// Three digits and a prefix: 0.0123 N is 12.3 mN.
function quantity(value, name) {
  const size = Math.abs(value);
  if (size === 0) return `0 ${name}`;
  if (name === 'N' && size < 0.1) return `${(1000 * value).toPrecision(3)} mN`;
  if (name === 'Pa' && size >= 1e4) return `${(value / 1000).toPrecision(3)} kPa`;
  return `${size >= 1000 ? Math.round(value) : value.toPrecision(3)} ${name}`;
}

function fit(context, width, height) {
  const {canvas} = context;
  canvas.width = Math.round(width * stage.ratio);
  canvas.height = Math.round(height * stage.ratio);
  context.setTransform(stage.ratio, 0, 0, stage.ratio, 0, 0);
  context.font = '12px system-ui, sans-serif';
}

function drawArrow(c, from, to, text) {
  const along = Math.atan2(to[1] - from[1], to[0] - from[0]);
  c.beginPath();
  c.moveTo(...from);
  c.lineTo(...to);
  for (const side of [2.6, -2.6]) {
    c.moveTo(...to);
    c.lineTo(to[0] + 11 * Math.cos(along + side), to[1] + 11 * Math.sin(along + side));
  }
  for (const [color, width] of [['#fff', 5], ['#b00020', 2.5]]) {
    c.strokeStyle = color;
    c.lineWidth = width;
    c.stroke();
  }
  written(c, text, to[0] + 8, to[1] - 6);
}

function written(c, text, x, y) {
  c.lineWidth = 3;
  c.strokeStyle = '#fff';
  c.strokeText(text, x, y);
  c.fillStyle = '#111';
  c.fillText(text, x, y);
}

function drawOverlay() {
  const c = $('overlay').getContext('2d');
  fit(c, stage.width, stage.height);
  const wanted = 110 * mmPerPixel(), power = 10 ** Math.floor(Math.log10(wanted));
  const length = power * (wanted / power >= 5 ? 5 : wanted / power >= 2 ? 2 : 1), wide = length / mmPerPixel();
  for (const [color, width] of [['#fff', 5], ['#111', 2]]) {
    c.strokeStyle = color;
    c.lineWidth = width;
    c.beginPath();
    c.moveTo(16, stage.height - 22);
    c.lineTo(16, stage.height - 16);
    c.lineTo(16 + wide, stage.height - 16);
    c.lineTo(16 + wide, stage.height - 22);
    c.stroke();
  }
  written(c, `${Number(length.toPrecision(1))} mm`, 22, stage.height - 23);
  if (!state.arrows) return;
  for (const instrument of scene.instruments) {
    const place = instrument.place[state.frame], force = instrument.force[state.frame];
    if (!place || hidden.has(instrument.name) || norm(force) === 0) continue;
    const from = pixelOf(place), to = pixelOf(plus(place, force, size / 4 / scene.greatestForce));
    if (from && to) drawArrow(c, from, to, quantity(norm(force), 'N'));
  }
}

function drawPlot() {
  const curve = scene.curves[state.curve];
  if (!curve) return;
  const plot = $('plot'), width = plot.clientWidth, height = plot.clientHeight, c = plot.getContext('2d');
  fit(c, width, height);
  const known = curve.values.filter((value) => value !== null), low = Math.min(0, ...known), high = Math.max(0, ...known);
  const start = scene.times[0], end = scene.times[scene.times.length - 1];
  const x = (time) => 6 + (width - 12) * (time - start) / (end - start || 1);
  const y = (value) => height - 22 - (height - 42) * (value - low) / (high - low || 1);
  c.strokeStyle = '#bbb';
  c.strokeRect(6, 20, width - 12, height - 42);
  c.strokeStyle = '#2a6fbb';
  c.lineWidth = 1.5;
  c.beginPath();
  curve.values.forEach((value, frame) => {
    if (value === null) return;
    const joined = frame > 0 && curve.values[frame - 1] !== null;
    c[joined ? 'lineTo' : 'moveTo'](x(scene.times[frame]), y(value));
  });
  c.stroke();
  const now = curve.values[state.frame];
  c.fillStyle = '#222';
  c.fillText(`${quantity(high, curve.unit)}${now === null ? '' : `, now ${quantity(now, curve.unit)}`}`, 6, 14);
  c.fillText(`${quantity(low, curve.unit)}`, 6, height - 6);
  c.textAlign = 'right';
  c.fillText(`${end.toPrecision(3)} s`, width - 6, height - 6);
  c.textAlign = 'left';
  c.strokeStyle = '#b00020';
  c.beginPath();
  c.moveTo(x(scene.times[state.frame]), 20);
  c.lineTo(x(scene.times[state.frame]), height - 22);
  c.stroke();
}

// --- Controls -----------------------------------------------------------------------------------------

const hidden = new Set();

function redraw() {
  if (!dirty) requestAnimationFrame(() => dirty && draw());
  dirty = true;
}

function showFrame(frame) {
  state.frame = Math.min(scene.times.length - 1, Math.max(0, frame));
  $('time').value = state.frame;
  $('clock').textContent = `${scene.times[state.frame].toFixed(3)} s (${state.frame + 1}/${scene.times.length})`;
  drawPlot();
  redraw();
}

function play(on) {
  state.playing = on;
  $('play').textContent = on ? 'Pause' : 'Play';
  if (!on) return;
  if (state.frame === scene.times.length - 1) showFrame(0);
  let last = performance.now(), time = scene.times[state.frame];
  const next = (now) => {
    if (!state.playing) return;
    time += (now - last) / 1000 * Number($('speed').value);
    last = now;
    let frame = state.frame;
    while (frame + 1 < scene.times.length && scene.times[frame + 1] <= time) ++frame;
    if (frame !== state.frame) showFrame(frame);
    if (frame === scene.times.length - 1) play(false);
    else requestAnimationFrame(next);
  };
  requestAnimationFrame(next);
}

function showField() {
  const field = scene.fields[state.field];
  $('field').value = state.field;
  $('legend').hidden = !field;
  if (field) {
    $('least').value = Number(field.least.toPrecision(4));
    $('greatest').value = Number(field.greatest.toPrecision(4));
    $('unit').textContent = field.unit;
  }
  redraw();
}

function option(select, value, text) {
  const made = document.createElement('option');
  made.value = value;
  made.textContent = text;
  select.append(made);
}

function listen(id, event, action) {
  $(id).addEventListener(event, () => action($(id)));
}

function makeLists() {
  $('title').textContent = document.title = scene.title;
  const names = [...new Set(scene.parts.map((part) => part.name))];
  for (const name of names) {
    const label = document.createElement('label'), box = document.createElement('input');
    Object.assign(box, {type: 'checkbox', checked: true});
    box.addEventListener('change', () => {
      if (box.checked) hidden.delete(name);
      else hidden.add(name);
      redraw();
    });
    label.append(box, ` ${name}`);
    $('parts').append(label);
  }
  $('parts').hidden = names.length < 2;
  option($('field'), -1, 'material');
  scene.fields.forEach((field, n) => option($('field'), n, `${field.name} (${field.unit})`));
  $('color').hidden = scene.fields.length === 0;
  scene.curves.forEach((curve, n) => option($('curve'), n, `${curve.name} (${curve.unit})`));
  $('curves').hidden = scene.curves.length === 0 || scene.times.length < 2;
  $('forces').hidden = scene.instruments.length === 0;
  $('bar').hidden = scene.times.length < 2;
  if (scene.clip) option($('clip'), 'given', 'as given');
  $('time').max = scene.times.length - 1;
  const views = {front: [[0, 1, 0], [0, 0, 1]], back: [[0, -1, 0], [0, 0, 1]], left: [[-1, 0, 0], [0, 0, 1]], right: [[1, 0, 0], [0, 0, 1]],
    top: [[0, 0, 1], [0, 1, 0]], bottom: [[0, 0, -1], [0, 1, 0]], iso: [[1, 1, 1], [0, 0, 1]]};
  for (const [name, [from, up]] of Object.entries(views)) {
    const button = document.createElement('button');
    button.textContent = name;
    button.addEventListener('click', () => {
      look(from, up);
      redraw();
    });
    $('views').append(button, ' ');
  }
  const bar = $('bar-colors').getContext('2d');
  for (let x = 0; x < 256; ++x) {
    bar.fillStyle = `rgb(${scene.ramp.slice(3 * x, 3 * x + 3).join()})`;
    bar.fillRect(x, 0, 1, 1);
  }
}

function listenToControls() {
  listen('play', 'click', () => play(!state.playing));
  listen('time', 'input', (input) => {
    play(false);
    showFrame(Number(input.value));
  });
  listen('field', 'change', (select) => {
    state.field = Number(select.value);
    showField();
  });
  for (const end of ['least', 'greatest']) {
    listen(end, 'change', (input) => {
      if (input.value !== '') scene.fields[state.field][end] = Number(input.value);
      redraw();
    });
  }
  listen('light', 'change', (select) => {
    state.light = select.value;
    camera.fov = state.light === 'endoscope' ? 70 : scene.camera.fov;
    redraw();
  });
  listen('clip', 'change', (select) => {
    state.clip = select.value;
    $('clip-place').hidden = ['', 'given'].includes(state.clip);
    redraw();
  });
  listen('clip-at', 'input', (input) => {
    state.clipAt = Number(input.value);
    redraw();
  });
  listen('clip-flip', 'change', (input) => {
    state.flip = input.checked;
    redraw();
  });
  listen('arrows', 'change', (input) => {
    state.arrows = input.checked;
    redraw();
  });
  listen('curve', 'change', (select) => {
    state.curve = Number(select.value);
    drawPlot();
  });
  $('plot').addEventListener('click', (event) => {
    const share = (event.offsetX - 6) / ($('plot').clientWidth - 12), times = scene.times;
    const wanted = times[0] + share * (times[times.length - 1] - times[0]);
    play(false);
    showFrame(times.reduce((best, time, n) => (Math.abs(time - wanted) < Math.abs(times[best] - wanted) ? n : best), 0));
  });
}

function listenToPointer() {
  const fingers = new Map();
  canvas.addEventListener('pointerdown', (event) => {
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (event.isTrusted) canvas.setPointerCapture(event.pointerId);
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener('pointermove', (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before[0], dy = event.clientY - before[1];
    if (fingers.size === 2) {
      const [other] = [...fingers].filter(([id]) => id !== event.pointerId)[0].slice(1);
      const was = Math.hypot(before[0] - other[0], before[1] - other[1]), is = Math.hypot(event.clientX - other[0], event.clientY - other[1]);
      if (is > 0) zoom(was / is);
      shift(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 6) {
      shift(dx, dy);
    } else {
      orbit(dx * 0.008, dy * 0.008);
    }
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    redraw();
  });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    zoom(Math.exp(Math.sign(event.deltaY) * 0.1));
    redraw();
  }, {passive: false});
  document.addEventListener('keydown', (event) => {
    if (/INPUT|SELECT|BUTTON/.test(event.target.tagName)) return;
    const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
    if (event.key === ' ') play(!state.playing);
    else if (step) showFrame(state.frame + step);
    else return;
    event.preventDefault();
  });
}

function resized() {
  const {clientWidth, clientHeight} = $('stage');
  Object.assign(stage, {width: clientWidth || 1, height: clientHeight || 1, ratio: devicePixelRatio || 1});
  canvas.width = Math.round(stage.width * stage.ratio);
  canvas.height = Math.round(stage.height * stage.ratio);
  if (!dirty) draw();
  drawPlot();
}

async function start() {
  makeLists();
  if (!gl) throw new Error('this browser has no WebGL 2, which the page needs to draw');
  if (typeof DecompressionStream === 'undefined') throw new Error('this browser has no DecompressionStream, which the page needs to unpack its numbers');
  program = compiled();
  ramp = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, ramp);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, new Uint8Array(scene.ramp));
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  for (const part of scene.parts) parts.push(await load(part));
  listenToControls();
  listenToPointer();
  resized();
  new ResizeObserver(resized).observe($('stage'));
  $('light').value = state.light;
  $('clip').value = state.clip;
  showField();
  showFrame(scene.times.length - 1);
  draw();
  $('message').textContent = '';
}

$('message').textContent = 'Unpacking …';
// What tests wait for.
const viewer = {scene, state, camera, draw, ready: start().then(() => performance.now())};
viewer.ready.catch((error) => { $('message').textContent = `Cannot show this scene: ${error.message}`; });
