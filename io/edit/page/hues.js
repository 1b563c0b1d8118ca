// The colours of pins and strokes, which both sides and the list share.

const FIRST_HUE = 330;           // degrees: a red that stands out on most textures
const GOLDEN_ANGLE = 137.508;    // degrees: neighbours in the list differ much, and no two of the first dozen are close
const FIRST_STROKE = 3;          // hues that are passed over, so that stroke 1 and pin 1 differ

/** @param {number} number of the pin */
export const pinHue = (number) => Math.round((FIRST_HUE + GOLDEN_ANGLE * number) % 360);

/** @param {number} number of the stroke */
export const strokeHue = (number) => pinHue(number + FIRST_STROKE);
