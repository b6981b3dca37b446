// Drawing with WebGL: lit surfaces, and lines as wide bands with soft edges. Both may be drawn a little nearer to the eye
// than they are (`nearer`, in units of the scene), so that what coincides does not flicker.
const UNKNOWN = [0.62, 0.62, 0.62];
const START = [0.84, 0.37, 0.0];
const NEARER = `
  vec4 placed(vec3 place) {
    vec4 here = camera * vec4(place, 1.0), there = camera * vec4(place + nearer * normalize(eye - place), 1.0);
    return vec4(here.xy, there.z / there.w * here.w, here.w);
  }`;
const SURFACE = [`
  attribute vec3 place; attribute vec3 normal; attribute float value;
  uniform mat4 camera; uniform vec3 eye; uniform float nearer;
  varying vec3 v_towards; varying vec3 v_normal; varying float v_value;
  ${NEARER}
  void main() { v_towards = eye - place; v_normal = normal; v_value = value; gl_Position = placed(place); }`, `
  precision mediump float;
  uniform vec3 up; uniform vec3 colour; uniform float mapped; uniform float opacity;
  uniform vec3 unknown; uniform sampler2D map;
  varying vec3 v_towards; varying vec3 v_normal; varying float v_value;
  void main() {
    vec3 base = colour;
    if (mapped > 0.5) base = v_value > -0.5 ? texture2D(map, vec2(clamp(v_value, 0.002, 0.998), 0.5)).rgb : unknown;
    vec3 towards = normalize(v_towards);
    vec3 n = normalize(v_normal);
    float back = 1.0;
    if (dot(n, towards) < 0.0) { n = -n; back = 0.9; }
    vec3 light = normalize(towards + 0.45 * up);
    float shade = 0.6 + 0.4 * max(dot(n, light), 0.0);
    float shine = 0.12 * pow(max(dot(n, normalize(light + towards)), 0.0), 40.0);
    gl_FragColor = vec4((base * shade * back + shine) * opacity, opacity);
  }`];
const LINES = [`
  attribute vec3 from; attribute vec3 to; attribute vec2 corner;
  uniform mat4 camera; uniform vec3 eye; uniform float nearer; uniform vec2 size; uniform mediump float width;
  varying float v_side;
  ${NEARER}
  void main() {
    vec4 a = placed(from), b = placed(to), here = corner.x < 0.5 ? a : b;
    vec2 way = (b.xy / b.w - a.xy / a.w) * size;
    way = dot(way, way) > 1e-12 ? normalize(way) : vec2(1.0, 0.0);
    float reach = 0.5 * width + 1.0;
    vec2 shift = vec2(-way.y, way.x) * corner.y * reach + way * (corner.x - 0.5) * 0.7 * width;
    v_side = corner.y * reach;
    gl_Position = vec4(here.xy + 2.0 * shift / size * here.w, here.zw);
  }`, `
  precision mediump float;
  uniform vec3 colour; uniform float width; uniform float opacity;
  varying float v_side;
  void main() {
    float cover = clamp(0.5 * width + 0.5 - abs(v_side), 0.0, 1.0) * opacity;
    gl_FragColor = vec4(colour * cover, cover);
  }`];

function compiled(gl, texts, attributes, uniforms) {
  const program = gl.createProgram();
  [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].forEach((kind, i) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, texts[i]);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  });
  attributes.forEach((name, i) => gl.bindAttribLocation(program, i, name));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
  return { program, at: Object.fromEntries(uniforms.map((name) => [name, gl.getUniformLocation(program, name)])) };
}

class Painter {
  constructor(gl) {
    this.gl = gl;
    this.surface = compiled(gl, SURFACE, ["place", "normal", "value"],
      ["camera", "eye", "nearer", "up", "colour", "mapped", "opacity", "unknown", "map"]);
    this.lines = compiled(gl, LINES, ["from", "to", "corner"], ["camera", "eye", "nearer", "size", "width", "colour", "opacity"]);
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    for (const [name, value] of [["MIN_FILTER", "LINEAR"], ["MAG_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]])
      gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + name], gl[value]);
    this.buffers = new Map();
  }

  colours(table) {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, table);
  }

  // The buffer of a key with the content, sent when it is another than before
  buffer(key, kind, content) {
    const gl = this.gl, known = this.buffers.get(key) || { made: gl.createBuffer(), content: null };
    gl.bindBuffer(kind, known.made);
    if (known.content !== content) gl.bufferData(kind, content, gl.DYNAMIC_DRAW);
    this.buffers.set(key, { made: known.made, content });
  }

  begin(width, height) {
    const gl = this.gl;
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA); // colours are multiplied by their opacity
    this.size = [width, height];
  }

  // key: of the surface; mesh: places, normals, values (0 to 1, -1: unknown) or null, triangles
  sheet(key, mesh, view, how) {
    const gl = this.gl, { program, at } = this.surface;
    gl.useProgram(program);
    gl.uniformMatrix4fv(at.camera, false, view.matrix);
    gl.uniform3fv(at.eye, view.eye);
    gl.uniform3fv(at.up, view.up);
    gl.uniform3fv(at.unknown, UNKNOWN);
    gl.uniform3fv(at.colour, how.colour);
    gl.uniform1f(at.nearer, how.nearer);
    gl.uniform1f(at.mapped, mesh.values ? 1 : 0);
    gl.uniform1f(at.opacity, how.opacity);
    gl.uniform1i(at.map, 0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    [["places", 3], ["normals", 3], ["values", 1]].forEach(([name, count], place) => {
      if (!mesh[name]) { gl.disableVertexAttribArray(place); gl.vertexAttrib1f(place, 0); return; }
      this.buffer(key + name, gl.ARRAY_BUFFER, mesh[name]);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, 0, 0);
    });
    this.buffer(key + "triangles", gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
    const draw = () => gl.drawElements(gl.TRIANGLES, mesh.triangles.length, gl.UNSIGNED_SHORT, 0);
    if (how.opacity < 1) { // the nearest layer alone shines through: its depth first, then its colour
      gl.colorMask(false, false, false, false);
      draw();
      gl.colorMask(true, true, true, true);
    }
    draw();
  }

  // bands: Float32Array of the corners of every piece (from, to, corner), four a piece
  line(key, bands, view, how) {
    if (!bands.length) return;
    const gl = this.gl, { program, at } = this.lines, pieces = bands.length / 32;
    gl.useProgram(program);
    gl.uniformMatrix4fv(at.camera, false, view.matrix);
    gl.uniform3fv(at.eye, view.eye);
    gl.uniform2fv(at.size, this.size);
    gl.uniform3fv(at.colour, how.colour);
    gl.uniform1f(at.nearer, how.nearer);
    gl.uniform1f(at.width, how.width);
    gl.uniform1f(at.opacity, how.opacity);
    this.buffer(key, gl.ARRAY_BUFFER, bands);
    [[3, 0], [3, 12], [2, 24]].forEach(([count, offset], place) => {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, 32, offset);
    });
    if (!this.corners || this.corners.length < 6 * pieces) {
      this.corners = new Uint16Array(6 * pieces);
      for (let i = 0; i < pieces; i++) this.corners.set([0, 1, 2, 2, 1, 3].map((k) => 4 * i + k), 6 * i);
    }
    this.buffer("corners", gl.ELEMENT_ARRAY_BUFFER, this.corners);
    gl.depthMask(false);
    gl.drawElements(gl.TRIANGLES, 6 * pieces, gl.UNSIGNED_SHORT, 0);
    gl.depthMask(true);
  }
}

// A path of points as bands for `line`
function bandsOf(places, path) {
  const found = new Float32Array(32 * Math.max(path.length - 1, 0));
  for (let i = 0; i + 1 < path.length; i++) {
    if (path[i] < 0 || path[i + 1] < 0) continue; // the path is in pieces
    const ends = [path[i], path[i + 1]].map((p) => [places[3 * p], places[3 * p + 1], places[3 * p + 2]]);
    [[0, -1], [0, 1], [1, -1], [1, 1]].forEach((corner, k) => found.set([...ends[0], ...ends[1], ...corner], 32 * i + 8 * k));
  }
  return found;
}
