// What the user can do on the shapes and in the list of pins and strokes.

import {byId} from './dom.js';
import {finer, simplified} from './geometry.js';
import {STROKE_TOLERANCE} from './gestures.js';
import {isPossible, RANGES} from './pin_settings.js';

/** @import {Editor} from './editor.js' */
/** @import {Link} from './link.js' */
/** @import {Pane} from './pane.js' */
/** @import {Movement} from './preview.js' */
/** @import {Actions, Hello, Place, Side} from './types.d.ts' */

/** @type {Side[]} */
const SIDES = ['source', 'target'];
const AXES = ['x', 'y', 'z'];

/**
 * @param {object} parts
 * @param {Editor} parts.editor
 * @param {Link} parts.link
 * @param {Record<Side, Pane>} parts.panes
 * @param {Hello} parts.hello
 * @param {(text: string, bad?: boolean) => void} parts.report shows a message
 * @param {() => void} parts.putDown switches back from the stroke tool
 * @param {(movement: Movement) => void} parts.moved called when a single pin has been moved in the plane
 * @returns {Actions}
 */
export function actionsOf({editor, link, panes, hello, report, putDown, moved}) {
  /**
   * Remove a pin and, if it is selected, the other selected pins.
   * @param {number} number
   */
  function removePins(number) {
    const numbers = editor.movedWith(number);
    editor.scene.pins = editor.scene.pins.filter((_, k) => !numbers.includes(k));
  }

  /**
   * Add a pin and show its settings.
   * @param {Place} source
   * @param {Place} target
   */
  function addPin(source, target) {
    editor.scene.pins.push({name: '', weight: 1, source, target, turn: null});
    editor.active = editor.scene.pins.length - 1;
    editor.commit();
  }

  return {
    select: ({number}) => editor.toggleSelected(number),

    selectOnly(numbers) {
      editor.selected = new Set(numbers);
      editor.changed();
    },

    placeEnd(side, place) {
      const {pending} = editor;
      editor.pending = null;
      if (!pending || pending.side === side) {
        editor.pending = {side, place};
        report(`Click the same feature in the ${side === 'source' ? 'target' : 'source'}, or press Esc.`);
        editor.changed();
        return;
      }
      if (side === 'source') addPin(place, pending.place);
      else addPin(pending.place, place);
    },

    lock: ({number}) => editor.toggleLock(editor.scene.pins[number]),

    accept(...numbers) {
      editor.scene.pins.push(...editor.suggested.filter((_, k) => numbers.includes(k)));
      editor.suggested = editor.suggested.filter((_, k) => !numbers.includes(k));
      editor.commit();
    },

    async place(side, place) {
      const answer = await link.ask({type: 'place', side, points: [place]});
      if (answer.error || !answer.points) {
        report(answer.error ?? '', true);
        return;
      }
      const image = answer.points[0];
      const [source, target] = side === 'source' ? [place, image] : [image, place];
      addPin(source, target);
    },

    async stroke(side, places, closed) {
      putDown();
      if (closed && side === 'target') {
        report('Rigid regions are drawn in the source: close the stroke there.', true);
        return;
      }
      if (closed) {
        report('');
        editor.scene.rigid.push(places);
        editor.commit();
        return;
      }
      const other = side === 'source' ? panes.target : panes.source;
      const answer = await link.ask({type: 'place', side, points: finer(/** @type {number[][]} */ (places))});
      if (answer.error || !answer.points) {
        report(answer.error ?? '', true);
        return;
      }
      const image = simplified(answer.points.map((place) => other.page(place)), STROKE_TOLERANCE / other.view.zoom);
      /** @type {Place[]} */
      const images = image.map((point) => other.units.file(point));
      const [source, target] = side === 'source' ? [places, images] : [images, places];
      editor.scene.strokes.push({name: '', weight: 1, source, target, ends: 'free'});
      editor.commit();
    },

    drag(side, {kind, number, point}, place) {
      const {pins, strokes} = editor.scene, pane = panes[side];
      if (editor.isLocked(kind === 'strokes' ? strokes[number] : pins[number])) return false;
      if (kind === 'strokes') {
        strokes[number][side][point ?? 0] = place;
      } else if (pane.surface) {
        pins[number][side] = place;
      } else {
        const from = pane.page(pins[number][side]), to = pane.page(place), by = to.map((value, k) => value - from[k]);
        const source = panes.source.surface ? null : panes.source.page(pins[number].source), together = editor.movedWith(number);
        for (const k of together) pins[k][side] = k === number ? place : pane.moved(pins[k][side], by);
        editor.follow();
        if (source && together.length === 1) {
          const others = pins.filter((_, k) => k !== number).map((pin) => pane.page(pin[side]));
          moved({seq: editor.asked, side, source, by, others});
        }
        return true;
      }
      editor.follow();
      return true;
    },

    turn({number}, degrees) {
      const pin = editor.scene.pins[number];
      if (editor.isLocked(pin)) return;
      pin.turn = degrees;
      editor.follow();
    },

    hold({number}, settings, ended = true) {
      const pin = editor.scene.pins[number];
      if (!pin || editor.isLocked(pin)) return;
      Object.assign(pin, settings);
      if (ended) editor.commit();
      else editor.follow();
    },

    keep({number}, radius) {
      editor.keepRigid(editor.scene.pins[number], radius);
    },

    activate({kind, number}) {
      if (kind !== 'pins' || editor.active === number) return;
      editor.active = number;
      editor.changed();
    },

    drop: () => editor.drop(),

    remove({kind, number, point}, whole = false) {
      const {scene} = editor;
      if (kind === 'rigid') {
        scene.rigid.splice(number, 1);
      } else {
        const entry = kind === 'strokes' ? scene.strokes[number] : scene.pins[number];
        if (!entry) return;
        if (editor.isLocked(entry)) {
          report('This pin is locked: unlock it with L, or in the list, to move or remove it.', true);
          return;
        }
        if (kind === 'strokes') removeFromStroke(scene.strokes, number, whole ? null : point ?? null);
        else if (whole) scene.pins.splice(number, 1);
        else removePins(number);
      }
      editor.selected.clear();
      editor.active = null;
      const focused = document.activeElement, pane = focused?.closest('.pane') ?? byId('source');
      editor.commit();
      requestAnimationFrame(() => {
        if (!focused?.isConnected && pane instanceof HTMLElement) pane.focus();
      });
    },

    rename({kind, number}, name) {
      (kind === 'strokes' ? editor.scene.strokes : editor.scene.pins)[number].name = name;
      editor.commit(false);
    },

    move({number}, typed) {
      const pin = editor.scene.pins[number], split = pin.source.length, count = split + pin.target.length;
      if (editor.isLocked(pin)) {
        editor.changed();
        return;
      }
      if (typed.length !== count && !(hello.deforming && typed.length === count + 1)) {
        const axes = [pin.source, pin.target].map((place) => AXES.slice(0, place.length).join(', '));
        report(`Enter ${count} numbers: ${axes.join(' → ')}.`, true);
        return;
      }
      if (typed.length > count && !isPossible('turn', typed[count])) {
        report(`Rotation: enter ${RANGES.turn}.`, true);
        return;
      }
      pin.source = typed.slice(0, split);
      pin.target = typed.slice(split, count);
      pin.turn = typed[count] ?? null;
      editor.commit();
    },

    hover(item) {
      const key = item && `${item.kind === 'pins' ? 'pin' : 'stroke'} ${item.number} `;
      for (const element of document.querySelectorAll('.handle')) {
        const own = `${/** @type {HTMLElement} */ (element).dataset.key} `;
        element.classList.toggle('lit', key !== null && own.startsWith(key));
      }
    },
  };
}

/**
 * Remove a point of a stroke on both sides, or the whole stroke if only two points are left.
 * @param {import('./types.d.ts').Stroke[]} strokes
 * @param {number} number of the stroke
 * @param {number | null} point null for the whole stroke
 */
export function removeFromStroke(strokes, number, point) {
  const stroke = strokes[number];
  if (point === null || Math.min(stroke.source.length, stroke.target.length) <= 2) {
    strokes.splice(number, 1);
    return;
  }
  for (const side of SIDES) {
    if (stroke[side].length > point) stroke[side].splice(point, 1);
  }
}
