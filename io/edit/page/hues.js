// The colours of pins and strokes, which both sides and the list share: those of pins are warm, those of strokes are cold.

const GOLDEN_RATIO = 0.618034;  // of the range: neighbours in the list differ much, and no two of the first few are close
const PIN_HUES = {first: 280, range: 125}, STROKE_HUES = {first: 85, range: 170};  // degrees: violet to orange, green to blue

/**
 * @param {{first: number, range: number}} hues
 * @param {number} number
 */
const hueOf = ({first, range}, number) => Math.round((first + range * ((0.3 + GOLDEN_RATIO * number) % 1)) % 360);

/** @param {number} number of the pin */
export const pinHue = (number) => hueOf(PIN_HUES, number);

/** @param {number} number of the stroke */
export const strokeHue = (number) => hueOf(STROKE_HUES, number);
