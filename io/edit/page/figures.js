// The table of a map's figures.

/** @import {Figures} from './types.d.ts' */

const DIGITS = 3;
const WHOLE_FROM = 100;  // larger figures have no decimals

/**
 * Format a figure with three digits.
 * @param {number | null | undefined} value
 */
export function rounded(value) {
  if (value === null || value === undefined) return '–';
  return value >= WHOLE_FROM ? value.toFixed(0) : Number(value.toPrecision(DIGITS)).toString();
}

/** @param {number} share */
const percent = (share) => `${(100 * share).toFixed(1)} %`;

/** @param {number} angle */
const degrees = (angle) => `${(Math.round(10 * angle) / 10 || 0).toFixed(1)}°`;  // never -0.0

/** @param {number[]} values */
const together = (values) => values.map(rounded).join('   ');

/**
 * Return name, explanation and value of each row; the value is null if the figure is not known.
 * @param {Figures} figures
 * @returns {[string, string, string | null][]}
 */
export function figureRows(figures) {
  const {stretch, dilatation, scale, boundary, injective, turn} = figures;
  /** @type {[string, string, string | null][]} */
  const rows = [
    ['stretch', 'median, 95 %, largest', stretch ? together([stretch.p50, stretch.p95, stretch.max]) : null],
    ['dilatation', 'median, 95 %, largest', dilatation ? together([dilatation.median, dilatation.p95, dilatation.max]) : null],
    ['scale', 'within a factor of 2', scale ? percent(scale.within2) : null],
    ['rotation', 'counter-clockwise', turn === undefined ? null : degrees(turn)],
    ['outline', 'largest distance, relative to the diagonal', boundary ? boundary.hausdorff.toExponential(1) : null],
    ['one-to-one', 'certified share', injective ? certificate(injective) : null],
  ];
  if (figures.shown !== undefined && figures.covered !== undefined) {
    rows.push(['shown', 'of the source', percent(figures.shown)], ['covered', 'of the target', percent(figures.covered)]);
  } else if (figures.left_out !== undefined && figures.uncovered !== undefined) {
    rows.push(
      ['hidden', 'of the source', percent(figures.left_out)],
      ['bare', 'of the target', percent(figures.uncovered)],
    );
  }
  (figures.regions ?? []).forEach((region, k) => rows.push([
    `rigid ${k + 1}`, 'dilatation on 95 % of it, and its size relative to the mean scale',
    `${region.dilatation.toFixed(3)}   × ${rounded(region.scale)}`,
  ]));
  return rows;
}

/** @param {{certified: boolean, share: number}} injective */
const certificate = ({certified, share}) => (certified ? `${(100 * share).toFixed(2)} %` : 'not certified');

/**
 * Show the figures of a map; a coarse map is marked as such.
 * @param {HTMLTableElement} table
 * @param {string} kind
 * @param {Figures} figures
 */
export function showFigures(table, kind, figures) {
  const body = table.tBodies[0];
  body.replaceChildren(...figureRows(figures).map(([name, hint, value]) => {
    const row = document.createElement('tr'), head = document.createElement('th'), cell = document.createElement('td');
    const explanation = document.createElement('small');
    head.append(name, explanation);
    explanation.textContent = hint;
    head.scope = 'row';
    cell.textContent = value ?? '–';
    row.append(head, cell);
    return row;
  }));
  body.className = kind;
}
