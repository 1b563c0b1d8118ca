/* global STYLE -- a constant of bundle.js */
// The demo: a picture, two shapes, and the map between them, all computed in the browser.

import astronaut from '../docs/files/astronaut.jpg';
import cat from '../docs/files/cat.jpg';
import coffee from '../docs/files/coffee.jpg';
import arc from '../docs/files/arc.svg';
import block from '../docs/files/block.svg';
import hand from '../docs/files/hand.svg';
import heart from '../docs/files/heart.svg';
import shield from '../docs/files/shield.svg';
import worm from '../docs/files/worm.svg';
import still from '../docs/pictures/gallery-coffee-hand.png';
import gingerbread from '../samples/limbs/gingerbread.svg';
import starfish from '../samples/limbs/starfish.svg';
import whale from '../samples/raster/whale.svg';
import leaf from '../samples/rose-leaf/leaf.svg';
import {button, byId, followPointer, input, select, SVG} from '../io/edit/page/dom.js';
import {Preview} from '../io/edit/page/preview.js';
import {AGREED_DIAGONAL_SHARE} from './constants.js';
import {boxOf, isCrossing, moments} from './curve.js';
import {brush, subdivided} from './deformation.js';
import {displacement, Offer} from './offer.js';
import {DemoPane, pointsOf} from './panes.js';
import {optionsOf, Pinning} from './pinning.js';
import {saved} from './saving.js';
import {Solver} from './solver.js';
import {Steps} from './steps.js';
import {shapeOf} from './svg.js';
import markup from './try.html';

/** @import {Movement} from '../io/edit/page/preview.js' */
/** @import {Change} from './pinning.js' */
/** @import {Answer, Picture, Shape, Shown, WholeMap} from './types.d.ts' */

/** @type {Record<string, string>} */
const PICTURES = {'coffee.jpg': coffee, 'astronaut.jpg': astronaut, 'cat.jpg': cat};
/** @type {Record<string, string>} */
const SHAPES = {
  'heart.svg': heart, 'shield.svg': shield, 'leaf.svg': leaf, 'whale.svg': whale, 'starfish.svg': starfish, 'gingerbread.svg': gingerbread,
  'hand.svg': hand, 'worm.svg': worm, 'arc.svg': arc, 'block.svg': block,
};
const WHOLE = 'the whole picture', OWN_PICTURE = 'your picture …', OWN_SHAPE = 'your SVG …', DRAWN = 'draw one';
const DRAWN_NAME = 'drawn.svg', DRAGGED_NAME = 'target.svg';
const HINT = 'Click a shape to place a pin, drag pins on both sides, or drag the outline of the target.';
const DRAW_HINT = 'Draw a closed line in the target.';
const PICTURE_SIDE = 1024;      // pixels of the longer side of the PNG, as the command writes by default
const MOST_TEXTURE_SIDE = 2048; // pixels of a picture; larger ones are reduced
const BRUSH_SHARE = 0.3;        // radius of a drag, relative to the diagonal of the shape
const DRAGGED_EDGE_SHARE = 0.01;  // edges of a dragged outline, relative to its diagonal
const MOST_FOLLOWED = 30;       // answers after a movement, until the map has come to rest
const BETTER_ENERGY_SHARE = 0.02;  // by which the energy of another map is lower, if it is offered
const VALUES = ['try-picture', 'try-from', 'try-into', 'try-balance'];  // controls that undo returns to
const DRAWN_EDGE = 3;           // pixels between the points of a drawn line
const LEAST_DRAWN_SHARE = 0.01; // area of a drawn shape, relative to its pane

export class Demo {
  /** @type {Picture} */
  picture;
  /** @type {Shape} */
  source;
  /** @type {Shape} */
  target;
  /** Answers are counted for tests, and the last one is kept. @type {{stages: Record<string, number>, last: Answer | null}} */
  log = {stages: {}, last: null};
  /** The present map, once it has come to rest; null while it changes. @type {WholeMap | null} */
  map = null;
  /** What is seen. @type {Shown | null} */
  shown = null;
  steps = new Steps();
  /** The movement of a drag that the worker has not been sent. @type {{centre: number[], by: number[], radius: number} | null} */
  #pending = null;
  /** The outline and the places of the pins before the movement that the worker is following. @type {{target: Shape, places: number[][]} | null} */
  #before = null;
  /** Whether the outline, a pin or the slider is being dragged. */
  #isHeld = false;
  /** Whether pins or balance have changed since the worker was told. */
  #isChanged = false;
  /** Whether the map has changed since the last one that is complete. */
  #isStale = false;
  /** Whether the last change has no place at which the picture was let go, so that the map may converge. */
  #isLoose = false;
  /** The number of the request that contains the last movement. */
  #lastMoved = 0;
  /** What was seen when the hand released, or once the map had reached all pins there. @type {Float32Array | null} */
  #released = null;
  /** Whether the map is to return to what is seen, because it would leave what was released. */
  #isLeaving = false;
  /** How often the worker has followed since the last movement. */
  #followed = 0;
  /** Whether the map has not been compared with one from scratch. */
  #isUnchecked = false;
  #isComparing = false;
  /** Whether the command finds the present map from scratch. */
  #isFound = false;

  /** @param {Picture} picture */
  constructor(picture) {
    this.solver = new Solver((answer) => this.#answered(answer));
    this.picture = picture;
    this.source = pictureShape(picture);
    this.target = shapeOf(SHAPES['heart.svg'], 'heart.svg');
    this.pinning = new Pinning({
      shapes: () => ({source: this.source, target: this.target}), refuse: (text) => report(text, true),
      changed: (change) => this.#changedPins(change),
      moved: (movement) => this.#preview({...movement, seq: this.solver.next}),
    });
    this.left = new DemoPane('source', byId('try-source'), this.source, this.pinning.actions);
    this.right = new DemoPane('target', byId('try-target'), this.target, this.pinning.actions);
    for (const pane of this.panes) pane.scene = this.pinning.scene;
    this.preview = new Preview({source: this.left.shape, target: this.right.shape});
    this.grip = gripIn(byId('try-target'));
    this.offer = new Offer(this.right);
    fill('try-picture', [...Object.keys(PICTURES), OWN_PICTURE]);
    fill('try-from', [WHOLE, ...Object.keys(SHAPES), OWN_SHAPE]);
    fill('try-into', [...Object.keys(SHAPES), OWN_SHAPE, DRAWN]);
    this.#draws(false);
    this.#listen();
  }

  get panes() {
    return [this.left, this.right];
  }

  async start() {
    this.#showSource();
    this.#showTarget();
    await this.solver.start();
    this.#push();
    this.solve();
  }

  #listen() {
    choose('try-picture', OWN_PICTURE, async (file, name) => {
      this.picture = await pictureOf(file ?? PICTURES[name], name);
      if (select('try-from').value === WHOLE) this.source = pictureShape(this.picture);
      this.#replaced();
    });
    choose('try-from', OWN_SHAPE, async (file, name) => {
      this.source = name === WHOLE ? pictureShape(this.picture) : shapeOf(file ? await file.text() : SHAPES[name], name);
      this.#replaced();
    });
    choose('try-into', OWN_SHAPE, async (file, name) => {
      this.#draws(name === DRAWN);
      if (name === DRAWN) return;
      this.target = shapeOf(file ? await file.text() : SHAPES[name], name);
      this.#replaced();
    });
    for (const kind of /** @type {const} */ (['input', 'change'])) {
      input('try-balance').addEventListener(kind, () => {
        this.#isHeld = kind === 'input';
        this.#isLoose = true;
        this.#isChanged ||= this.#isHeld;
        if (!this.#isHeld) this.#push();
        this.#next();
      });
    }
    button('try-undo').addEventListener('click', () => this.travel(-1));
    button('try-redo').addEventListener('click', () => this.travel(1));
    addEventListener('keydown', (event) => this.#key(event));
    for (const name of /** @type {const} */ (['grid', 'stretch'])) {
      input(`try-${name}`).addEventListener('change', (event) => {
        for (const pane of this.panes) {
          pane.overlay[name] = /** @type {HTMLInputElement} */ (event.target).checked;
          pane.redraw();
        }
      });
    }
    button('try-add-pin').addEventListener('click', () => this.pinning.add());
    button('try-clear-pins').addEventListener('click', () => {
      this.pinning.clear();
      this.pinning.changed('removed');
    });
    button('try-save').addEventListener('click', () => this.#save());
    select('try-format').addEventListener('change', () => this.#enableSave());
    byId('try-target').addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      const isDrawing = byId('try-target').classList.contains('try-drawing');
      if (!isDrawing && event.target !== this.grip) return;
      event.stopPropagation();  // the pane would place a pin
      if (isDrawing) this.#draw(event);
      else this.#drag(event);
    }, {capture: true});
    this.right.viewed = () => this.#redrawGrip();
    new ResizeObserver(() => this.#redrawGrip()).observe(byId('try-target'));
  }

  #showSource() {
    this.left.showShape(this.source);
    for (const pane of this.panes) pane.setTexture(this.picture.image, this.source.box);
  }

  #showTarget() {
    this.right.showShape(this.target);
    this.#redrawGrip();
  }

  #redrawGrip() {
    this.#outlinePath(pointsOf(this.target.outline));
  }

  /** @param {number[][]} points */
  #outlinePath(points) {
    const pixels = points.map((point) => this.right.pixel(point).map((value) => value.toFixed(1)).join(' '));
    this.grip.setAttribute('d', `M${pixels.join('L')}Z`);
  }

  #redrawPins() {
    button('try-clear-pins').disabled = !this.pinning.scene.pins.length;
    for (const pane of this.panes) pane.redraw(false);
  }

  /**
   * Map other shapes than those of the menus.
   * @param {Shape} source
   * @param {Shape} target
   * @param {Picture} [picture] by default the present one
   */
  replace(source, target, picture = this.picture) {
    this.picture = picture;
    this.source = source;
    this.target = target;
    this.#replaced();
  }

  /** Search for the map of other shapes, to which pins do not belong. */
  #replaced() {
    this.pinning.clear();
    this.pinning.floats = new Float32Array(0);
    this.#isHeld = false;
    this.shown = null;
    this.#push();
    this.#showSource();
    this.#showTarget();
    this.#redrawPins();
    this.solve();
  }

  /**
   * Show a movement of a pin before the worker has answered.
   * @param {Movement} movement
   */
  #preview(movement) {
    this.#lastMoved = movement.seq;
    const floats = this.preview.move(movement);
    if (!floats) return;
    this.right.hurry(true);
    this.right.setMap(floats, this.#mean);
  }

  /** Length in the source for a length of one in the target. */
  get #mean() {
    const [source, target] = [this.source, this.target].map(({outline}) => Math.abs(moments(outline).area));
    return Math.sqrt(source / target);
  }

  /** @param {Change} change */
  #changedPins(change) {
    this.#isHeld = change === 'dragged';
    const isSeen = change === 'placed' && this.map !== null;  // the pin is where the map takes it
    if (change === 'dropped') this.#release();
    this.#isChanged ||= change !== 'dropped' && !isSeen;
    this.#isLoose = change === 'removed';
    if (isSeen) this.#isUnchecked = true;
    if (!this.#isHeld) this.#push();
    this.#redrawPins();
    this.#next();
  }

  /** Keep what is seen from now on. */
  #release() {
    const {shown} = this, isThere = shown && shown.seq >= this.#lastMoved && !shown.figures.missed.length;
    this.#released = isThere ? shown.floats : null;
  }

  /**
   * Return whether a map that comes to rest is farther from what was released than anybody wants it to be.
   * @param {Shown} shown
   */
  #leaves({stage, seq, floats, figures}) {
    if (stage !== 'live' || this.#isLoose || seq < this.#lastMoved) return false;
    if (!this.#released && figures.missed.length) return false;  // it has not followed yet
    this.#released ??= floats;
    const [left, top, right, bottom] = boxOf(this.target.outline);
    return displacement(this.#released, floats) > AGREED_DIAGONAL_SHARE * Math.hypot(right - left, bottom - top);
  }

  /** Add the present state to those to which undo returns. */
  #push() {
    const values = Object.fromEntries(VALUES.map((id) => [id, input(id).value]));
    const {picture, source, target, shown} = this, pins = structuredClone(this.pinning.scene.pins);
    this.#isFound = false;
    this.steps.push({picture, source, target, values, pins, shown, isFound: false});
    this.#enableSteps();
  }

  #enableSteps() {
    button('try-undo').disabled = !this.steps.canUndo;
    button('try-redo').disabled = !this.steps.canRedo;
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const key = event.key.toLowerCase(), focused = document.activeElement;
    if (!(event.ctrlKey || event.metaKey) || (key !== 'z' && key !== 'y')) return;
    if (focused && focused !== document.body && !byId('try').contains(focused)) return;
    event.preventDefault();
    this.travel(key === 'y' || event.shiftKey ? 1 : -1);
  }

  /**
   * Undo or redo.
   * @param {number} by steps; back if negative
   */
  travel(by) {
    const step = this.steps.travel(by);
    if (!step) return;
    const {source, target, picture} = this, isSource = step.source === source && step.picture === picture;
    this.picture = step.picture;
    this.source = step.source;
    this.target = step.target;
    this.pinning.scene.pins = structuredClone(step.pins);
    for (const [id, value] of Object.entries(step.values)) input(id).value = value;
    this.#draws(false);
    this.#forget();
    if (!isSource) this.#showSource();
    if (step.target.box === target.box) this.#redrawTarget();
    else this.#showTarget();
    this.#enableSteps();
    if (!step.shown?.state) {
      this.shown = null;
      this.solve();
      return;
    }
    this.solver.resume(step.shown.state);
    this.map = step.shown.map ?? null;
    this.#isFound = step.isFound;
    this.#isStale = !this.map;
    this.#show(step.shown);
    this.#showLeft();
    this.#next();
  }

  /** Forget what the worker has not been sent, or is doing. */
  #forget() {
    this.#pending = null;
    this.#before = null;
    this.#isHeld = false;
    this.#isChanged = false;
    this.#isStale = false;
    this.#isLoose = false;
    this.#isUnchecked = false;
    this.#isComparing = false;
    this.#followed = 0;
    this.#isLeaving = false;
    this.#lastMoved = 0;
    this.preview.withdraw();
    this.offer.hide();
  }

  /** @param {boolean} on whether the user draws a target */
  #draws(on) {
    byId('try-target').classList.toggle('try-drawing', on);
    byId('try-hint').textContent = on ? DRAW_HINT : HINT;
  }

  get balance() {
    return Number(input('try-balance').value);
  }

  /**
   * What the user can change while the shapes stay.
   * @param {boolean} [wanted] whether pins that stopped short are where they were dragged to
   */
  wishes(wanted = false) {
    return {balance: this.balance, pins: this.pinning.numbers(wanted)};
  }

  /** Search for the map of the present shapes. */
  solve() {
    this.#forget();
    this.map = null;
    this.#isFound = true;
    this.#enableSave();
    report('Searching …');
    this.#showCommand();
    this.#showLeft();
    this.solver.send({kind: 'solve', source: this.source.outline, target: this.target.outline, quiet: false, ...this.wishes()});
  }

  /** Send what has changed since the last request, if the solver can take it. */
  #next() {
    this.#showCommand();
    if (!this.solver.isReady) return;
    if (this.#pending) {
      const {centre, by, radius} = this.#pending, move = (/** @type {Float64Array} */ points) => brush(points, centre, by, radius);
      const outline = move(this.target.outline);
      this.#pending = null;
      if (isCrossing(outline)) return;
      this.#before = {target: this.target, places: this.pinning.scene.pins.map((pin) => [...pin.target].map(Number))};
      this.target = {name: DRAGGED_NAME, outline, box: this.target.box};
      this.pinning.moveTargets(move);
      this.#redrawTarget();
      this.#followed = 0;
      this.solver.send({kind: 'drag', centre, by, radius, ...this.wishes()});
    } else if (this.#isChanged) {
      this.#followed = 0;
      this.solver.send({kind: 'follow', ...this.wishes()});
    } else if (this.solver.busy) {
      return;
    } else if (this.#isStale && !this.#isLoose && !this.shown?.isStill && this.#followed < MOST_FOLLOWED) {
      this.#followed++;
      this.solver.send({kind: 'follow', ...this.wishes()});
    } else if (this.#isStale && !this.#isHeld) {
      this.solver.send({kind: 'finish', settle: this.#isLoose, ...this.wishes()});
      this.#isStale = false;
      this.#isLoose = false;
      this.#isUnchecked = true;
      return;
    } else if (this.#isUnchecked && !this.#isHeld) {
      this.#isUnchecked = false;
      this.#isComparing = true;
      this.solver.send({kind: 'solve', source: this.source.outline, target: this.target.outline, quiet: true, ...this.wishes(true)});
      return;
    } else {
      return;
    }
    this.offer.hide();
    this.#isComparing = false;
    this.#isChanged = false;
    this.#isStale = true;
    this.#isFound = false;
    this.map = null;
    this.#enableSave();
  }

  #redrawTarget() {
    this.right.moveOutline(this.target);
    this.#redrawGrip();
  }

  /** @param {Answer} answer */
  #answered(answer) {
    this.log.stages[answer.stage] = (this.log.stages[answer.stage] ?? 0) + 1;
    if (answer.stage === 'done') {
      this.#before = null;
      if (this.#isLeaving && this.shown?.state && !this.#isHeld && !this.#isChanged) {
        this.solver.resume(this.shown.state);
        this.shown.isStill = true;
      }
      this.#isLeaving = false;
      this.#next();
    } else if (answer.stage === 'error') {
      this.#failed(answer);
    } else if (answer.stage === 'other') {
      if (this.#isComparing && this.map) this.#compare(/** @type {Shown} */ (answer));
      this.#isComparing = false;
    } else {
      const shown = /** @type {Shown} */ (answer);
      this.log.last = shown;
      const isLatest = !this.#isHeld && !this.#isChanged && !this.#pending;
      if (isLatest && this.shown && this.#leaves(shown)) {
        this.#isLeaving = true;
        return;
      }
      if (shown.map && isLatest) {
        this.map = shown.map;
        this.#stopShort(shown);
      }
      this.#show(shown);
      if (isLatest) this.steps.amend({shown, isFound: this.#isFound, pins: structuredClone(this.pinning.scene.pins)});
    }
  }

  /** @param {{message: string} & Answer} answer */
  #failed(answer) {
    if (this.#isComparing) {  // the map that is seen stays
      this.#isComparing = false;
      return;
    }
    this.log.last = answer;
    this.right.setMap(this.preview.withdraw(), this.#mean);
    if (!this.#before) {
      report(answer.message, true);
      return;
    }
    this.target = this.#before.target;  // the map could not follow the drag: back to the last outline
    this.pinning.scene.pins.forEach((pin, k) => {
      pin.target = this.#before?.places[k] ?? pin.target;
    });
    this.#before = null;
    this.#redrawTarget();
    this.#next();
  }

  /** @param {Shown} shown */
  #show(shown) {
    this.shown = shown;
    this.pinning.floats = shown.floats;
    this.right.hurry(shown.stage === 'live' && !shown.isStill);
    this.right.setMap(this.preview.take(shown.floats, shown.seq), this.#mean);
    const {energy, within2, folds, missed} = shown.figures, seconds = (shown.milliseconds / 1000).toFixed(1), short = this.pinning.short;
    this.pinning.scene.wrong = {pins: missed.filter((k) => !short.includes(k))};
    this.#redrawPins();
    const off = this.pinning.scene.wrong.pins ?? [], named = (/** @type {number[]} */ pins) => pins.map((k) => k + 1).join(', ');
    const share = `scale within 2× on ${Math.floor(100 * within2)} %`, pins = off.length ? ` · pins not met: ${named(off)}` : '';
    const stopped = short.length ? ` · the picture could not follow to where pin ${named(short)} was put, so it stays where the picture is` : '';
    const whole = `${share} · ${folds ? `${folds} folds` : 'no folds'}${pins}${stopped} · energy ${energy.toFixed(3)} · ${seconds} s`;
    report(shown.stage === 'full' ? whole : shown.stage === 'live' ? share + pins : `${share} · refining …`);
    this.#enableSave();
    this.#showCommand();
  }

  /**
   * Leave pins that the map has not reached where it takes them.
   * @param {Shown} shown
   */
  #stopShort({floats, figures}) {
    if (!this.#isFound) this.pinning.stopShort(floats, figures.missed);
  }

  /**
   * Compare what is seen with the map from scratch, and offer that one if it is better.
   * @param {Shown} other
   */
  #compare(other) {
    const {shown} = this;
    if (!shown) return;
    const [left, top, right, bottom] = boxOf(this.target.outline), away = displacement(shown.floats, other.floats) / Math.hypot(right - left, bottom - top);
    const {short} = this.pinning, gain = 1 - other.figures.energy / shown.figures.energy;
    if (away <= AGREED_DIAGONAL_SHARE && !short.length) {
      this.#isFound = true;
      this.steps.amend({isFound: true});
      this.#showCommand();
    } else if (!other.figures.missed.length && (short.length || gain > BETTER_ENERGY_SHARE)) {
      const text = short.length ? `Another picture reaches pin ${short.map((k) => k + 1).join(', ')}:` : `Another picture is distorted less (energy ${Math.round(100 * gain)} % lower):`;
      this.offer.show(text, shown.floats, other.floats, () => this.#take(other));
    }
  }

  /**
   * Replace what is seen by the map from scratch.
   * @param {Shown} other
   */
  #take(other) {
    this.pinning.reach();
    this.shown = {...other, stage: 'full'};
    this.map = other.map ?? null;
    this.#push();
    this.#isFound = true;
    this.steps.amend({isFound: true});
    if (other.state) this.solver.resume(other.state);
    this.log.last = this.shown;
    this.#show(this.shown);
  }

  /** Say what of the drawings the map leaves out. */
  #showLeft() {
    const notes = [this.source, this.target].flatMap(({name, left}) => {
      if (!left || !(left.holes || left.parts)) return [];
      const count = (/** @type {number} */ n, /** @type {string} */ word) => (n ? [`${n} ${word}${n > 1 ? 's' : ''}`] : []);
      return [`${name} has ${[...count(left.holes, 'hole'), ...count(left.parts, 'other part')].join(' and ')}`];
    });
    byId('try-left').hidden = !notes.length;
    byId('try-left').textContent = notes.length ? `${notes.join('; ')}. This page maps the largest outline alone, without holes. The command maps the whole drawings: ${this.#command(true)}` : '';
  }

  #enableSave() {
    const format = select('try-format').value, isDrawn = this.source.drawing !== undefined;
    button('try-save').disabled = format === 'target' ? false : format === 'json' ? !this.pinning.scene.pins.length : !this.map || (format === 'svg' && !isDrawn);
    button('try-save').title = format === 'svg' && !isDrawn ? 'A drawing needs a drawing as the source: choose one as From' : '';
  }

  /**
   * Drag the outline with the pointer.
   * @param {PointerEvent} event
   */
  #drag(event) {
    const [left, bottom, right, top] = boxOf(this.target.outline), diagonal = Math.hypot(right - left, top - bottom);
    const radius = BRUSH_SHARE * diagonal, before = this.target.outline;
    if (!this.shown) return;
    this.target = {...this.target, outline: subdivided(before, DRAGGED_EDGE_SHARE * diagonal)};
    let at = this.#at(event);
    followPointer(byId('try-target'), event, (moved) => {
      this.#isHeld = true;
      const to = this.#at(moved), step = [to[0] - at[0], to[1] - at[1]];
      const {centre, by} = this.#pending ?? {centre: at, by: [0, 0]};
      this.#pending = {centre, by: [by[0] + step[0], by[1] + step[1]], radius};
      this.#lastMoved = this.solver.next;
      at = to;
      this.#next();
    }, () => {
      if (!this.#isHeld) return;
      this.#isHeld = false;
      this.#isLoose = false;
      this.#release();
      this.#push();
      this.#next();
    });
  }

  /** @param {PointerEvent} event */
  #at(event) {
    return this.right.at(this.right.pixelOf(event));
  }

  /**
   * Draw a shape with the pointer.
   * @param {PointerEvent} event
   */
  #draw(event) {
    const line = [...this.#at(event)], {view} = this.right;
    followPointer(byId('try-target'), event, (moved) => {
      const [x, y] = this.#at(moved), end = line.length - 2;
      if (Math.hypot(x - line[end], y - line[end + 1]) * view.zoom < DRAWN_EDGE) return;
      line.push(x, y);
      this.#outlinePath(pointsOf(Float64Array.from(line)));
    }, () => {
      const outline = Float64Array.from(line), pane = view.width * view.height / view.zoom ** 2;
      if (outline.length < 6 || Math.abs(moments(outline).area) < LEAST_DRAWN_SHARE * pane || isCrossing(outline)) {
        report('Draw one closed line that does not cross itself and encloses some area.', true);
        this.#redrawGrip();
        return;
      }
      this.#draws(false);
      this.target = {name: DRAWN_NAME, outline, box: boxOf(outline)};
      this.#replaced();
    });
  }

  #showCommand() {
    const label = this.#isFound ? 'The same with the command:' : 'The same with the command, after the map (NPZ) was saved:';
    byId('try-same').textContent = label;
    byId('try-command').textContent = this.#isFound ? this.#command() : quoted(['iccm', 'apply', `${this.#stem}.npz`, this.picture.name, '-o', `${this.#stem}.png`]);
  }

  /** Name of the result, without suffix. */
  get #stem() {
    const stem = (/** @type {string} */ name) => name.replace(/\.\w+$/, '');
    return `${stem(this.picture.name)}-${stem(this.target.name)}`;
  }

  /**
   * Return the result as a file, and what the user should know about it.
   * @param {string} format
   */
  result(format) {
    const {source, target, map, balance, right} = this, [left, top, east, bottom] = target.box, zoom = PICTURE_SIDE / Math.max(east - left, bottom - top);
    const width = Math.round(zoom * (east - left)), height = Math.round(zoom * (bottom - top));
    return saved(format, {source, target, map, pins: this.pinning.scene.pins, balance, width, height, picture: () => right.picture(width, height)});
  }

  /** Save the result in the chosen form. */
  async #save() {
    const format = select('try-format').value;
    try {
      const {blob, note} = await this.result(format);
      save(blob, format === 'target' ? this.target.name : `${this.#stem}.${format}`);
      if (note) report(note);
    } catch (error) {
      report(error instanceof Error ? error.message : String(error), true);
    }
  }

  /**
   * Return the command that computes the same map from the same files, or the one that maps whole drawings.
   * @param {boolean} [whole]
   */
  #command(whole = false) {
    const isPicture = this.source.name === this.picture.name, texture = isPicture ? [] : ['--texture', this.picture.name];
    const balance = this.balance === 1 ? [] : ['--balance', String(this.balance)], how = whole ? [] : ['--parts', 'largest', '--fit', 'whole'];
    const words = ['iccm', 'map', this.source.name, this.target.name, ...texture, ...how, ...balance, ...optionsOf(this.pinning.scene.pins)];
    return quoted([...words, '-o', `${this.#stem}.png`]);
  }
}

/**
 * Return a command line.
 * @param {string[]} words
 */
const quoted = (words) => words.map((word) => (/^[\w./:,-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`)).join(' ');

/**
 * Add the path by which the outline of a pane is dragged, below the pins.
 * @param {HTMLElement} element
 */
function gripIn(element) {
  const svg = document.createElementNS(SVG, 'svg'), path = svg.appendChild(document.createElementNS(SVG, 'path'));
  svg.setAttribute('class', 'try-grips');
  svg.setAttribute('aria-hidden', 'true');
  element.querySelector('.handles')?.before(svg);
  return path;
}

/**
 * Show a message.
 * @param {string} text
 * @param {boolean} [wrong]
 */
export function report(text, wrong = false) {
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
export async function pictureOf(data, name) {
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
export function pictureShape({name, image: {width, height}}) {
  return {name, outline: Float64Array.of(0, 0, width, 0, width, height, 0, height), box: [0, 0, width, height]};
}

/**
 * @param {Blob} blob
 * @param {string} name
 */
function save(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

/**
 * Fill the element #try with the demo, and return it once it runs; null if the browser cannot run it.
 * @returns {Promise<Demo | null>}
 */
export async function begin() {
  if (!document.createElement('canvas').getContext('webgl2')) {
    byId('try').innerHTML = `<style>${STYLE}</style><img src="${still}" alt="A photo of a cup of coffee, mapped onto the outline of a hand">
      <p id="try-status" role="status">The demo needs WebGL 2, which this browser or its graphics card does not have. This is one of its pictures; the command needs no WebGL.</p>`;
    return null;
  }
  byId('try').innerHTML = `<style>${STYLE}</style>${markup}`;
  try {
    const demo = new Demo(await pictureOf(coffee, 'coffee.jpg'));
    Object.assign(globalThis, {iccmDemo: demo});
    await demo.start();
    return demo;
  } catch (error) {
    report(`The demo cannot run in this browser: ${error instanceof Error ? error.message : error}`, true);
    return null;
  }
}
