// The 3-D views of a report: WebGL 1, no library, no request. Each view is a figure with a still picture, which stays
// where there is no WebGL, and a block of JSON (compare/pages/report/surfaces.py says what is in it). These files are joined in
// the order maths, paint, view, controls, within one function.
const FIELD_OF_VIEW = 0.5;
const SEQUENTIAL = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"];
const DIVERGING = ["3b4cc0", "7b9ff9", "c0d4f5", "e6e6e6", "f2cbb7", "ee8468", "b40426"];

// Vectors and matrices (column by column, as WebGL takes them)
const add = (a, b, f) => [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(a[0], a[1], a[2]) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
const short = (x) => (x === 0 ? "0" : Number(x.toPrecision(3)).toString());

function product(a, b) {
  const c = new Float32Array(16);
  for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}

function perspective(aspect, near, far) {
  const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0]);
}

function numbers(text, Kind) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new Kind(bytes.buffer);
}

// Points as they were before they were packed over the box from low by span
function unpacked(text, low, span) {
  const packed = numbers(text, Uint16Array), found = new Float32Array(packed.length);
  for (let i = 0; i < packed.length; i++) found[i] = low[i % 3] + span[i % 3] * packed[i] / 65535;
  return found;
}

// Values of a field; NaN where nothing is known
function values(field) {
  const packed = numbers(field.values, Uint16Array), step = (field.high - field.low) / 65534;
  return Float32Array.from(packed, (x) => (x === 65535 ? NaN : field.low + x * step));
}

function rgb(hex) {
  return [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16));
}

// 256 colours (RGBA) between the anchors of a map
function colourTable(anchors) {
  const table = new Uint8Array(1024), stops = anchors.map(rgb);
  for (let i = 0; i < 256; i++) {
    const x = i / 255 * (stops.length - 1), k = Math.min(Math.floor(x), stops.length - 2);
    for (let c = 0; c < 3; c++) table[4 * i + c] = Math.round(stops[k][c] + (x - k) * (stops[k + 1][c] - stops[k][c]));
    table[4 * i + 3] = 255;
  }
  return table;
}

function gridTriangles(along, across) {
  const found = new Uint16Array(6 * (along - 1) * (across - 1));
  let n = 0;
  for (let i = 0; i < along - 1; i++) for (let j = 0; j < across - 1; j++) {
    const c = i * across + j;
    for (const corner of [c, c + across, c + 1, c + 1, c + across, c + across + 1]) found[n++] = corner;
  }
  return found;
}

// Around a grid; where its ends meet (seam 1, or -1 turned over) only along both edges, -1 between them
function gridOutline(along, across, seam) {
  const loop = [];
  if (seam) {
    for (let i = 0; i < along; i++) loop.push(i * across);
    loop.push(-1);
    for (let i = 0; i < along; i++) loop.push(i * across + across - 1);
    return loop;
  }
  for (let i = 0; i < along; i++) loop.push(i * across);
  for (let j = 1; j < across; j++) loop.push((along - 1) * across + j);
  for (let i = along - 2; i >= 0; i--) loop.push(i * across + across - 1);
  for (let j = across - 2; j >= 0; j--) loop.push(j);
  return loop;
}

// Points of the first and the last row that are one where the ends of a grid meet: [first, last, sign of the normal]
function gridSeam(along, across, seam) {
  if (!seam) return [];
  return Array.from({ length: across }, (_, j) => [j, (along - 1) * across + (seam > 0 ? j : across - 1 - j), seam]);
}

// Unit normals of triangles around the points, those that are one (gridSeam) with one normal
function normalsOf(places, triangles, joined) {
  const found = new Float32Array(places.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => 3 * triangles[t + k]);
    const u = [0, 1, 2].map((k) => places[b + k] - places[a + k]), w = [0, 1, 2].map((k) => places[c + k] - places[a + k]);
    const n = cross(u, w);
    for (const corner of [a, b, c]) for (let k = 0; k < 3; k++) found[corner + k] += n[k];
  }
  for (const [first, last, sign] of joined) {
    for (let k = 0; k < 3; k++) {
      const both = found[3 * first + k] + sign * found[3 * last + k];
      found[3 * first + k] = both;
      found[3 * last + k] = sign * both;
    }
  }
  for (let i = 0; i < found.length; i += 3) {
    const n = Math.hypot(found[i], found[i + 1], found[i + 2]) || 1;
    for (let k = 0; k < 3; k++) found[i + k] /= n;
  }
  return found;
}

// Where a ray first meets triangles: [distance, first index of the triangle, weights of its corners], or null
function hit(eye, ray, places, triangles) {
  let best = null;
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
    const ux = places[b] - places[a], uy = places[b + 1] - places[a + 1], uz = places[b + 2] - places[a + 2];
    const wx = places[c] - places[a], wy = places[c + 1] - places[a + 1], wz = places[c + 2] - places[a + 2];
    const px = ray[1] * wz - ray[2] * wy, py = ray[2] * wx - ray[0] * wz, pz = ray[0] * wy - ray[1] * wx;
    const det = ux * px + uy * py + uz * pz;
    if (Math.abs(det) < 1e-14) continue;
    const tx = eye[0] - places[a], ty = eye[1] - places[a + 1], tz = eye[2] - places[a + 2];
    const m = (tx * px + ty * py + tz * pz) / det;
    if (m < 0 || m > 1) continue;
    const qx = ty * uz - tz * uy, qy = tz * ux - tx * uz, qz = tx * uy - ty * ux;
    const n = (ray[0] * qx + ray[1] * qy + ray[2] * qz) / det;
    if (n < 0 || m + n > 1) continue;
    const far = (wx * qx + wy * qy + wz * qz) / det;
    if (far > 0 && (!best || far < best[0])) best = [far, t, [1 - m - n, m, n]];
  }
  return best;
}

function made(name, parent, properties) {
  const element = document.createElement(name);
  Object.assign(element, properties || {});
  if (parent) parent.appendChild(element);
  return element;
}
