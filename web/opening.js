// A pin that moves by itself when the page opens, which shows what pins do before anything is read.

import {byId} from '../io/edit/page/dom.js';
import {boxOf} from './curve.js';

/** @import {Demo} from './demo.js' */

const LAP_SECONDS = 2.4;
const LAP_RADIUS_SHARE = 0.05;  // of the target's diagonal
const WAIT = 100;               // milliseconds between two looks whether the map is there
const TOUCHES = ['pointerdown', 'keydown', 'wheel'];

/**
 * Place a pin and move it once around a circle, back to its place; whatever the person does ends it.
 * @param {Demo} demo
 */
export async function showPin(demo) {
  if (matchMedia('(prefers-reduced-motion: reduce)').matches) return;
  let isTouched = false;
  const touched = () => { isTouched = true; };
  for (const kind of TOUCHES) addEventListener(kind, touched, {capture: true, once: true});
  await seen(byId('try'));
  while (!demo.map && !isTouched) await new Promise((resolve) => { setTimeout(resolve, WAIT); });
  if (isTouched || demo.pinning.scene.pins.length) return;
  demo.pinning.add();
  const [pin] = demo.pinning.scene.pins;
  if (!pin) return;
  const [x, y] = /** @type {number[]} */ (pin.target), [left, top, right, bottom] = boxOf(demo.target.outline);
  const radius = LAP_RADIUS_SHARE * Math.hypot(right - left, bottom - top);
  let begun = 0;
  for (let lap = 0; lap < 1 && !isTouched;) {
    const now = await new Promise((resolve) => { requestAnimationFrame(resolve); });
    begun ||= now;
    lap = Math.min((now - begun) / (1000 * LAP_SECONDS), 1);
    const angle = 2 * Math.PI * lap;
    if (demo.pinning.scene.pins[0] !== pin) return;  // another shape was chosen
    demo.pinning.drag('target', 0, lap < 1 ? [x + radius * Math.sin(angle), y + radius * (1 - Math.cos(angle))] : [x, y]);
  }
  if (isTouched) demo.pinning.changed('dropped');
  else demo.travel(0);  // the map as it was, which one that was dragged around does not quite return to
}

/**
 * Wait until most of an element is in sight.
 * @param {Element} element
 */
async function seen(element) {
  await new Promise((resolve) => {
    const observer = new IntersectionObserver(([entry]) => {
      if (!entry.isIntersecting) return;
      observer.disconnect();
      resolve(undefined);
    }, {threshold: 0.5});
    observer.observe(element);
  });
}
