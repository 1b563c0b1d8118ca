// What is painted, by WebGL 2: a map as its triangles, each a quadratic patch from the target back to the source, so
// that the texture is as sharp at any zoom as it is; the texture itself; grid and stretch over both.

const COLOUR = `#version 300 es
precision highp float;
uniform sampler2D texture_;
uniform vec4 box;          // of the texture: left, top, right, bottom
uniform bool bounded;      // whether nothing is beyond it
uniform float opacity, grid, step_, stretch, mean;
out vec4 colour;

float encoded(float v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1.0 / 2.4) - 0.055; }

/** The texture at a place; the metric says how long steps of a pixel are on the target. */
void paint(vec2 s, mat2 metric) {
  vec2 uv = (s - box.xy) / (box.zw - box.xy);
  bool beyond = any(lessThan(uv, vec2(0))) || any(greaterThan(uv, vec2(1)));
  vec4 c = textureGrad(texture_, bounded ? clamp(uv, 0.0, 1.0) : uv, dFdx(uv), dFdy(uv));
  if (beyond && bounded) c = vec4(0);
  vec3 rgb = c.a > 0.0 ? c.rgb / c.a : vec3(0);
  c = vec4(vec3(encoded(rgb.r), encoded(rgb.g), encoded(rgb.b)) * c.a, c.a) * opacity;
  mat2 j = mat2(dFdx(s), dFdy(s)), m = j * inverse(metric) * transpose(j) / (mean * mean);
  float size = m[0][0] + m[1][1], area = sqrt(max(determinant(m), 0.0));
  float root = sqrt(max(size * size - 4.0 * area * area, 0.0));
  float most = max(sqrt(0.5 * (size + root)), 1.0 / max(sqrt(max(0.5 * (size - root), 0.0)), 1e-4));
  float heat = clamp(0.5 * log2(most), 0.0, 1.0) * stretch;
  vec3 hot = mix(vec3(1.0, 0.85, 0.2), vec3(0.65, 0.0, 0.15), heat);
  c = mix(c, vec4(hot, 1.0) * opacity, 0.85 * smoothstep(0.0, 0.35, heat));
  vec2 at = s / step_, line = abs(fract(at - 0.5) - 0.5) / max(fwidth(at), vec2(1e-9));
  float ink = grid * (1.0 - smoothstep(0.4, 1.4, min(line.x, line.y)));
  colour = mix(c, vec4(0.05, 0.1, 0.2, 1.0) * max(c.a, 0.4), 0.7 * ink);
}`;

const PLACE = `
uniform vec2 centre, reach;
vec4 placed(vec2 p) { return vec4((p - centre) * reach, 0, 1); }`;

const SHADERS = {
  patches: [`#version 300 es
    ${PLACE}
    in vec2 a0, a1, a2, b0, b1, b2, d0, d1, d2;
    out vec3 l;
    flat out vec4 e, f, g;
    void main() {
      l = vec3(gl_VertexID == 0, gl_VertexID == 1, gl_VertexID == 2);
      e = vec4(b0, b1); f = vec4(b2, d0); g = vec4(d1, d2);
      gl_Position = placed(a0 * l.x + a1 * l.y + a2 * l.z);
    }`, `${COLOUR}
    in vec3 l;
    flat in vec4 e, f, g;
    uniform float pixel;
    void main() {
      paint(l.x * e.xy + l.y * e.zw + l.z * f.xy + 2.0 * (l.y * l.z * f.zw + l.z * l.x * g.xy + l.x * l.y * g.zw),
        mat2(pixel * pixel));
    }`],
  plane: [`#version 300 es
    ${PLACE}
    in vec2 a0;
    out vec2 at;
    void main() { at = a0; gl_Position = placed(a0); }`, `${COLOUR}
    in vec2 at;
    void main() { paint(at, mat2(1)); }`],
  mesh: [`#version 300 es
    ${PLACE}
    uniform mat3 turn;
    in vec3 place;
    in vec2 source;
    out vec3 at;
    out vec2 s;
    void main() {
      vec3 p = turn * place;
      at = place;
      s = source;
      gl_Position = vec4(placed(p.xy).xy, -0.5 * p.z, 1);
    }`, `${COLOUR}
    uniform mat3 turn;
    uniform bool lit;
    in vec3 at;
    in vec2 s;
    void main() {
      vec3 p = dFdx(at), q = dFdy(at);
      paint(s, mat2(dot(p, p), dot(p, q), dot(p, q), dot(q, q)));
      if (!lit) return;
      float facing = abs((turn * normalize(cross(p, q))).z);
      colour = vec4((colour.rgb + 0.7 * (1.0 - colour.a)) * (0.45 + 0.55 * facing), 1.0);
    }`],
};
const FLOATS = 18;
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;  // what paints where there is no graphics card

export class Painter {
  #gl; #programs = {}; #texture = null; #drawing = null; #shape; #count = 0; #buffers = {}; #arrays = {}; #fans = [];

  /** @param shape what the server says of this side: outline, holes, and what a whole drawing paints. */
  constructor(canvas, shape) {
    const gl = canvas.getContext('webgl2', {antialias: true, stencil: true, premultipliedAlpha: true});
    if (!gl) throw new Error('This browser, or its graphics, has no WebGL 2.');
    this.#gl = gl;
    this.most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const told = gl.getExtension('WEBGL_debug_renderer_info');
    this.software = SOFTWARE.test(gl.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    this.#shape = shape;
    for (const [name, sources] of Object.entries(SHADERS)) this.#programs[name] = program(gl, ...sources);
    this.outlines(shape.painted ?? [shape.outline, ...shape.holes]);
    this.#arrays.patches = gl.createVertexArray();
    this.#buffers.patches = gl.createBuffer();
    gl.bindVertexArray(this.#arrays.patches);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers.patches);
    ['a0', 'a1', 'a2', 'b0', 'b1', 'b2', 'd0', 'd1', 'd2'].forEach((name, k) => {
      const at = gl.getAttribLocation(this.#programs.patches.handle, name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 2, gl.FLOAT, false, 4 * FLOATS, 8 * k);
      gl.vertexAttribDivisor(at, 1);
    });
  }

  /** Those of the shape, the outer one first; of one that is deformed they move. */
  outlines(rings) {
    const gl = this.#gl;
    for (const {array, buffer} of this.#fans.splice(0)) {
      gl.deleteVertexArray(array);
      gl.deleteBuffer(buffer);
    }
    this.#fans.push(...rings.map((ring) => this.#points(ring.flat())));
  }

  #points(floats) {
    const gl = this.#gl, array = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(floats), gl.STATIC_DRAW);
    const at = gl.getAttribLocation(this.#programs.plane.handle, 'a0');
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 2, gl.FLOAT, false, 0, 0);
    return {array, buffer, count: floats.length / 2};
  }

  /** @param surface its triangles; `source`, if it is known by now, their places in the texture's plane */
  mesh({places, faces, source}) {
    const gl = this.#gl, {handle} = this.#programs.mesh;
    this.#arrays.mesh = gl.createVertexArray();
    gl.bindVertexArray(this.#arrays.mesh);
    for (const [name, size, data] of [['place', 3, places], ['source', 2, source]]) {
      this.#buffers[name] = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
      const at = gl.getAttribLocation(handle, name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
    this.#count = source.length ? faces.length : 0;
    this.faces = faces.length;
  }

  /** @param image a bitmap @param look {box, edge, filter} */
  texture(image, look) {
    const gl = this.#gl;
    this.#texture = this.#layer(image, look);
    this.#fans.quad = this.#box(look.box);
    const [a, b, c, d] = this.#shape.bounds;
    this.#fans.cover = this.#points([a, b, c, b, c, d, a, d]);
  }

  /** What the shape's own file shows. @param image a bitmap @param box left, top, right, bottom */
  drawing(image, box) {
    this.#drawing = this.#layer(image, {box, edge: 'transparent', filter: ''});
    this.#fans.canvas = this.#box(box);
  }

  #box([left, top, right, bottom]) {
    return this.#points([left, top, right, top, right, bottom, left, bottom]);
  }

  #layer(image, look) {
    const gl = this.#gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, true);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    const near = look.filter === 'nearest';
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, near ? gl.NEAREST : gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, near ? gl.NEAREST : gl.LINEAR);
    const wrap = {repeat: gl.REPEAT, mirror: gl.MIRRORED_REPEAT}[look.edge] ?? gl.CLAMP_TO_EDGE;
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, wrap);
    const finer = gl.getExtension('EXT_texture_filter_anisotropic');
    if (finer && !near) gl.texParameteri(gl.TEXTURE_2D, finer.TEXTURE_MAX_ANISOTROPY_EXT, 8);
    return {texture, ...look};
  }

  /** @param floats (m, 18), on a mesh (n, 2): see `image_of` in io/edit/session.py */
  map(floats) {
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.faces ? this.#buffers.source : this.#buffers.patches);
    gl.bufferData(gl.ARRAY_BUFFER, floats, gl.DYNAMIC_DRAW);
    this.#count = this.faces ?? floats.length / FLOATS;
  }

  /** @param view {x, y, zoom, width, height, turn, left, bottom}: the middle, pixels by unit, pixels, of meshes a rotation;
   *  where it is a part of the canvas, from where
   *  @param overlay {grid, stretch, step, mean, own, plain} */
  draw(view, overlay) {
    const gl = this.#gl;
    const part = [view.left ?? 0, view.bottom ?? 0, view.width, view.height];
    gl.viewport(...part);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...part);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.STENCIL_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.#texture) return;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.STENCIL_TEST);
    this.view = view;
    this.overlay = overlay;
    if (this.faces) this.#drawMesh();
    else if (overlay.mapped) this.#drawTarget();
    else this.#drawSource();
    if (this.#drawing && overlay.own > 0 && !overlay.plain) this.#drawOwn();
  }

  /** How much of what is carried is seen beside the shape's own drawing. */
  get #carried() {
    return this.#drawing && !this.overlay.plain ? 1 - this.overlay.own : 1;
  }

  #drawOwn() {
    this.#use('plane', this.overlay.own, false, this.#drawing);
    this.#gl.disable(this.#gl.STENCIL_TEST);
    this.#gl.blendFunc(this.#gl.ONE, this.#gl.ONE);  // shares of both add up to one
    this.#fan(this.#fans.canvas);
  }

  #drawSource() {
    const gl = this.#gl;
    this.#cut(this.#fans);
    this.#use('plane', this.#carried);
    gl.stencilFunc(gl.EQUAL, 255, 255);
    this.#fan(this.#fans.cover);
    this.#use('plane', 0.22 * this.#carried, false);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    this.#fan(this.#fans.quad);
  }

  #drawTarget() {
    const gl = this.#gl;
    const {painted} = this.#shape;  // what is seen of the map of a frame; else all of the map but holes
    this.#cut(painted ? this.#fans : this.overlay.holes ? this.#fans.slice(1) : []);
    this.#use('patches', this.#carried);
    gl.stencilFunc(gl.EQUAL, painted ? 255 : 0, 255);
    gl.bindVertexArray(this.#arrays.patches);
    if (this.#count) gl.drawArraysInstanced(gl.TRIANGLES, 0, 3, this.#count);
  }

  #drawMesh() {
    const gl = this.#gl;
    gl.disable(gl.STENCIL_TEST);
    gl.enable(gl.DEPTH_TEST);
    this.#use('mesh', 1);
    gl.bindVertexArray(this.#arrays.mesh);
    gl.drawElements(gl.TRIANGLES, this.#count, gl.UNSIGNED_INT, 0);
    gl.disable(gl.DEPTH_TEST);
  }

  /** Marks in the stencil what is inside of an odd number of rings. */
  #cut(rings) {
    const gl = this.#gl;
    this.#use('plane', 0, false);
    gl.colorMask(false, false, false, false);
    gl.stencilFunc(gl.ALWAYS, 0, 255);
    gl.stencilOp(gl.INVERT, gl.INVERT, gl.INVERT);
    for (const ring of rings) this.#fan(ring);
    gl.colorMask(true, true, true, true);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
  }

  #fan(ring) {
    this.#gl.bindVertexArray(ring.array);
    this.#gl.drawArrays(this.#gl.TRIANGLE_FAN, 0, ring.count);
  }

  #use(name, opacity, overlaid = true, look = this.#texture) {
    const gl = this.#gl, {handle, at} = this.#programs[name], {view, overlay} = this;
    gl.useProgram(handle);
    gl.bindTexture(gl.TEXTURE_2D, look.texture);
    gl.uniform2f(at('centre'), view.x, view.y);
    gl.uniform2f(at('reach'), 2 * view.zoom / view.width, -2 * view.zoom / view.height);
    gl.uniform4fv(at('box'), look.box);
    gl.uniform1i(at('bounded'), look.edge === 'transparent' ? 1 : 0);
    gl.uniform1f(at('opacity'), opacity);
    gl.uniform1f(at('grid'), overlay.grid && overlaid ? 1 : 0);
    gl.uniform1f(at('stretch'), overlay.stretch && overlaid && overlay.mapped ? 1 : 0);
    gl.uniform1f(at('step_'), overlay.step);
    gl.uniform1f(at('mean'), overlay.mean);
    gl.uniform1f(at('pixel'), 1 / view.zoom);
    gl.uniform1i(at('lit'), overlay.plain ? 0 : 1);
    if (view.turn) gl.uniformMatrix3fv(at('turn'), true, view.turn);
  }
}

function program(gl, vertex, fragment) {
  const handle = gl.createProgram(), places = new Map();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(handle, shader);
  }
  gl.linkProgram(handle);
  if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(handle));
  const at = (name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(handle, name));
    return places.get(name);
  };
  return {handle, at};
}
