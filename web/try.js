// The demo on the site: a picture, two shapes, and the map between them, all computed in the browser.

import astronaut from '../docs/files/astronaut.jpg';
import cat from '../docs/files/cat.jpg';
import coffee from '../docs/files/coffee.jpg';
import arc from '../docs/files/arc.svg';
import block from '../docs/files/block.svg';
import hand from '../docs/files/hand.svg';
import heart from '../docs/files/heart.svg';
import shield from '../docs/files/shield.svg';
import worm from '../docs/files/worm.svg';
import gingerbread from '../samples/limbs/gingerbread.svg';
import starfish from '../samples/limbs/starfish.svg';
import whale from '../samples/raster/whale.svg';
import leaf from '../samples/rose-leaf/leaf.svg';
import {button, byId, followPointer, input, select} from '../io/edit/page/dom.js';
import {Canvas} from './canvas.js';
import {boxOf, isCrossing, moments} from './curve.js';
import {brush, subdivided} from './deformation.js';
import markup from './try.html';
import style from './try.css';
import {Solver} from './solver.js';
import {drawingOf, shapeOf} from './svg.js';

/** @import {Answer, Picture, Shape} from './types.d.ts' */

/** @type {Record<string, string>} */
const PICTURES = {'coffee.jpg': coffee, 'astronaut.jpg': astronaut, 'cat.jpg': cat};
/** @type {Record<string, string>} */
const SHAPES = {
  'heart.svg': heart, 'shield.svg': shield, 'leaf.svg': leaf, 'whale.svg': whale, 'starfish.svg': starfish, 'gingerbread.svg': gingerbread,
  'hand.svg': hand, 'worm.svg': worm, 'arc.svg': arc, 'block.svg': block,
};
const WHOLE = 'the whole picture', OWN_PICTURE = 'your picture …', OWN_SHAPE = 'your SVG …', DRAWN = 'draw one';
const DRAWN_NAME = 'drawn.svg', DRAGGED_NAME = 'target.svg';
const PICTURE_SIDE = 1024;      // pixels of the longer side of the PNG, as the command writes by default
const MOST_TEXTURE_SIDE = 2048; // pixels of a picture; larger ones are reduced
const BRUSH_SHARE = 0.3;        // radius of a drag, relative to the diagonal of the shape
const DRAGGED_EDGE_SHARE = 0.01;  // edges of a dragged outline, relative to its diagonal
const DRAWN_EDGE = 3;           // pixels between the points of a drawn line
const LEAST_DRAWN_SHARE = 0.01; // area of a drawn shape, relative to its pane

class Demo {
  /** @type {Picture} */
  picture;
  /** @type {Shape} */
  source;
  /** @type {Shape} */
  target;
  /** Answers are counted for tests, and the last one is kept. @type {{stages: Record<string, number>, last: Answer | null}} */
  log = {stages: {}, last: null};
  /** The movement of a drag that the worker has not been sent. @type {{centre: number[], by: number[], radius: number} | null} */
  #pending = null;
  /** The outline before the movement that the worker is following. @type {Shape | null} */
  #before = null;
  #dragging = false;
  #balanceChanged = false;
  /** Whether the target was dragged since the last search. */
  #dragged = false;

  /** @param {Picture} picture */
  constructor(picture) {
    this.solver = new Solver((answer) => this.#answered(answer));
    this.left = new Canvas(byId('try-source'), false);
    this.right = new Canvas(byId('try-target'), true);
    this.picture = picture;
    this.source = pictureShape(picture);
    this.target = shapeOf(SHAPES['heart.svg'], 'heart.svg');
    fill('try-picture', [...Object.keys(PICTURES), OWN_PICTURE]);
    fill('try-from', [WHOLE, ...Object.keys(SHAPES), OWN_SHAPE]);
    fill('try-into', [...Object.keys(SHAPES), OWN_SHAPE, DRAWN]);
    this.#listen();
  }

  async start() {
    await this.solver.start();
    this.#showSource();
    this.right.show(this.target);
    this.solve();
  }

  #listen() {
    choose('try-picture', OWN_PICTURE, async (file, name) => {
      this.picture = await pictureOf(file ?? PICTURES[name], name);
      if (select('try-from').value === WHOLE) this.source = pictureShape(this.picture);
      this.#showSource();
      this.solve();
    });
    choose('try-from', OWN_SHAPE, async (file, name) => {
      this.source = name === WHOLE ? pictureShape(this.picture) : shapeOf(file ? await file.text() : SHAPES[name], name);
      this.#showSource();
      this.solve();
    });
    choose('try-into', OWN_SHAPE, async (file, name) => {
      byId('try-target').classList.toggle('try-drawing', name === DRAWN);
      byId('try-hint').textContent = name === DRAWN ? 'target: draw a closed line' : 'target: drag its outline';
      if (name === DRAWN) return;
      this.#retarget(shapeOf(file ? await file.text() : SHAPES[name], name));
    });
    input('try-balance').addEventListener('input', () => {
      this.#balanceChanged = true;
      this.#next();
    });
    for (const name of /** @type {const} */ (['grid', 'stretch'])) {
      input(`try-${name}`).addEventListener('change', (event) => {
        for (const canvas of [this.left, this.right]) canvas.overlay[name] = /** @type {HTMLInputElement} */ (event.target).checked;
        this.left.paint();
        this.right.paint();
      });
    }
    button('try-save-picture').addEventListener('click', () => save(this.right.picture(PICTURE_SIDE), this.#resultName()));
    button('try-save-shape').addEventListener('click', () => {
      const address = URL.createObjectURL(new Blob([this.drawing()], {type: 'image/svg+xml'}));
      save(address, this.target.name);
      URL.revokeObjectURL(address);
    });
    byId('try-target').addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      if (select('try-into').value === DRAWN && byId('try-target').classList.contains('try-drawing')) this.#draw(event);
      else if (event.target instanceof Element && event.target.matches('.try-grip')) this.#drag(event);
    });
  }

  #showSource() {
    this.left.show(this.source);
    this.left.texture(this.picture.image, this.source.box);
    this.right.texture(this.picture.image, this.source.box);
  }

  /** @param {Shape} shape */
  #retarget(shape) {
    this.target = shape;
    this.right.show(shape);
    this.solve();
  }

  get balance() {
    return Number(input('try-balance').value);
  }

  /** Search for the map of the present shapes. */
  solve() {
    this.#pending = null;
    this.#before = null;
    this.#balanceChanged = false;
    report('Searching …');
    byId('try-command').textContent = this.#command();
    this.solver.send({kind: 'solve', source: this.source.outline, target: this.target.outline, balance: this.balance});
  }

  /** Send what has changed since the last request, if the solver is idle. */
  #next() {
    byId('try-command').textContent = this.#command();
    if (this.solver.busy) return;
    if (this.#pending) {
      const {centre, by, radius} = this.#pending, outline = brush(this.target.outline, centre, by, radius);
      this.#pending = null;
      if (isCrossing(outline)) return;
      this.#before = this.target;
      this.target = {...this.target, outline, name: DRAGGED_NAME};
      this.#dragged = true;
      this.right.reshape(this.target);
      this.solver.send({kind: 'drag', centre, by, radius});
    } else if (this.#balanceChanged) {
      this.#balanceChanged = false;
      this.solver.send({kind: 'balance', balance: this.balance});
    } else if (this.#dragged && !this.#dragging) {
      this.#dragged = false;
      this.solve();
    }
  }

  /** @param {Answer} answer */
  #answered(answer) {
    this.log.stages[answer.stage] = (this.log.stages[answer.stage] ?? 0) + 1;
    if (answer.stage === 'done') {
      this.#before = null;
      this.#next();
      return;
    }
    this.log.last = answer;
    if (answer.stage === 'error') {
      if (this.#before) {  // the map could not follow the drag: back to the last outline
        this.target = this.#before;
        this.#before = null;
        this.#dragged = true;
        this.right.reshape(this.target);
        this.#next();
      } else {
        report(answer.message, true);
        button('try-save-picture').disabled = true;
      }
      return;
    }
    const [source, target] = [this.source, this.target].map(({outline}) => Math.abs(moments(outline).area));
    this.right.map(answer.floats, Math.sqrt(source / target));
    const {energy, within2, folds} = answer.figures, seconds = (answer.milliseconds / 1000).toFixed(1);
    const share = `scale within 2× on ${Math.floor(100 * within2)} %`;
    const whole = `${share} · ${folds ? `${folds} folds` : 'no folds'} · energy ${energy.toFixed(3)} · ${seconds} s`;
    report(answer.stage === 'full' ? whole : answer.stage === 'dragged' ? share : `${share} · refining …`);
    button('try-save-picture').disabled = answer.stage !== 'full';
  }

  /**
   * Drag the outline with the pointer.
   * @param {PointerEvent} event
   */
  #drag(event) {
    const [left, bottom, right, top] = boxOf(this.target.outline), diagonal = Math.hypot(right - left, top - bottom);
    const radius = BRUSH_SHARE * diagonal, before = this.target.outline;
    if (this.log.last?.stage === 'error' || !this.log.last) return;
    this.target = {...this.target, outline: subdivided(before, DRAGGED_EDGE_SHARE * diagonal)};
    this.#dragging = true;
    let at = this.right.at(event);
    followPointer(byId('try-target'), event, (moved) => {
      const to = this.right.at(moved), step = [to[0] - at[0], to[1] - at[1]];
      const {centre, by} = this.#pending ?? {centre: at, by: [0, 0]};
      this.#pending = {centre, by: [by[0] + step[0], by[1] + step[1]], radius};
      at = to;
      this.#next();
    }, () => {
      this.#dragging = false;
      this.#next();
    });
  }

  /**
   * Draw a shape with the pointer.
   * @param {PointerEvent} event
   */
  #draw(event) {
    const line = [...this.right.at(event)], {view} = this.right;
    followPointer(byId('try-target'), event, (moved) => {
      const [x, y] = this.right.at(moved), end = line.length - 2;
      if (Math.hypot(x - line[end], y - line[end + 1]) * view.zoom < DRAWN_EDGE) return;
      line.push(x, y);
      this.right.line(Float64Array.from(line));
    }, () => {
      const outline = Float64Array.from(line), pane = view.width * view.height / view.zoom ** 2;
      if (outline.length < 6 || Math.abs(moments(outline).area) < LEAST_DRAWN_SHARE * pane || isCrossing(outline)) {
        report('Draw one closed line that does not cross itself and encloses some area.', true);
        this.right.paint();
        return;
      }
      byId('try-target').classList.remove('try-drawing');
      byId('try-hint').textContent = 'target: drag its outline';
      this.#retarget({name: DRAWN_NAME, outline, box: boxOf(outline)});
    });
  }

  /** Return a drawing of the target, for the command. */
  drawing() {
    return drawingOf(this.target);
  }

  #resultName() {
    const stem = (/** @type {string} */ name) => name.replace(/\.\w+$/, '');
    return `${stem(this.picture.name)}-${stem(this.target.name)}.png`;
  }

  /** Return the command that computes the same map from the same files. */
  #command() {
    const isWhole = this.source.name === this.picture.name, texture = isWhole ? [] : ['--texture', this.picture.name];
    const balance = this.balance === 1 ? [] : ['--balance', String(this.balance)];
    const words = ['iccm', 'map', this.source.name, this.target.name, ...texture, '--parts', 'largest', '--fit', 'whole', ...balance];
    return [...words, '-o', this.#resultName()].map((word) => (/^[\w./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`)).join(' ');
  }
}

/**
 * Show a message.
 * @param {string} text
 * @param {boolean} [wrong]
 */
function report(text, wrong = false) {
  const status = byId('try-status');
  status.textContent = text;
  status.classList.toggle('try-wrong', wrong);
}

/**
 * Fill a menu.
 * @param {string} id
 * @param {string[]} names
 */
function fill(id, names) {
  select(id).append(...names.map((name) => new Option(name.replace(/\.(svg|jpg)$/, ''), name)));
}

/**
 * Call a function with the choices in a menu; one of them opens a file.
 * @param {string} id
 * @param {string} own the choice that opens a file
 * @param {(file: File | null, name: string) => Promise<void>} chosen
 */
function choose(id, own, chosen) {
  const menu = select(id), files = input(`${id}-file`);
  const call = async (/** @type {File | null} */ file, /** @type {string} */ name) => {
    try {
      await chosen(file, name);
    } catch (error) {
      report(error instanceof Error ? error.message : String(error), true);
    }
  };
  menu.addEventListener('change', () => {
    if (menu.value === own) files.click();
    else call(null, menu.value);
  });
  files.addEventListener('change', () => {
    const file = files.files?.[0];
    files.value = '';  // so that the same file can be chosen again
    if (file) call(file, file.name);
  });
}

/**
 * Return a picture, reduced if it is large.
 * @param {Blob | string} data a file or an address
 * @param {string} name
 * @returns {Promise<Picture>}
 */
async function pictureOf(data, name) {
  const image = new Image(), address = typeof data === 'string' ? data : URL.createObjectURL(data);
  image.src = address;
  try {
    await image.decode();
  } catch {
    throw new Error(`${name}: the browser cannot read this picture`);
  }
  const share = Math.min(1, MOST_TEXTURE_SIDE / Math.max(image.naturalWidth, image.naturalHeight));
  const size = {resizeWidth: Math.round(share * image.naturalWidth), resizeHeight: Math.round(share * image.naturalHeight)};
  const bitmap = await createImageBitmap(image, share < 1 ? {...size, resizeQuality: 'high'} : {});
  if (typeof data !== 'string') URL.revokeObjectURL(address);
  return {name, image: bitmap};
}

/**
 * Return the rectangle of a picture.
 * @param {Picture} picture
 * @returns {Shape}
 */
function pictureShape({name, image: {width, height}}) {
  return {name, outline: Float64Array.of(0, 0, width, 0, width, height, 0, height), box: [0, 0, width, height]};
}

/**
 * @param {string} address
 * @param {string} name
 */
function save(address, name) {
  const link = document.createElement('a');
  link.href = address;
  link.download = name;
  link.click();
}

async function main() {
  byId('try').innerHTML = `<style>${style}</style>${markup}`;
  try {
    const demo = new Demo(await pictureOf(coffee, 'coffee.jpg'));
    Object.assign(globalThis, {iccmDemo: demo});
    await demo.start();
  } catch (error) {
    report(`The demo cannot run in this browser: ${error instanceof Error ? error.message : error}`, true);
  }
}

main();
