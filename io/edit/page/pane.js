// One half of the page: the painted shape, and over it handles of pins and strokes.

import {between, called, clipped, closest, distance, inside, simplified, Units} from './geometry.js';
import {Painter} from './gl.js';
import {Surface} from './surface.js';

const SVG = 'http://www.w3.org/2000/svg';
export const DRAWN = 2;                // pixels: the error of a drawn line
const CLICK = 4, RIM = 8;             // pixels: moved less is a click; so near is on the outline
const ON_RIM = 1e-3;                  // of the shape: what the server takes for a pin of the outline
const NUDGE = 0.005, FINE = 0.1;      // of the view: what an arrow key moves, and a tenth of it with Shift
const LEAST = 0.2, MOST = 2000;       // zoom, times that at which all is seen
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
const SNAP = 4;                       // pixels: a pin let go of so near to a vertex of a mesh is on it
const CORNER = 8, IMAGE = 6;          // pixels: so near a corner, or a mirror image or axis, attracts a pin
const LOUPE = 150, LARGER = 4;        // pixels of the loupe's sides, and how many times larger it shows what is dragged
const ROUGH = 0.5;                    // of the pixels of a side, while the map follows without a graphics card
const STEP = 40, TURN = 0.008;        // pixels that an arrow key moves the view, and radians a pixel turns a mesh
const ARM = 34, SWING = 5;            // pixels from a pin to the handle that turns it, and degrees an arrow key does

export class Pane {
  /** @param does {place, drag, drop, remove, stroke, choose, hover}: what happens on it */
  constructor(side, element, shape, hello, does) {
    Object.assign(this, {side, element, shape, does, units: new Units(shape, hello.digits)});
    this.free = hello.deforming && side === 'target';  // its outline is where pins move it
    this.canvas = element.appendChild(document.createElement('canvas'));
    this.canvas.setAttribute('aria-hidden', 'true');
    this.lines = element.appendChild(document.createElementNS(SVG, 'svg'));
    this.lines.setAttribute('aria-hidden', 'true');
    this.lines.innerHTML = `<g id="lines-${side}"></g><svg class="loupe" width="${LOUPE}" height="${LOUPE}">
      <use href="#lines-${side}"></use><rect width="100%" height="100%"></rect><path d="M${LOUPE / 2 - 9} ${LOUPE / 2}h18m-9 -9v18"></path></svg>`;
    [this.paths, this.glass] = this.lines.children;
    this.handles = element.appendChild(document.createElement('div'));
    this.handles.className = 'handles';
    this.caption = element.appendChild(document.createElement('p'));
    this.caption.textContent = `${this.free ? 'deformed' : side}: ${called(shape.name)}`;
    this.caption.className = 'caption';
    this.rings = shape.painted ?? [shape.outline, ...shape.holes];
    this.painter = new Painter(this.canvas, shape);
    this.view = {x: 0, y: 0, zoom: 1, width: 1, height: 1};
    this.overlay = {grid: false, stretch: false, own: 0, mapped: side === 'target', holes: hello.holes, mean: hello.mean, step: 0.1};
    this.scene = {pins: [], strokes: [], regions: [], wrong: {}, suggested: [], selected: new Set(), locked: () => false};
    this.#listen();
  }

  /** What has to be fetched: the triangles of a mesh, and what the file itself shows. */
  async load() {
    const own = await fetch(`${this.side}.drawing`);
    if (own.status === 200) {
      const image = new Image();
      image.src = own.url;
      await image.decode();
      this.painter.drawing(image, this.shape.canvas);
      this.own = true;
    }
    if (this.shape.mesh) {
      const answer = await fetch(`${this.side}.triangles`);
      this.surface = new Surface(await answer.arrayBuffer(), this.shape.axes);
      this.painter.mesh(this.surface);
    }
    new ResizeObserver(() => { this.resized(); this.paint(); }).observe(this.element);  // at once: a new size has cleared it
  }

  /** Where the pins of a shape that is deformed have moved its outlines. */
  reshape(rings) {
    if (this.shape.painted) [this.shape.outline, ...this.rings] = rings;  // the frame, then what is painted
    else [this.shape.outline, ...this.shape.holes] = this.rings = rings;
    this.painter.outlines(this.rings);
  }

  resized() {
    const {clientWidth, clientHeight} = this.element, ratio = (devicePixelRatio || 1) * (this.rough ? ROUGH : 1);
    const first = this.view.width === 1;
    Object.assign(this.view, {width: clientWidth, height: clientHeight});
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    if (first || this.whole) this.showAll();
    this.redraw();
  }

  /** Whether fewer pixels do, since the map is about to change: where there is no graphics card. */
  hurry(on) {
    if (!this.painter.software || Boolean(this.rough) === on) return;
    this.rough = on;
    this.resized();
  }

  /** The whole shape and its canvas in view. */
  showAll() {
    const boxes = this.surface ? [this.surface.bounds()] : [this.shape.box, this.shape.bounds];
    const [left, top] = [0, 1].map((k) => Math.min(...boxes.map((box) => box[k])));
    const [right, bottom] = [2, 3].map((k) => Math.max(...boxes.map((box) => box[k])));
    const {width, height} = this.view;
    const zoom = 0.92 * Math.min(width / (right - left), height / (bottom - top));
    Object.assign(this.view, {x: (left + right) / 2, y: (top + bottom) / 2, zoom});
    this.all = zoom;
    this.whole = true;
    this.redraw();
  }

  zoomBy(factor, at = [this.view.width / 2, this.view.height / 2]) {
    const before = this.at(at);
    this.whole = false;
    this.view.zoom = Math.min(MOST * this.all, Math.max(LEAST * this.all, this.view.zoom * factor));
    const after = this.at(at);
    this.view.x += before[0] - after[0];
    this.view.y += before[1] - after[1];
    this.redraw();
  }

  /** The page's coordinates of a pixel of the pane, and back. */
  at([x, y]) {
    const {view} = this;
    return [view.x + (x - view.width / 2) / view.zoom, view.y + (y - view.height / 2) / view.zoom];
  }

  pixel(p) {
    const {view} = this, [x, y] = this.surface ? this.surface.turned(p) : p;
    return [(x - view.x) * view.zoom + view.width / 2, (y - view.y) * view.zoom + view.height / 2];
  }

  /** The page's coordinates of a place as the file has it. */
  page(place) {
    return typeof place === 'string' ? this.surface.named(place) : this.units.page(place);
  }

  /** The point of the outline under a pixel, null if that is not close. */
  rim(pixel, near = RIM) {
    const ring = this.shape.outline, {away, edge, share} = closest(ring.map((p) => this.pixel(p)), pixel);
    const point = between(ring[edge], ring[(edge + 1) % ring.length], share);
    return away <= near && !this.surface?.hides(point) ? point : null;
  }

  /** The point of the shape under a pixel, as the page has it; null where there is none. */
  hit(pixel) {
    const p = this.at(pixel);
    return this.surface ? this.surface.cast(p)?.point ?? null : inside(this.shape.outline, p) ? p : null;
  }

  /** The place of a point as the file has it: of a mesh a vertex, where one is close. */
  file(point) {
    const {surface} = this;
    if (!surface) return this.units.file(point);
    const hit = surface.cast(surface.turned(point)), at = this.pixel(point);
    const near = hit && surface.corners(hit.triangle).find((k) => distance(this.pixel(surface.place(k)), at) <= SNAP);
    return near === null || near === undefined ? this.units.file(point) : `v${surface.numbers[near]}`;
  }

  #event(event) {
    const box = this.element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /** All anew with the next frame, or pins and lines alone. */
  redraw(painted = true) {
    this.stale ||= painted;
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      if (this.stale) this.paint();
      this.#drawLines();
      this.#drawHandles();
    });
  }

  paint() {
    this.stale = false;
    const ratio = this.canvas.width / this.view.width;
    const {x, y, zoom} = this.view, turn = this.surface?.axes;
    const view = {x, y, zoom: zoom * ratio, width: this.canvas.width, height: this.canvas.height, turn};
    this.painter.draw(view, this.overlay);
    if (!this.loupe) return;
    const [left, top] = this.#corner(), [around, above] = this.at(this.loupe), side = LOUPE * ratio;
    const part = {left: left * ratio, bottom: (this.view.height - top - LOUPE) * ratio, width: side, height: side};
    this.painter.draw({x: around, y: above, zoom: LARGER * zoom * ratio, turn, ...part}, this.overlay);
  }

  /** Where the loupe is: on the right above, or on the left where that hides what is dragged. */
  #corner() {
    const {width} = this.view, [x, y] = this.loupe, right = width - LOUPE - 8;
    return [x > right - 40 && y < LOUPE + 76 ? 8 : right, 36];
  }

  /** What the canvas paints of the canvas of the file, or of a mesh, as a PNG's address: `width` x `height` pixels. */
  picture(width, height) {
    const [left, top, right, bottom] = this.surface?.bounds() ?? this.shape.box;
    const {width: w, height: h} = this.canvas, overlay = {...this.overlay, plain: true};
    const zoom = Math.min(width / (right - left), height / (bottom - top));
    const view = {x: (left + right) / 2, y: (top + bottom) / 2, zoom, width, height, turn: this.surface?.axes};
    Object.assign(this.canvas, {width, height});
    this.painter.draw(view, overlay);
    const address = this.canvas.toDataURL();
    Object.assign(this.canvas, {width: w, height: h});
    this.redraw();
    return address;
  }

  // ---------------------------------------------------------------- lines and handles

  #drawLines() {
    const path = (points, closed) =>
      'M' + points.map((p) => this.pixel(p).map((v) => v.toFixed(1)).join(' ')).join('L') + (closed ? 'Z' : '');
    const drawn = [{d: this.rings.map((ring) => path(ring, true)).join(''), class: 'outline'}];
    if (this.rings.length > 1 && this.shape.painted) drawn.unshift({d: path(this.shape.outline, true), class: 'frame'});
    for (const region of this.scene.regions) drawn.push({d: path(region[this.side], true), class: 'region'});
    this.scene.strokes.forEach((stroke, k) => {
      const wrong = this.scene.wrong.strokes?.includes(k) ? ' wrong' : '';
      drawn.push({d: path(stroke[this.side].map((p) => this.page(p))), class: `stroke${wrong}`, hue: hue(k + 3)});
    });
    for (const pin of this.turning) {
      const [from, to] = [this.pixel(this.page(pin.target)), this.#arm(pin)].map((p) => p.map((v) => v.toFixed(1)).join(' '));
      drawn.push({d: `M${from}L${to}`, class: pin.turn === null ? 'arm free' : 'arm'});
    }
    if (this.drawing) drawn.push({d: path(this.drawing), class: 'stroke drawing'});
    if (this.guide) {
      const [x, y] = this.pixel(this.guide);
      drawn.push({d: `M${x - 14} ${y}h28M${x} ${y - 14}v28`, class: 'guide'});
    }
    while (this.paths.childElementCount > drawn.length) this.paths.lastChild.remove();
    while (this.paths.childElementCount < drawn.length) this.paths.append(document.createElementNS(SVG, 'path'));
    this.glass.style.display = this.loupe ? '' : 'none';
    if (this.loupe) {
      const [x, y] = this.loupe.map((v) => LOUPE / 2 - LARGER * v);
      this.glass.firstElementChild.setAttribute('transform', `translate(${x} ${y}) scale(${LARGER})`);
      this.#corner().forEach((value, k) => this.glass.setAttribute('xy'[k], value));
    }
    drawn.forEach((line, k) => {
      const element = this.paths.children[k];
      element.setAttribute('d', line.d);
      element.setAttribute('class', line.class);
      element.style.setProperty('--hue', line.hue ?? 0);
    });
  }

  #drawHandles() {
    const wanted = [];
    this.scene.pins.forEach((pin, k) => wanted.push({
      key: `pin ${k}`, item: {kind: 'pins', number: k}, place: pin[this.side], text: pin.name || `${k + 1}`,
      wrong: this.scene.wrong.pins?.includes(k), hue: hue(k), class: 'pin',
      selected: this.scene.selected.has(k), locked: this.scene.locked(pin),
    }));
    this.turning.forEach((pin, k) => wanted.push({
      key: `turn ${k}`, item: {kind: 'pins', number: k}, place: pin.target, text: pin.turn === null ? '' : `${pin.turn}°`, at: this.#arm(pin),
      name: `turn of pin ${pin.name || k + 1}: ${pin.turn === null ? 'free' : `${pin.turn} degrees`}`, hue: hue(k), class: 'turn',
    }));
    this.scene.suggested.forEach((pin, k) => wanted.push({
      key: `ghost ${pin.source} ${pin.target}`, item: {kind: 'suggested', number: k}, place: pin[this.side], text: pin.name || '+',
      name: `suggested pin ${pin.name || k + 1}`, hue: 0, class: 'ghost',
    }));
    this.scene.strokes.forEach((stroke, k) => stroke[this.side].forEach((place, j) => wanted.push({
      key: `stroke ${k} ${j}`, item: {kind: 'strokes', number: k, point: j}, place, text: '',
      name: `stroke ${stroke.name || k + 1}, point ${j + 1}`,
      wrong: this.scene.wrong.strokes?.includes(k), hue: hue(k + 3), class: 'point',
    })));
    const there = new Map([...this.handles.children].map((element) => [element.dataset.key, element]));
    for (const handle of wanted) {
      const element = there.get(handle.key) ?? this.#handle(handle);
      there.delete(handle.key);
      const point = this.page(handle.place), [x, y] = handle.at ?? this.pixel(point);
      element.classList.toggle('behind', Boolean(this.surface?.hides(point)));
      element.style.transform = `translate(${x}px, ${y}px)`;
      element.style.setProperty('--hue', handle.hue);
      element.classList.toggle('wrong', Boolean(handle.wrong));
      element.classList.toggle('locked', Boolean(handle.locked));
      if (handle.class === 'pin') element.setAttribute('aria-pressed', Boolean(handle.selected));
      if (handle.class === 'ghost') element.onclick = () => this.does.accept(handle.item.number);
      element.dataset.text = handle.text;
      const said = `${handle.name ?? `${handle.locked ? 'locked ' : ''}pin ${handle.text}`}, ${this.side}, at ${[handle.place].flat().join(', ')}`;
      element.setAttribute('aria-label', handle.wrong ? `${said}: not met` : said);
    }
    for (const element of there.values()) element.remove();
  }

  #handle({key, item, class: kind}) {
    const element = this.handles.appendChild(document.createElement('button'));
    element.dataset.key = key;
    element.className = `handle ${kind}`;
    if (kind === 'ghost') element.onpointerdown = (event) => event.stopPropagation();
    if (kind === 'ghost') return element;
    if (kind === 'turn') {
      element.onpointerdown = (event) => this.#swing(event, element, item.number);
      element.ondblclick = (event) => { event.stopPropagation(); this.does.turn(item, null); this.does.drop(); };
      element.onkeydown = (event) => this.#swingKey(event, item);
      return element;
    }
    element.onpointerdown = (event) => this.#grab(event, element, item);
    element.ondblclick = (event) => { event.stopPropagation(); this.does.remove(item); };
    element.onkeydown = (event) => this.#key(event, item);
    element.onfocus = () => this.does.choose(item);
    element.onpointerenter = () => this.does.hover(item);
    element.onpointerleave = () => this.does.hover(null);
    return element;
  }

  #grab(event, element, item) {
    if (event.button) return;
    event.stopPropagation();
    if (event.shiftKey && item.kind === 'pins') return this.does.select(item);
    element.setPointerCapture(event.pointerId);
    const start = this.#event(event), from = this.pixel(this.page(this.#place(item)));
    let to = null;
    const {width, height} = this.view, within = (value, most) => Math.min(Math.max(value, 0), most);
    element.onpointermove = (next) => {
      const here = this.#event(next), [x, y] = [0, 1].map((k) => from[k] + here[k] - start[k]);
      if (!to && distance(here, start) <= CLICK) return;
      to = [within(x, width), within(y, height)];
      this.loupe = this.#drag(item, to, false, !next.altKey);
      this.redraw(Boolean(this.loupe));
    };
    element.onpointerup = element.onpointercancel = () => {
      element.onpointermove = element.onpointerup = element.onpointercancel = null;
      if (to && this.surface) this.#drag(item, to, true);
      if (to) this.redraw();
      this.loupe = this.guide = null;
      if (to) this.does.drop();
    };
  }

  /** The pins that may be turned: those of a shape that is deformed, where it is. */
  get turning() {
    return this.free ? this.scene.pins : [];
  }

  /** The pixel of the handle that turns a pin; above it where it does not. */
  #arm({target, turn}) {
    const [x, y] = this.pixel(this.page(target)), angle = (turn ?? 0) * Math.PI / 180;
    return [x - ARM * Math.sin(angle), y - ARM * Math.cos(angle)];
  }

  #swing(event, element, number) {
    if (event.button) return;
    event.stopPropagation();
    element.setPointerCapture(event.pointerId);
    const start = this.#event(event);
    let turned = false;
    element.onpointermove = (next) => {
      const here = this.#event(next), [x, y] = this.pixel(this.page(this.scene.pins[number].target));
      turned ||= distance(here, start) > CLICK;
      if (turned) this.does.turn({number}, Number((Math.atan2(x - here[0], y - here[1]) * 180 / Math.PI).toFixed(1)));
    };
    element.onpointerup = element.onpointercancel = () => {
      element.onpointermove = element.onpointerup = element.onpointercancel = null;
      if (turned) this.does.drop();
    };
  }

  #swingKey(event, item) {
    const [right, down] = ARROWS[event.key] ?? [], {turn} = this.scene.pins[item.number];
    const by = -SWING * (event.shiftKey ? FINE : 1) * (right || down);
    if (event.key === 'Delete' || event.key === 'Backspace') this.does.turn(item, null);
    else if (by) this.does.turn(item, Number((((turn ?? 0) + by) % 360).toFixed(1)));
    else return;
    clearTimeout(this.still);
    this.still = setTimeout(() => this.does.drop(), 250);
    event.preventDefault();
    event.stopPropagation();
  }

  #place({kind, number, point}) {
    const place = this.scene[kind][number][this.side];
    return kind === 'pins' ? place : place[point];
  }

  /** Whether a pin of the outline: it stays there. */
  #onRim(item) {
    return !this.free && item.kind === 'pins' && closest(this.shape.outline, this.page(this.#place(item))).away < ON_RIM;
  }

  /** Gives the pixel where it came to, null where it cannot be. */
  #drag(item, pixel, last = false, attracted = false) {
    const rim = this.#onRim(item), free = rim ? this.rim(pixel, Infinity) : this.surface ? this.hit(pixel) : this.at(pixel);
    this.guide = attracted && free && item.kind === 'pins' ? this.#attraction(this.pixel(free), rim, item.number) : null;
    const point = this.guide ?? free;
    if (!point || !this.does.drag(this.side, item, last && !rim ? this.file(point) : this.units.file(point))) return null;
    return this.pixel(point);
  }

  /** What attracts pin `number` at a pixel: on the outline a corner, else mirror images of other pins and the axis. */
  #attraction(pixel, rim, number = -1) {
    if (this.free) return null;
    const {corners = [], axis, outline} = this.shape, mirrored = typeof axis === 'number';
    const near = (points, most) => points.map((p) => ({p, away: distance(this.pixel(p), pixel)}))
      .reduce((best, each) => (each.away < best.away ? each : best), {p: null, away: most}).p;
    const others = mirrored ? this.scene.pins.filter((_, k) => k !== number) : [];
    const images = others.map((pin) => this.page(pin[this.side])).map(([x, y]) => [2 * axis - x, y]);
    const there = rim ? images.map((p) => closest(outline, p)).map(({point}) => point) : images;
    const found = (rim && near(corners, CORNER)) || near(there, IMAGE);
    return found ?? (mirrored && !rim ? near([[axis, this.at(pixel)[1]]], IMAGE) : null);
  }

  /** A place of the file moved by [x, y] of the page; on the outline it stays there. */
  moved(place, by) {
    const from = this.page(place), to = from.map((value, k) => value + by[k]), {outline} = this.shape;
    return this.units.file(!this.free && closest(outline, from).away < ON_RIM ? closest(outline, to).point : to);
  }

  #key(event, item) {
    if (event.key === 'Delete' || event.key === 'Backspace') this.does.remove(item, event.shiftKey);
    else if (event.key === ' ' && item.kind === 'pins') this.does.select(item);
    else if (event.key.toLowerCase() === 'l' && !event.ctrlKey && !event.metaKey && item.kind === 'pins') this.does.lock(item);
    else if (ARROWS[event.key] && !event.ctrlKey && !event.altKey && !event.metaKey) {
      const step = NUDGE * (event.shiftKey ? FINE : 1) * this.view.width;
      const from = this.pixel(this.page(this.#place(item)));
      this.#drag(item, [0, 1].map((k) => from[k] + step * ARROWS[event.key][k]));
      clearTimeout(this.still);
      this.still = setTimeout(() => this.does.drop(), 250);
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  // ---------------------------------------------------------------- the shape itself

  #listen() {
    const {element} = this;
    element.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), this.#event(event));
    }, {passive: false});
    element.addEventListener('keydown', (event) => {
      const way = event.target === element && !event.ctrlKey && !event.altKey && !event.metaKey && ARROWS[event.key];
      if (!way) return;
      event.preventDefault();
      this.move(STEP * way[0], STEP * way[1], !this.surface || event.shiftKey);
    });
    element.addEventListener('pointerdown', (event) => {
      if (event.button > 1) return;
      element.setPointerCapture(event.pointerId);
      const start = this.#event(event), pan = !this.surface || event.shiftKey || event.button === 1;
      if (this.pen && event.button === 0) this.drawing = [];
      let moved = false, last = start;
      const draw = (pixel) => { const point = this.surface ? this.hit(pixel) : this.at(pixel); if (point) this.drawing?.push(point); };
      draw(start);
      element.onpointermove = (next) => {
        const here = this.#event(next);
        moved ||= distance(here, start) > CLICK;
        if (this.drawing) draw(here);
        else if (moved) this.move(here[0] - last[0], here[1] - last[1], pan);
        last = here;
        this.redraw();
      };
      element.onpointerup = element.onpointercancel = (end) => {
        element.onpointermove = element.onpointerup = element.onpointercancel = null;
        if (this.drawing) this.drawn();
        else if (!moved && event.button === 0 && end.type === 'pointerup') this.click(start);
      };
    });
  }

  /** The view moved by pixels, or the mesh turned. */
  move(x, y, pan = true) {
    this.whole = false;
    if (pan) Object.assign(this.view, {x: this.view.x - x / this.view.zoom, y: this.view.y - y / this.view.zoom});
    else this.surface.orbit(TURN * x, TURN * y);
    this.redraw();
  }

  /** The stroke that was being drawn is done. */
  drawn() {
    const whole = this.surface ? this.drawing : clipped(this.shape.outline, this.drawing);
    const line = whole.length > 1 ? simplified(whole, DRAWN / this.view.zoom) : [];
    this.drawing = null;
    this.redraw();
    const long = line.reduce((sum, p, k) => sum + (k ? distance(p, line[k - 1]) : 0), 0) * this.view.zoom;
    const closed = line.length > 3 && !this.surface && distance(line[0], line.at(-1)) * this.view.zoom < Math.min(2 * RIM, long / 4);
    if (long > 2 * RIM) this.does.stroke(this.side, (closed ? line.slice(0, -1) : line).map((p) => this.units.file(p)), closed);
  }

  /** A pin at a pixel, if the shape is there; with the pen a point of a stroke. */
  click(pixel = [this.view.width / 2, this.view.height / 2]) {
    const rim = this.pen || this.free ? null : this.rim(pixel), free = rim ?? this.hit(pixel);
    const point = (!this.pen && free && this.#attraction(this.pixel(free), Boolean(rim))) || free;
    if (!point) return;
    if (this.pen) (this.drawing ??= []).push(point);
    else this.does.place(this.side, rim ? this.units.file(point) : this.file(point));
    this.redraw();
  }
}

/** The colour of a pair: neighbours differ by the golden angle. */
export const hue = (k) => Math.round((330 + 137.508 * k) % 360);
