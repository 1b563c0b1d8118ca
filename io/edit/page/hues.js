// Colours of pins and strokes, the same on both sides and in the list.

const FIRST_HUE = 330;           // degrees: a red that stands out on most textures
// degrees: neighbours in the list differ strongly, and no two of the first dozen are close
const GOLDEN_ANGLE = 137.508;
const STROKES = 0.5;             // of this angle: offset of strokes from pins with the same number

/** @param {number} number of the pin */
export const pinHue = (number) => Math.round((FIRST_HUE + GOLDEN_ANGLE * number) % 360);

/** @param {number} number of the stroke */
export const strokeHue = (number) => pinHue(number + STROKES);
