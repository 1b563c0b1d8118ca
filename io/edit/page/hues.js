// The colours of pins and strokes, which both sides and the list share.

const FIRST_HUE = 330;           // degrees: a red that stands out on most textures
const GOLDEN_ANGLE = 137.508;    // degrees: neighbours in the list differ much, and no two of the first dozen are close
const STROKES = 0.5;             // of this angle, by which strokes differ from the pins of the same numbers

/** @param {number} number of the pin */
export const pinHue = (number) => Math.round((FIRST_HUE + GOLDEN_ANGLE * number) % 360);

/** @param {number} number of the stroke */
export const strokeHue = (number) => pinHue(number + STROKES);
