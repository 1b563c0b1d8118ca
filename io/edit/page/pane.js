// One half of the page: a painted shape with its lines and handles, and its coordinates.

import {attraction} from './attraction.js';
import {Divider} from './divider.js';
import {listen, strokeOf} from './gestures.js';
import {atRim, between, closest, distance, fileName, inside, significant, Units} from './geometry.js';
import {Painter} from './gl.js';
import {Handles} from './handles.js';
import {Lines, LOUPE_SIDE, LOUPE_ZOOM} from './lines.js';
import {Surface} from './surface.js';
import {View} from './view.js';

/** @import {Actions, Hello, Item, Overlay, PaintedView, PaneScene, Pin, Place, Point, ShapeInfo, Side, Silhouette, Tool} from './types.d.ts' */

const OUTLINE_REACH = 8;     // pixels: a click this close to the outline places a pin on it
const RIM_DISTANCE = 0.01;     // relative to the shape: pins that are dragged out of it stop this far from the outline
const ON_OUTLINE = 1e-3;     // relative to the shape: pins this close to the outline are on it, as on the server
const VERTEX_REACH = 4;      // pixels: a pin released this close to a vertex of a mesh is placed on it
const HURRIED_SHARE = 0.5;   // of the pixels of a side, painted while the map follows without a graphics card
const SLOW_SHARE = 0.25;     // the same where pictures then still follow each other slowly
const SLOW_FRAME = [60, 600];  // milliseconds between two pictures of a drag that is slow, rather than at rest
const ORBIT = 0.008;         // radians by which a mesh rotates per pixel
const ARM_LENGTH = 34;       // pixels from a pin to the handle that rotates it
const FADE = 500;            // milliseconds in which one map takes the place of another
const LOUPE_MARGIN = 8;      // pixels
const LOUPE_TOP = 36;        // pixels: below the caption
const LOUPE_AWAY = 40;       // pixels between the loupe and what is dragged

export class Pane {
  /** @type {PaneScene} */
  scene = {
    pins: [], strokes: [], regions: [], rigid: [], unmapped: [], failed: false, balance: 1, turn: 0, fit: 'auto',
    wrong: {}, suggested: [], selected: new Set(), locked: () => false, wanted: () => null, patches: [], bent: [], active: null, pending: null, digits: {source: 0, target: 0},
  };
  view = new View();
  /** Whether there is a picture in the shape's file. */
  hasDrawing = false;
  /** The tool for clicks and drags. @type {Tool} */
  tool = 'pin';
  /** Whether two fingers are moving the view. */
  pinched = false;
  /** Whether the wheel scrolls the page around the pane, and zooms only with Ctrl. */
  scrolls = false;
  /** Whether a click close to the outline places a pin on it. */
  hasRim = true;
  /** @type {Surface | null} */
  surface = null;
  /** @type {Point[] | null} the stroke that is being drawn */
  drawing = null;
  /** @type {Point | null} the pixel in the middle of the loupe */
  loupe = null;
  /** @type {Point | null} the point that attracts the dragged pin */
  guide = null;
  /** @type {Point | null} the image of the point under the other side's pointer */
  cross = null;
  /** @type {Point[] | null} two opposite corners, in pixels, of the rectangle that selects */
  marquee = null;
  /** Called after the user has changed the view. */
  viewed = () => {};
  /** Called when the divider is dragged. @type {(share: number) => void} of the width, left of the divider */
  divided = () => {};
  #rough = false;
  /** Of the pixels of a side, while the map follows. */
  #share = HURRIED_SHARE;
  /** What is shown of the target, as text. */
  #silhouette = '[null,null,null]';
  /** When the last picture was painted. */
  #painted = 0;
  #stale = false;
  #begun = false;

  /**
   * @param {Side} side
   * @param {HTMLElement} element
   * @param {ShapeInfo} shape
   * @param {Pick<Hello, 'digits' | 'deforming' | 'holes' | 'mean'>} hello
   * @param {Actions} actions
   */
  constructor(side, element, shape, hello, actions) {
    this.side = side;
    this.element = element;
    this.shape = shape;
    this.actions = actions;
    this.digits = hello.digits;
    this.units = new Units(shape, hello.digits);
    this.deforms = hello.deforming && side === 'target';  // its outline moves with the pins
    this.canvas = element.appendChild(document.createElement('canvas'));
    this.canvas.setAttribute('aria-hidden', 'true');
    this.lines = new Lines(element, side);
    this.handles = new Handles(element, this);
    this.divider = new Divider(element, this);
    this.caption = element.appendChild(document.createElement('p'));
    this.caption.textContent = `${this.deforms ? 'deformed' : side}: ${fileName(shape.name)}`;
    this.caption.className = 'caption';
    this.rings = shape.painted ?? [shape.outline, ...shape.holes];
    this.painter = new Painter(this.canvas, shape);
    /** @type {Overlay} */
    this.overlay = {
      grid: false, stretch: false, own: 0, ghost: 0, swipe: null, mapped: side === 'target', holes: hello.holes, mean: hello.mean, step: 0.1,
    };
    /** The animation frame that was requested; 0 if none. */
    this.waiting = 0;
    listen(element, this);
  }

  /** Fetch the picture in the shape's file, and the triangles of a mesh. */
  async load() {
    const drawing = await fetch(`${this.side}.drawing`);
    if (drawing.status === 200) {
      const image = new Image();
      image.src = drawing.url;
      await image.decode();
      this.painter.drawing(image, this.shape.canvas);
      this.hasDrawing = true;
    }
    if (this.shape.mesh) {
      const answer = await fetch(`${this.side}.triangles`);
      this.surface = new Surface(await answer.arrayBuffer(), this.shape.axes);
      this.painter.mesh(this.surface);
      this.element.dataset.mesh = '';
    }
    this.watchSize();
  }

  /** Follow the size of the element. */
  watchSize() {
    new ResizeObserver(() => {
      this.resized();
      this.paint();  // immediately: the new size has cleared the canvas
    }).observe(this.element);
  }

  /**
   * Show another shape, whose map is not known yet.
   * @param {ShapeInfo} shape
   */
  show(shape) {
    Object.assign(this.shape, shape);
    this.units = new Units(shape, this.digits);
    this.rings = shape.painted ?? [shape.outline, ...shape.holes];
    this.painter.outlines(this.rings);
    this.showSilhouette({});
    this.painter.map(new Float32Array(0));
    this.caption.textContent = `${this.side}: ${fileName(shape.name)}`;
    this.showAll();
  }

  /**
   * Set the outlines of a deformed shape as its pins have moved them.
   * @param {Point[][]} rings
   */
  reshape(rings) {
    if (this.shape.painted) {
      [this.shape.outline, ...this.rings] = rings;  // the frame, then what is painted
    } else {
      this.rings = rings;
      [this.shape.outline, ...this.shape.holes] = rings;
    }
    this.painter.outlines(this.rings);
  }

  /**
   * Show more of the target than it paints, as pictures do where its gaps would cut them to pieces.
   * @param {Silhouette} silhouette empty to show what it paints
   */
  showSilhouette({rings, toned, colors}) {
    const text = JSON.stringify([rings, toned, colors]);
    if (text === this.#silhouette) return;
    this.#silhouette = text;
    this.painter.outlines(rings ?? this.rings);
    this.painter.tone(toned ?? [], colors?.[1] ? ratios(colors[1], colors[0]) : [1, 1, 1]);
    this.redraw();
  }

  // ---------------------------------------------------------------- what is visible

  resized() {
    const {clientWidth, clientHeight} = this.element;
    const ratio = (devicePixelRatio || 1) * (this.#rough ? this.#share : 1);
    this.view.width = clientWidth;
    this.view.height = clientHeight;
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    if (!this.#begun || this.view.whole) this.showAll();
    this.#begun = true;
    this.redraw();
  }

  /**
   * Paint fewer pixels while the map is about to change, if there is no graphics card.
   * @param {boolean} on
   */
  hurry(on) {
    if (!this.painter.software || this.#rough === on) return;
    this.#rough = on;
    this.painter.hurried = on;
    this.resized();
  }

  /** Show the whole shape and its canvas. */
  showAll() {
    this.view.showAll(this.wholeBox());
    this.redraw();
    this.viewed();
  }

  /** Return the box of the shape with its canvas. */
  wholeBox() {
    const {box, bounds} = this.shape;
    return this.surface?.bounds() ?? [
      Math.min(box[0], bounds[0]), Math.min(box[1], bounds[1]), Math.max(box[2], bounds[2]), Math.max(box[3], bounds[3]),
    ];
  }

  /**
   * @param {number} factor
   * @param {Point} [pixel] that stays in place
   */
  zoomBy(factor, pixel = this.view.middle) {
    this.view.zoomBy(factor, pixel);
    this.redraw();
    this.viewed();
  }

  /**
   * Pan the view by pixels, or rotate the mesh.
   * @param {number} right
   * @param {number} down
   * @param {boolean} [pan]
   */
  move(right, down, pan = true) {
    if (pan) {
      this.view.pan(right, down);
    } else {
      this.view.whole = false;
      this.surface?.orbit(ORBIT * right, ORBIT * down);
    }
    this.redraw();
    this.viewed();
  }

  // ---------------------------------------------------------------- coordinates

  /**
   * Return the point in page coordinates under a pixel; for a mesh that of its projection.
   * @param {Point} pixel
   */
  at(pixel) {
    return this.view.point(pixel);
  }

  /**
   * Return the pixel of a point in page coordinates.
   * @param {Point} point
   */
  pixel(point) {
    return this.view.pixel(this.surface ? this.surface.turned(point) : point);
  }

  /**
   * Return the pixel of a mouse or pointer event.
   * @param {MouseEvent} event
   */
  pixelOf(event) {
    const box = this.element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /**
   * Clamp a pixel to the pane.
   * @param {Point} pixel
   */
  clamp([x, y]) {
    return [Math.min(Math.max(x, 0), this.view.width), Math.min(Math.max(y, 0), this.view.height)];
  }

  /**
   * Convert a place in the file to page coordinates.
   * @param {Place} place
   * @returns {Point}
   */
  page(place) {
    if (typeof place !== 'string') return this.units.page(place);
    if (!this.surface) throw new Error(`${place}: the shape has no vertices`);
    return this.surface.named(place);
  }

  /**
   * Convert a point to a place in the file; for a mesh to a vertex, if one is close.
   * @param {Point} point
   * @returns {Place}
   */
  file(point) {
    const {surface} = this, hit = surface?.cast(surface.turned(point));
    if (!surface || !hit) return this.#placed(point);
    const pixel = this.pixel(point);
    for (const vertex of surface.corners(hit.triangle)) {
      if (distance(this.pixel(surface.place(vertex)), pixel) <= VERTEX_REACH) return `v${surface.numbers[vertex]}`;
    }
    return this.units.file(point);
  }

  /**
   * Return an entry of the scene; another object once it was removed or undone.
   * @param {Item} item
   */
  entry({kind, number}) {
    return this.scene[kind][number];
  }

  /**
   * Return the place of an entry of the scene on this side.
   * @param {Item} item
   * @returns {Place}
   */
  place({kind, number, point}) {
    if (kind === 'strokes') return this.scene.strokes[number][this.side][point ?? 0];
    return this.scene.pins[number][this.side];
  }

  /**
   * Return the point of the outline under a pixel; null if the outline is not close.
   * @param {Point} pixel
   * @param {number} [reach] in pixels
   */
  rim(pixel, reach = OUTLINE_REACH) {
    const ring = this.shape.outline, {away, edge, share} = closest(ring.map((p) => this.pixel(p)), pixel);
    const point = between(ring[edge], ring[(edge + 1) % ring.length], share);
    return away <= reach && !this.surface?.hides(point) ? point : null;
  }

  /**
   * Return the point of the shape under a pixel, or null.
   * @param {Point} pixel
   * @returns {Point | null}
   */
  hit(pixel) {
    const point = this.at(pixel);
    if (this.surface) return this.surface.cast(point)?.point ?? null;
    return inside(this.shape.outline, point) ? point : null;
  }

  /**
   * Return a place of the file moved by [x, y] in page coordinates; points on the outline stay on it.
   * @param {Place} place
   * @param {Point} by
   */
  moved(place, by) {
    const from = this.page(place), to = from.map((value, k) => value + by[k]), {outline} = this.shape;
    const onOutline = !this.deforms && closest(outline, from).away < ON_OUTLINE;
    return this.units.file(onOutline ? closest(outline, to).point : this.#within(to) ?? from);
  }

  /**
   * Return a point for a pin: at the rim if it is outside of the shape, or null where that is too narrow.
   * @param {Point} point
   */
  #within(point) {
    const {outline} = this.shape;
    return this.deforms || this.surface || inside(outline, point) ? point : atRim(outline, point, RIM_DISTANCE);
  }

  /** The pins that can be rotated: those of a deformed shape, on its moved side. */
  get rotatable() {
    return this.deforms ? this.scene.pins : [];
  }

  /**
   * Return the pixel of the handle that rotates a pin; it is above the pin if the rotation is free.
   * @param {Pin} pin
   */
  armEnd({target, turn}) {
    const [x, y] = this.pixel(this.page(target)), angle = (turn ?? 0) * Math.PI / 180;
    return [x - ARM_LENGTH * Math.sin(angle), y - ARM_LENGTH * Math.cos(angle)];
  }

  /**
   * Return the patch of a soft pin of the source in pixels, or null.
   * @param {number} number
   */
  ring(number) {
    const {pins, patches} = this.scene, patch = patches[number];
    if (this.side !== 'source' || this.surface || !patch || patches.length !== pins.length) return null;
    return {middle: this.pixel(this.page(pins[number].source)), radius: patch.radius / this.units.scale * this.view.zoom};
  }

  /**
   * Return the radius, in file units, of a patch that reaches a pixel.
   * @param {number} number of the pin
   * @param {Point} pixel
   */
  radiusTo(number, pixel) {
    const middle = this.pixel(this.page(this.scene.pins[number].source));
    return significant(distance(middle, pixel) / this.view.zoom * this.units.scale);
  }

  // ---------------------------------------------------------------- pins and strokes

  /**
   * Drag a pin, or a point of a stroke, to a pixel.
   * @param {Item} item
   * @param {Point} pixel
   * @param {{last?: boolean, attracted?: boolean}} [how] whether it is released there, and whether other points attract
   *   it
   * @returns {Point | null} the pixel at which it is then; null if it cannot be there
   */
  drag(item, pixel, {last = false, attracted = false} = {}) {
    const isPin = item.kind === 'pins';
    const onOutline = isPin && !this.deforms && closest(this.shape.outline, this.page(this.place(item))).away < ON_OUTLINE;
    const at = this.at(pixel), under = onOutline ? this.rim(pixel, Infinity) : this.surface ? this.hit(pixel) : isPin ? this.#within(at) : at;
    this.guide = attracted && under && isPin ? this.#attraction(this.pixel(under), onOutline, item.number) : null;
    const point = this.guide ?? under;
    if (!point) return null;
    const isFree = !onOutline && !this.guide && !this.surface;
    const place = isFree ? this.#placed(point) : last && !onOutline ? this.file(point) : this.units.file(point);
    return this.actions.drag(this.side, item, place) ? this.pixel(point) : null;
  }

  /**
   * Convert a point placed by hand to file coordinates, rounded to what a screen can show.
   * @param {Point} point
   */
  #placed(point) {
    return this.units.file(point, this.units.placedDigits(this.view.zoom));
  }

  /**
   * @param {Point} pixel
   * @param {boolean} onOutline
   * @param {number} [number] of the pin, which does not attract itself
   */
  #attraction(pixel, onOutline, number = -1) {
    if (this.deforms) return null;
    const others = this.scene.pins.filter((_, k) => k !== number).map((pin) => this.page(pin[this.side]));
    return attraction(pixel, onOutline, this.shape, others, this);
  }

  /** Select the pins inside the rectangle. */
  selected() {
    const [[a, b], [c, d]] = this.marquee ?? [[0, 0], [0, 0]];
    this.marquee = null;
    const within = (/** @type {Point} */ [x, y]) => (x - a) * (x - c) <= 0 && (y - b) * (y - d) <= 0;
    const numbers = this.scene.pins.map((_, k) => k).filter((k) => within(this.pixel(this.page(this.scene.pins[k][this.side]))));
    this.actions.selectOnly(numbers);
    this.redraw(false);
  }

  /** End the stroke that is being drawn. */
  drawn() {
    const stroke = strokeOf(this.drawing ?? [], this.surface ? null : this.shape.outline, this.view.zoom);
    this.drawing = null;
    this.redraw();
    if (!stroke) return;
    this.actions.stroke(this.side, stroke.line.map((point) => this.units.file(point)), stroke.closed);
  }

  /**
   * Place a pin at a pixel inside the shape.
   * @param {Point} [pixel]
   */
  click(pixel = this.view.middle) {
    if (this.tool === 'select') {
      this.actions.selectOnly([]);
      return;
    }
    const isStroke = this.tool === 'stroke', rim = isStroke || this.deforms || !this.hasRim ? null : this.rim(pixel);
    const under = rim ?? this.hit(pixel);
    if (!under) return;
    if (isStroke) {
      this.drawing ??= [];
      this.drawing.push(under);
    } else {
      const attracted = this.#attraction(this.pixel(under), rim !== null), point = attracted ?? under;
      const place = rim || attracted ? this.units.file(point) : this.file(point);
      if (this.tool === 'pair') this.actions.placeEnd(this.side, place);
      else this.actions.place(this.side, place);
    }
    this.redraw();
  }

  // ---------------------------------------------------------------- painting

  /**
   * Draw everything again in the next frame, or only lines and handles.
   * @param {boolean} [painted]
   */
  redraw(painted = true) {
    this.#stale ||= painted;
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      if (this.#stale) this.paint();
      this.lines.draw(this);
      this.handles.draw();
      this.divider.draw();
    });
  }

  paint() {
    this.#stale = false;
    const now = performance.now(), [slow, resting] = SLOW_FRAME, took = now - this.#painted;
    this.#painted = now;
    if (this.#rough && this.#share > SLOW_SHARE && took > slow && took < resting) {
      this.#share = SLOW_SHARE;
      this.resized();
    }
    const {x, y, zoom} = this.view, ratio = this.canvas.width / this.view.width, turn = this.surface?.axes;
    /** @type {PaintedView} */
    const view = {x, y, zoom: zoom * ratio, width: this.canvas.width, height: this.canvas.height, turn};
    this.painter.draw(view, this.overlay);
    if (!this.loupe) return;
    const [left, top] = this.loupeCorner(), [loupeX, loupeY] = this.at(this.loupe);
    this.painter.draw({
      x: loupeX, y: loupeY, zoom: LOUPE_ZOOM * zoom * ratio, turn,
      left: left * ratio, bottom: (this.view.height - top - LOUPE_SIDE) * ratio,
      width: LOUPE_SIDE * ratio, height: LOUPE_SIDE * ratio,
    }, {...this.overlay, swipe: null});
  }

  /** Fade from the picture that is visible to the one that is painted next. */
  fade() {
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    this.paint();  // the canvas can be copied only right after it was painted
    const before = document.createElement('canvas');
    before.width = this.canvas.width;
    before.height = this.canvas.height;
    before.setAttribute('aria-hidden', 'true');
    before.getContext('2d')?.drawImage(this.canvas, 0, 0);
    this.canvas.after(before);
    before.animate([{opacity: 1}, {opacity: 0}], FADE).onfinish = () => before.remove();
  }

  /** Return the upper left corner of the loupe: on the right, or on the left if it would hide what is dragged. */
  loupeCorner() {
    const [x, y] = this.loupe ?? [0, 0], right = this.view.width - LOUPE_SIDE - LOUPE_MARGIN;
    const hides = x > right - LOUPE_AWAY && y < LOUPE_TOP + LOUPE_SIDE + LOUPE_AWAY;
    return [hides ? LOUPE_MARGIN : right, LOUPE_TOP];
  }

  /**
   * Return a PNG, as an address, of the picture painted on the file's canvas, or of a mesh.
   * @param {number} width in pixels
   * @param {number} height
   */
  picture(width, height) {
    const [left, top, right, bottom] = this.surface?.bounds() ?? this.shape.box;
    const {width: oldWidth, height: oldHeight} = this.canvas;
    this.canvas.width = width;
    this.canvas.height = height;
    this.painter.draw({
      x: (left + right) / 2, y: (top + bottom) / 2,
      zoom: Math.min(width / (right - left), height / (bottom - top)), width, height, turn: this.surface?.axes,
    }, {...this.overlay, plain: true});
    const address = this.canvas.toDataURL();
    this.canvas.width = oldWidth;
    this.canvas.height = oldHeight;
    this.redraw();
    return address;
  }
}

/**
 * Return the ratios of red, green and blue of two colours as in SVG, #rrggbb.
 * @param {string} colour
 * @param {string} other
 */
function ratios(colour, other) {
  const [parts, others] = [colour, other].map((text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16)));
  return parts.map((part, k) => part / Math.max(others[k], 1));
}
