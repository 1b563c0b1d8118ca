// WebGL 2 renderer of a shape. A map is drawn as triangles, each a quadratic patch from the target back to the source,
// so that the texture keeps its own sharpness at any zoom. The texture itself, grid and stretch are drawn, too.

import {SHADERS} from './shaders.js';

/** @import {Box, Look, Overlay, PaintedView, Point, ShapeInfo} from './types.d.ts' */
/** @import {Surface} from './surface.js' */

/** @typedef {{array: WebGLVertexArrayObject, buffer: WebGLBuffer, count: number}} Fan a polygon as a triangle fan */
/** @typedef {{texture: WebGLTexture, fast: WebGLSampler} & Look} Layer `fast` reads fewer texels */
/** @typedef {{frame: WebGLFramebuffer, colour: WebGLTexture, depth: WebGLRenderbuffer, width: number, height: number}} Buffer pixels without antialiasing */
/** @typedef {{array: WebGLVertexArrayObject, buffer: WebGLBuffer, count: number}} Patches triangles of a map, and the number of their corners */
/** @typedef {{handle: WebGLProgram, at: (name: string) => WebGLUniformLocation | null}} Program */

// attributes of a triangle, each a point
const PATCH_ATTRIBUTES = ['a0', 'a1', 'a2', 'b0', 'b1', 'b2', 'd0', 'd1', 'd2'];
const FLOATS = 2 * PATCH_ATTRIBUTES.length;
const FLOAT_BYTES = 4, CORNERS = 3;
const OUTSIDE_OPACITY = 0.22;  // of the texture beyond the source
const MAX_ANISOTROPY = 8;
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;  // renderers without a graphics card

export class Painter {
  #gl;
  #shape;
  /** @type {Record<string, Program>} */
  #programs = {};
  /** @type {Layer | null} */
  #texture = null;
  /** @type {Layer | null} the picture in the shape's file */
  #drawing = null;
  /** What is darkened, and by which factors of red, green and blue. @type {{rings: Fan[], around: Fan | null, ratios: number[]}} */
  #tone = {rings: [], around: null, ratios: [1, 1, 1]};
  /** @type {Fan[]} the outlines, the outer one first */
  #rings = [];
  /** @type {Fan | null} the box of the texture */
  #quad = null;
  /** @type {Fan | null} the bounds of the shape */
  #cover = null;
  /** @type {Fan | null} the box of the file's own drawing */
  #canvas = null;
  /** Triangles of the map and of the previous map. @type {Patches} */
  #patches;
  #ghost;
  /** @type {{array: WebGLVertexArrayObject, source: WebGLBuffer, indices: number} | null} */
  #mesh = null;
  /** Indices of the corners of a mesh's triangles. */
  #count = 0;
  /** @type {PaintedView} */
  #view = {x: 0, y: 0, zoom: 1, width: 1, height: 1};
  /** @type {Overlay} */
  #overlay = {grid: false, stretch: false, own: 0, ghost: 0, swipe: null, mapped: false, holes: false, mean: 1, step: 1};

  /** Whether pictures that are on the screen for a moment are painted fast, with jagged edges. */
  hurried = false;
  /** @type {Buffer | null} */
  #buffer = null;

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {ShapeInfo} shape
   */
  constructor(canvas, shape) {
    const gl = canvas.getContext('webgl2', {antialias: true, stencil: true, premultipliedAlpha: true});
    if (!gl) throw new Error('This browser or its graphics card does not support WebGL 2.');
    this.#gl = gl;
    this.#shape = shape;
    /** @type {number} largest side of a texture in pixels */
    this.maxSide = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const info = gl.getExtension('WEBGL_debug_renderer_info');
    /** Whether WebGL runs without a graphics card. */
    this.software = SOFTWARE.test(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    for (const [name, [vertex, fragment]] of Object.entries(SHADERS)) this.#programs[name] = link(gl, vertex, fragment);
    this.outlines(shape.painted ?? [shape.outline, ...shape.holes]);
    this.#patches = this.#emptyPatches();
    this.#ghost = this.#emptyPatches();
  }

  /** @returns {Patches} */
  #emptyPatches() {
    const gl = this.#gl, array = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    PATCH_ATTRIBUTES.forEach((name, k) => {
      const at = gl.getAttribLocation(this.#programs.patches.handle, name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 2, gl.FLOAT, false, FLOAT_BYTES * FLOATS, 2 * FLOAT_BYTES * k);
    });
    return {array, buffer, count: 0};
  }

  /**
   * Set the outlines of the shape, the outer one first; those of a deformed shape change.
   * @param {Point[][]} rings
   */
  outlines(rings) {
    this.#rings = this.#fans(rings, this.#rings);
  }

  /**
   * Darken the picture inside rings: paper gets a tone there, and ink stays.
   * @param {Point[][]} rings
   * @param {number[]} ratios of red, green and blue
   */
  tone(rings, ratios) {
    const xs = rings.flat().map(([x]) => x), ys = rings.flat().map(([, y]) => y);
    const around = rings.length ? this.#box([Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)]) : null;
    this.#tone = {rings: this.#fans(rings, this.#tone.rings), around, ratios};
  }

  /**
   * @param {Point[][]} rings
   * @param {Fan[]} replaced
   */
  #fans(rings, replaced) {
    for (const {array, buffer} of replaced) {
      this.#gl.deleteVertexArray(array);
      this.#gl.deleteBuffer(buffer);
    }
    return rings.map((ring) => this.#points(ring.flat()));
  }

  /**
   * @param {number[]} floats coordinates of points
   * @returns {Fan}
   */
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

  /**
   * Set the triangles of a mesh, and their places in the texture plane if already known.
   * @param {Surface} surface
   */
  mesh({places, faces, source}) {
    const gl = this.#gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.#attribute('place', 3, places);
    const buffer = this.#attribute('source', 2, source);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
    this.#count = source.length ? faces.length : 0;
    this.#mesh = {array, source: buffer, indices: faces.length};
  }

  /**
   * Create an attribute of the mesh's vertices.
   * @param {string} name
   * @param {number} size components per vertex
   * @param {Float32Array} data
   */
  #attribute(name, size, data) {
    const gl = this.#gl, buffer = gl.createBuffer(), at = gl.getAttribLocation(this.#programs.mesh.handle, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
    return buffer;
  }

  /**
   * @param {ImageBitmap} image
   * @param {Look} look
   */
  texture(image, look) {
    this.#texture = this.#layer(image, look);
    this.#quad = this.#box(look.box);
    this.#cover = this.#box(this.#shape.bounds);
  }

  /**
   * Set the picture in the shape's own file.
   * @param {HTMLImageElement} image
   * @param {Box} box
   */
  drawing(image, box) {
    this.#drawing = this.#layer(image, {box, edge: 'transparent', filter: ''});
    this.#canvas = this.#box(box);
  }

  /** @param {Box} box */
  #box([left, top, right, bottom]) {
    return this.#points([left, top, right, top, right, bottom, left, bottom]);
  }

  /**
   * @param {TexImageSource} image
   * @param {Look} look
   * @returns {Layer}
   */
  #layer(image, look) {
    const gl = this.#gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, true);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    const near = look.filter === 'nearest';
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, near ? gl.NEAREST : gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, near ? gl.NEAREST : gl.LINEAR);
    /** @type {Record<string, number>} */
    const wraps = {repeat: gl.REPEAT, mirror: gl.MIRRORED_REPEAT};
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wraps[look.edge] ?? gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wraps[look.edge] ?? gl.CLAMP_TO_EDGE);
    const anisotropy = gl.getExtension('EXT_texture_filter_anisotropic');
    if (anisotropy && !near) gl.texParameteri(gl.TEXTURE_2D, anisotropy.TEXTURE_MAX_ANISOTROPY_EXT, MAX_ANISOTROPY);
    const fast = gl.createSampler(), wrapping = wraps[look.edge] ?? gl.CLAMP_TO_EDGE;
    if (!fast) throw new Error('The graphics context was lost.');
    gl.samplerParameteri(fast, gl.TEXTURE_MIN_FILTER, near ? gl.NEAREST : gl.LINEAR_MIPMAP_NEAREST);
    gl.samplerParameteri(fast, gl.TEXTURE_MAG_FILTER, near ? gl.NEAREST : gl.LINEAR);
    for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.samplerParameteri(fast, axis, wrapping);
    return {texture, fast, ...look};
  }

  /**
   * Set a map: (m, 18) numbers, or for a mesh (n, 2); see `image_of` in io/edit/page_view.py.
   * @param {Float32Array} floats
   */
  map(floats) {
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#mesh ? this.#mesh.source : this.#patches.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.#mesh ? floats : atCorners(floats), gl.DYNAMIC_DRAW);
    if (this.#mesh) this.#count = this.#mesh.indices;
    else this.#patches.count = CORNERS * floats.length / FLOATS;
  }

  /**
   * Set the previous map, which is blended over the map with the opacity in the overlay; not for meshes.
   * @param {Float32Array} floats
   */
  ghost(floats) {
    if (this.#mesh) return;
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#ghost.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, atCorners(floats), gl.STATIC_DRAW);
    this.#ghost.count = CORNERS * floats.length / FLOATS;
  }

  /**
   * Paint the whole canvas, or a part of it.
   * @param {PaintedView} view
   * @param {Overlay} overlay
   */
  draw(view, overlay) {
    const gl = this.#gl, left = view.left ?? 0, bottom = view.bottom ?? 0, isHurried = this.hurried && !overlay.plain;
    const buffer = isHurried ? this.#bufferFor(left + view.width, bottom + view.height) : null;
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer?.frame ?? null);
    gl.viewport(left, bottom, view.width, view.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, bottom, view.width, view.height);
    this.#paint(view, overlay);
    if (overlay.swipe !== null && !overlay.plain && this.#drawing) {
      gl.scissor(left, bottom, Math.round(overlay.swipe * view.width), view.height);
      this.#paint(view, {...overlay, own: 1, ghost: 0});
      gl.scissor(left, bottom, view.width, view.height);
    }
    if (buffer) this.#copy(buffer);
  }

  /**
   * Return a buffer for pictures without antialiasing, which takes most of the time where there is no graphics card.
   * @param {number} width in pixels
   * @param {number} height
   */
  #bufferFor(width, height) {
    const gl = this.#gl, {colour, depth, frame} = this.#buffer ?? {colour: gl.createTexture(), depth: gl.createRenderbuffer(), frame: gl.createFramebuffer()};
    if (this.#buffer && width <= this.#buffer.width && height <= this.#buffer.height) return this.#buffer;
    gl.bindTexture(gl.TEXTURE_2D, colour);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH24_STENCIL8, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, colour, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_STENCIL_ATTACHMENT, gl.RENDERBUFFER, depth);
    return this.#buffer = {frame, colour, depth, width, height};
  }

  /**
   * Copy what was painted to the canvas.
   * @param {Buffer} buffer
   */
  #copy({colour}) {
    const gl = this.#gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.BLEND);
    gl.disable(gl.STENCIL_TEST);
    gl.useProgram(this.#programs.copy.handle);
    gl.bindSampler(0, null);
    gl.bindTexture(gl.TEXTURE_2D, colour);
    gl.bindVertexArray(null);
    gl.drawArrays(gl.TRIANGLES, 0, CORNERS);
  }

  /**
   * @param {PaintedView} view
   * @param {Overlay} overlay
   */
  #paint(view, overlay) {
    const gl = this.#gl;
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.STENCIL_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.#texture) return;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.STENCIL_TEST);
    this.#view = view;
    this.#overlay = overlay;
    if (this.#mesh) this.#drawMesh();
    else if (overlay.mapped) this.#drawTarget();
    else this.#drawSource();
    this.#drawOwn();
  }

  /** Opacity of the texture beside the file's own drawing. */
  get #textureShare() {
    return this.#drawing && !this.#overlay.plain ? 1 - this.#overlay.own : 1;
  }

  #drawOwn() {
    const gl = this.#gl, {own, plain} = this.#overlay;
    if (!this.#drawing || plain || own <= 0) return;
    this.#use('plane', own, false, this.#drawing);
    gl.disable(gl.STENCIL_TEST);
    gl.blendFunc(gl.ONE, gl.ONE);  // both opacities add up to one
    this.#fan(this.#canvas);
  }

  #drawSource() {
    const gl = this.#gl;
    this.#cut(this.#rings);
    this.#use('plane', this.#textureShare);
    gl.stencilFunc(gl.EQUAL, 255, 255);
    this.#fan(this.#cover);
    this.#use('plane', OUTSIDE_OPACITY * this.#textureShare, false);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    this.#fan(this.#quad);
  }

  /** Draw the map inside the shape: for a frame, only what the drawing paints; else everything except holes. */
  #drawTarget() {
    const gl = this.#gl, {painted} = this.#shape;
    this.#cut(painted ? this.#rings : this.#overlay.holes ? this.#rings.slice(1) : []);
    gl.stencilFunc(gl.EQUAL, painted ? 255 : 0, 255);
    this.#drawPatches(this.#patches, this.#textureShare);
    if (this.#overlay.ghost > 0 && !this.#overlay.plain) this.#drawPatches(this.#ghost, this.#overlay.ghost);
    this.#drawTone();
  }

  #drawTone() {
    const gl = this.#gl, {rings, around, ratios: [red, green, blue]} = this.#tone;
    if (!rings.length) return;
    gl.clear(gl.STENCIL_BUFFER_BIT);
    this.#cut(rings);
    gl.stencilFunc(gl.EQUAL, 255, 255);
    this.#use('plane', 1, false);
    gl.blendColor(red, green, blue, 1);
    gl.blendFunc(gl.ZERO, gl.CONSTANT_COLOR);  // which ignores what is drawn
    this.#fan(around);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  /**
   * @param {Patches} patches
   * @param {number} opacity
   */
  #drawPatches({array, count}, opacity) {
    if (!count) return;
    this.#use('patches', opacity);
    this.#gl.bindVertexArray(array);
    this.#gl.drawArrays(this.#gl.TRIANGLES, 0, count);
  }

  #drawMesh() {
    const gl = this.#gl;
    gl.disable(gl.STENCIL_TEST);
    gl.enable(gl.DEPTH_TEST);
    this.#use('mesh', 1);
    gl.bindVertexArray(this.#mesh?.array ?? null);
    gl.drawElements(gl.TRIANGLES, this.#count, gl.UNSIGNED_INT, 0);
    gl.disable(gl.DEPTH_TEST);
  }

  /**
   * Mark the inside of the rings in the stencil, by the even-odd rule.
   * @param {Fan[]} rings
   */
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

  /** @param {Fan | null} fan */
  #fan(fan) {
    if (!fan) return;
    this.#gl.bindVertexArray(fan.array);
    this.#gl.drawArrays(this.#gl.TRIANGLE_FAN, 0, fan.count);
  }

  /**
   * @param {string} name of the program
   * @param {number} opacity
   * @param {boolean} [overlaid] whether to draw grid and stretch
   * @param {Layer | null} [layer]
   */
  #use(name, opacity, overlaid = true, layer = this.#texture) {
    const gl = this.#gl, {handle, at} = this.#programs[name], view = this.#view, overlay = this.#overlay;
    if (!layer) return;
    gl.useProgram(handle);
    gl.bindTexture(gl.TEXTURE_2D, layer.texture);
    gl.bindSampler(0, this.hurried && !overlay.plain ? layer.fast : null);
    gl.uniform2f(at('centre'), view.x, view.y);
    gl.uniform2f(at('reach'), 2 * view.zoom / view.width, -2 * view.zoom / view.height);
    gl.uniform4fv(at('box'), layer.box);
    gl.uniform1i(at('bounded'), layer.edge === 'transparent' ? 1 : 0);
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

/**
 * Return the floats of each triangle once for each of its corners. Instances of three vertices would need fewer, but
 * renderers without a graphics card take a call for each.
 * @param {Float32Array} floats
 */
function atCorners(floats) {
  const repeated = new Float32Array(CORNERS * floats.length);
  for (let k = 0, to = 0; k < floats.length; k += FLOATS) {
    for (let corner = 0; corner < CORNERS; corner++) {
      for (let i = k; i < k + FLOATS; i++) repeated[to++] = floats[i];
    }
  }
  return repeated;
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertex source of the vertex shader
 * @param {string} fragment source of the fragment shader
 * @returns {Program}
 */
function link(gl, vertex, fragment) {
  const handle = gl.createProgram();
  compile(gl, handle, gl.VERTEX_SHADER, vertex);
  compile(gl, handle, gl.FRAGMENT_SHADER, fragment);
  gl.linkProgram(handle);
  if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(handle) ?? 'not linked');
  /** @type {Map<string, WebGLUniformLocation | null>} */
  const places = new Map();
  const at = (/** @type {string} */ name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(handle, name));
    return places.get(name) ?? null;
  };
  return {handle, at};
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {WebGLProgram} program
 * @param {GLenum} kind
 * @param {string} source
 */
function compile(gl, program, kind, source) {
  const shader = gl.createShader(kind);
  if (!shader) throw new Error('The graphics context was lost.');
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? 'not compiled');
  gl.attachShader(program, shader);
}
