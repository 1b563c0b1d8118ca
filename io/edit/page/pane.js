// One half of the page: the painted shape, and over it handles of pins and strokes.

import {area, closest, distance, inside, simplified, Units} from './geometry.js';
import {Painter} from './gl.js';

const SVG = 'http://www.w3.org/2000/svg';
export const DRAWN = 2;                // pixels: the error of a drawn line
const CLICK = 4, RIM = 8;             // pixels: moved less is a click; so near is on the outline
const ON_RIM = 1e-3;                  // of the shape: what the server takes for a pin of the outline
const NUDGE = 0.005, FINE = 0.1;      // of the view: what an arrow key moves, and a tenth of it with Shift
const LEAST = 0.2, MOST = 2000;       // zoom, times that at which all is seen

export class Pane {
  /** @param does {place, drag, drop, remove, stroke, choose, hover}: what happens on it */
  constructor(side, element, shape, hello, does) {
    Object.assign(this, {side, element, shape, does, units: new Units(shape, hello.digits)});
    this.canvas = element.appendChild(document.createElement('canvas'));
    this.canvas.setAttribute('aria-hidden', 'true');
    this.lines = element.appendChild(document.createElementNS(SVG, 'svg'));
    this.lines.setAttribute('aria-hidden', 'true');
    this.handles = element.appendChild(document.createElement('div'));
    this.handles.className = 'handles';
    this.caption = element.appendChild(document.createElement('p'));
    this.caption.textContent = `${side}: ${shape.name}`;
    this.caption.className = 'caption';
    this.rings = [shape.outline, ...shape.holes];
    this.area = area(shape.outline);
    this.painter = new Painter(this.canvas, shape);
    this.view = {x: 0, y: 0, zoom: 1, width: 1, height: 1};
    this.overlay = {grid: false, stretch: false, mapped: side === 'target', holes: hello.holes, mean: 1, step: 0.1};
    this.scene = {pins: [], strokes: [], wrong: {}};
    new ResizeObserver(() => this.#resized()).observe(element);
    this.#listen();
  }

  #resized() {
    const {clientWidth, clientHeight} = this.element, ratio = devicePixelRatio || 1;
    const first = this.view.width === 1;
    Object.assign(this.view, {width: clientWidth, height: clientHeight});
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    if (first) this.showAll();
    this.redraw();
  }

  /** The whole shape and its canvas in view. */
  showAll() {
    const boxes = [this.shape.box, this.shape.bounds];
    const [left, top] = [0, 1].map((k) => Math.min(...boxes.map((box) => box[k])));
    const [right, bottom] = [2, 3].map((k) => Math.max(...boxes.map((box) => box[k])));
    const {width, height} = this.view;
    const zoom = 0.92 * Math.min(width / (right - left), height / (bottom - top));
    Object.assign(this.view, {x: (left + right) / 2, y: (top + bottom) / 2, zoom});
    this.all = zoom;
    this.redraw();
  }

  zoomBy(factor, at = [this.view.width / 2, this.view.height / 2]) {
    const before = this.at(at);
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

  pixel([x, y]) {
    const {view} = this;
    return [(x - view.x) * view.zoom + view.width / 2, (y - view.y) * view.zoom + view.height / 2];
  }

  #event(event) {
    const box = this.element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      this.paint();
    });
  }

  paint() {
    const ratio = this.canvas.width / this.view.width;
    const {x, y, zoom} = this.view;
    const view = {x, y, zoom: zoom * ratio, width: this.canvas.width, height: this.canvas.height};
    this.painter.draw(view, this.overlay);
    this.#drawLines();
    this.#drawHandles();
  }

  /** What the canvas paints of the canvas of the file, as a PNG's address: `width` x `height` pixels. */
  picture(width, height) {
    const [left, top, right, bottom] = this.shape.box;
    const {width: w, height: h} = this.canvas;
    const zoom = Math.min(width / (right - left), height / (bottom - top));
    Object.assign(this.canvas, {width, height});
    this.painter.draw({x: (left + right) / 2, y: (top + bottom) / 2, zoom, width, height}, this.overlay);
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
    this.scene.strokes.forEach((stroke, k) => {
      const wrong = this.scene.wrong.strokes?.includes(k) ? ' wrong' : '';
      drawn.push({d: path(stroke[this.side].map((p) => this.units.page(p))), class: `stroke${wrong}`, hue: hue(k + 3)});
    });
    if (this.drawing) drawn.push({d: path(this.drawing), class: 'stroke drawing'});
    while (this.lines.childElementCount > drawn.length) this.lines.lastChild.remove();
    while (this.lines.childElementCount < drawn.length) this.lines.append(document.createElementNS(SVG, 'path'));
    drawn.forEach((line, k) => {
      const element = this.lines.children[k];
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
      const [x, y] = this.pixel(this.units.page(handle.place));
      element.style.transform = `translate(${x}px, ${y}px)`;
      element.style.setProperty('--hue', handle.hue);
      element.classList.toggle('wrong', Boolean(handle.wrong));
      element.dataset.text = handle.text;
      const said = `${handle.name ?? `pin ${handle.text}`}, ${this.side}, at ${handle.place.join(', ')}`;
      element.setAttribute('aria-label', handle.wrong ? `${said}: not met` : said);
    }
    for (const element of there.values()) element.remove();
  }

  #handle({key, item, class: kind}) {
    const element = this.handles.appendChild(document.createElement('button'));
    element.dataset.key = key;
    element.className = `handle ${kind}`;
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
    element.setPointerCapture(event.pointerId);
    const start = this.#event(event), from = this.pixel(this.units.page(this.#place(item)));
    let moved = false;
    element.onpointermove = (next) => {
      const here = this.#event(next);
      moved ||= distance(here, start) > CLICK;
      if (moved) this.#drag(item, this.at([from[0] + here[0] - start[0], from[1] + here[1] - start[1]]));
    };
    element.onpointerup = element.onpointercancel = () => {
      element.onpointermove = element.onpointerup = element.onpointercancel = null;
      if (moved) this.does.drop();
    };
  }

  #place({kind, number, point}) {
    const place = this.scene[kind][number][this.side];
    return kind === 'pins' ? place : place[point];
  }

  /** Whether a pin of the outline: it stays there. */
  #onRim(item) {
    const p = this.units.page(this.#place(item));
    return item.kind === 'pins' && distance(closest(this.shape.outline, p), p) < ON_RIM;
  }

  #drag(item, p) {
    const place = this.#onRim(item) ? closest(this.shape.outline, p) : p;
    this.does.drag(this.side, item, this.units.file(place));
  }

  #key(event, item) {
    const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
    if (event.key === 'Delete' || event.key === 'Backspace') this.does.remove(item, event.shiftKey);
    else if (arrows[event.key] && !event.ctrlKey && !event.altKey && !event.metaKey) {
      const step = NUDGE * (event.shiftKey ? FINE : 1) * this.view.width / this.view.zoom;
      const p = this.units.page(this.#place(item));
      this.#drag(item, [0, 1].map((k) => p[k] + step * arrows[event.key][k]));
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
    element.addEventListener('pointerdown', (event) => {
      if (event.button > 1) return;
      element.setPointerCapture(event.pointerId);
      const start = this.#event(event), {x, y} = this.view;
      if (this.pen && event.button === 0) this.drawing = [this.at(start)];
      let moved = false;
      element.onpointermove = (next) => {
        const here = this.#event(next);
        moved ||= distance(here, start) > CLICK;
        if (this.drawing) this.drawing.push(this.at(here));
        else if (moved) {
          this.view.x = x - (here[0] - start[0]) / this.view.zoom;
          this.view.y = y - (here[1] - start[1]) / this.view.zoom;
        }
        this.redraw();
      };
      element.onpointerup = element.onpointercancel = (last) => {
        element.onpointermove = element.onpointerup = element.onpointercancel = null;
        if (this.drawing) this.#drawn();
        else if (!moved && event.button === 0 && last.type === 'pointerup') this.click(start);
      };
    });
  }

  #drawn() {
    const line = simplified(this.drawing, DRAWN / this.view.zoom);
    this.drawing = null;
    this.redraw();
    const long = line.reduce((sum, p, k) => sum + (k ? distance(p, line[k - 1]) : 0), 0) * this.view.zoom;
    if (long > 2 * RIM) this.does.stroke(this.side, line.map((p) => this.units.file(p)));
  }

  /** A pin at a pixel, if the shape is there. */
  click(pixel = [this.view.width / 2, this.view.height / 2]) {
    const p = this.at(pixel), rim = closest(this.shape.outline, p);
    const near = distance(this.pixel(rim), pixel) <= RIM;
    if (near || inside(this.shape.outline, p)) this.does.place(this.side, this.units.file(near ? rim : p));
  }
}

/** The colour of a pair: neighbours differ by the golden angle. */
export const hue = (k) => Math.round((330 + 137.508 * k) % 360);
