// Lines over a painted shape: outlines, strokes, rigid regions, rings and arms of pins, the guide and the loupe.

import {SVG} from './dom.js';
import {pinHue, strokeHue} from './hues.js';

/** @import {Pane} from './pane.js' */
/** @import {Point, Side} from './types.d.ts' */

/** @typedef {{d: string, class: string, hue?: number}} Line */

const GUIDE_ARM = 14;     // pixels: half the length of the cross where a pin is attracted
const POINTER_ARM = 7;    // pixels: half the length of the cross at the image of the other side's pointer
const WANTED_RADIUS = 5;  // pixels: of the mark where a pin that stopped short was dragged to
const PENDING_RADIUS = 9; // pixels: radius of the circle at the end of a pin whose other end is still to be placed
const BENT_RADIUS = 18;   // pixels: of the ring around a bent feature in the target
const CROSSHAIR_ARM = 9;  // pixels, in the loupe
export const LOUPE_SIDE = 150;    // pixels
export const LOUPE_ZOOM = 4;      // relative to the pane

export class Lines {
  #paths;
  #glass;

  /**
   * @param {HTMLElement} element
   * @param {Side} side
   */
  constructor(element, side) {
    const svg = element.appendChild(document.createElementNS(SVG, 'svg'));
    svg.setAttribute('aria-hidden', 'true');
    const middle = LOUPE_SIDE / 2, start = middle - CROSSHAIR_ARM, length = 2 * CROSSHAIR_ARM;
    svg.innerHTML = `<g id="lines-${side}"></g><svg class="loupe" width="${LOUPE_SIDE}" height="${LOUPE_SIDE}">
      <use href="#lines-${side}"></use><rect width="100%" height="100%"></rect>
      <path d="M${start} ${middle}h${length}m${-CROSSHAIR_ARM} ${-CROSSHAIR_ARM}v${length}"></path></svg>`;
    this.#paths = /** @type {SVGGElement} */ (svg.firstElementChild);
    this.#glass = /** @type {SVGSVGElement} */ (svg.lastElementChild);
  }

  /** @param {Pane} pane */
  draw(pane) {
    const lines = linesOf(pane), paths = this.#paths;
    while (paths.childElementCount > lines.length) paths.lastElementChild?.remove();
    while (paths.childElementCount < lines.length) paths.append(document.createElementNS(SVG, 'path'));
    lines.forEach((line, k) => {
      const element = /** @type {SVGPathElement} */ (paths.children[k]);
      element.setAttribute('d', line.d);
      element.setAttribute('class', line.class);
      element.style.setProperty('--hue', String(line.hue ?? 0));
    });
    this.#drawLoupe(pane);
  }

  /** @param {Pane} pane */
  #drawLoupe(pane) {
    this.#glass.style.display = pane.loupe ? '' : 'none';
    if (!pane.loupe) return;
    const [x, y] = pane.loupe.map((value) => LOUPE_SIDE / 2 - LOUPE_ZOOM * value);
    this.#glass.firstElementChild?.setAttribute('transform', `translate(${x} ${y}) scale(${LOUPE_ZOOM})`);
    const [left, top] = pane.loupeCorner();
    this.#glass.setAttribute('x', String(left));
    this.#glass.setAttribute('y', String(top));
  }
}

/**
 * @param {Pane} pane
 * @returns {Line[]}
 */
function linesOf(pane) {
  const {scene, side, rings, shape} = pane;
  /**
   * @param {Point[]} points
   * @param {boolean} [closed]
   */
  const path = (points, closed) => pathData(points.map((p) => pane.pixel(p)), closed);
  /** @type {Line[]} */
  const lines = [];
  if (rings.length > 1 && shape.painted) lines.push({d: path(shape.outline, true), class: 'frame'});
  lines.push({d: rings.map((ring) => path(ring, true)).join(''), class: 'outline'});
  for (const region of scene.regions) lines.push({d: path(region[side], true), class: 'region'});
  if (side === 'source') {
    for (const region of scene.unmapped) {
      lines.push({d: path(region.map((place) => pane.page(place)), true), class: `region${scene.failed ? ' wrong' : ''}`});
    }
  }
  scene.strokes.forEach((stroke, k) => {
    const wrong = scene.wrong.strokes?.includes(k) ? ' wrong' : '';
    lines.push({d: path(stroke[side].map((place) => pane.page(place))), class: `stroke${wrong}`, hue: strokeHue(k)});
  });
  for (const feature of scene.bent) {
    const radius = side === 'source' ? feature.radius / pane.units.scale * pane.view.zoom : BENT_RADIUS;
    lines.push({d: circle(pane.pixel(pane.page(feature[side])), radius), class: 'bent'});
  }
  for (const pin of pane.rotatable) {
    const arm = [pane.pixel(pane.page(pin.target)), pane.armEnd(pin)];
    lines.push({d: pathData(arm), class: pin.turn === null ? 'arm free' : 'arm'});
  }
  scene.pins.forEach((pin, k) => {
    const wanted = scene.wanted(pin)?.[side];
    if (wanted && String(wanted) !== String(pin[side])) {
      const [from, to] = [pin[side], wanted].map((place) => pane.pixel(pane.page(place)));
      lines.push({d: pathData([from, to]) + circle(to, WANTED_RADIUS), class: 'short-of', hue: pinHue(k)});
    }
    const ring = pane.ring(k);
    if (!ring) return;
    const {middle, radius} = ring, active = k === scene.active ? ' active' : '';
    lines.push({
      d: circle(middle, radius), class: `ring${active}`, hue: pinHue(k),
    });
  });
  if (pane.drawing) lines.push({d: path(pane.drawing), class: 'stroke drawing'});
  if (pane.guide) lines.push({d: cross(pane.pixel(pane.guide), GUIDE_ARM), class: 'guide'});
  if (pane.cross) lines.push({d: cross(pane.pixel(pane.cross), POINTER_ARM), class: 'pointer'});
  if (scene.pending?.side === side) {
    lines.push({d: circle(pane.pixel(pane.page(scene.pending.place)), PENDING_RADIUS), class: 'pending', hue: pinHue(scene.pins.length)});
  }
  if (pane.marquee) {
    const [[left, top], [right, bottom]] = pane.marquee;
    lines.push({d: pathData([[left, top], [right, top], [right, bottom], [left, bottom]], true), class: 'marquee'});
  }
  return lines;
}

/**
 * @param {Point} middle
 * @param {number} arm
 */
const cross = ([x, y], arm) => `M${x - arm} ${y}h${2 * arm}M${x} ${y - arm}v${2 * arm}`;

/**
 * @param {Point} middle
 * @param {number} radius
 */
function circle([x, y], radius) {
  const half = `a${radius} ${radius} 0 0 1`;
  return `M${x - radius} ${y}${half} ${2 * radius} 0${half} ${-2 * radius} 0`;
}

/**
 * @param {Point[]} pixels
 * @param {boolean} [closed]
 */
function pathData(pixels, closed = false) {
  const written = pixels.map((pixel) => pixel.map((value) => value.toFixed(1)).join(' '));
  return `M${written.join('L')}${closed ? 'Z' : ''}`;
}
