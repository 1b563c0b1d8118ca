// Archives of NumPy arrays (.npz): files of NumPy's format 1.0 in a ZIP archive without compression.

/** An array, or text. @typedef {{type: 'complex128' | 'float64' | 'int32' | 'text', shape: number[], values: ArrayLike<number> | string}} Member */

const TYPES = {complex128: '<c16', float64: '<f8', int32: '<i4'};
const HEADER_UNIT = 64;  // bytes: headers end at multiples
const DATE = 33;         // 1980-01-01, the first that ZIP archives can have
const CRC_TABLE = Uint32Array.from({length: 256}, (_, byte) => {
  let value = byte;
  for (let bit = 0; bit < 8; bit++) value = value & 1 ? 0xedb88320 ^ (value >>> 1) : value >>> 1;
  return value;
});

/** @param {Uint8Array} bytes */
function checksum(bytes) {
  let value = 0xffffffff;
  for (const byte of bytes) value = CRC_TABLE[(value ^ byte) & 0xff] ^ (value >>> 8);
  return (value ^ 0xffffffff) >>> 0;
}

/**
 * Return little-endian numbers of some sizes.
 * @param {[number, number][]} numbers values and their bytes
 */
function packed(...numbers) {
  const bytes = [];
  for (const [value, size] of numbers) for (let k = 0; k < size; k++) bytes.push(Math.floor(value / 256 ** k) % 256);
  return Uint8Array.from(bytes);
}

/** @param {Uint8Array[]} parts */
function joined(parts) {
  const whole = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}

/** @param {Member} member */
function array({type, shape, values}) {
  const text = typeof values === 'string' ? [...values] : null;
  const data = text ? Uint32Array.from(text, (letter) => letter.codePointAt(0) ?? 0)
    : type === 'int32' ? Int32Array.from(/** @type {ArrayLike<number>} */ (values)) : Float64Array.from(/** @type {ArrayLike<number>} */ (values));
  const descr = text ? `<U${text.length}` : TYPES[/** @type {keyof typeof TYPES} */ (type)], sizes = shape.length === 1 ? `${shape[0]},` : shape.join(', ');
  const header = `{'descr': '${descr}', 'fortran_order': False, 'shape': (${sizes}), }`;
  const length = HEADER_UNIT * Math.ceil((10 + header.length + 1) / HEADER_UNIT) - 10;
  const encoder = new TextEncoder(), magic = joined([Uint8Array.of(0x93), encoder.encode('NUMPY'), Uint8Array.of(1, 0), packed([length, 2])]);
  return joined([magic, encoder.encode(`${header.padEnd(length - 1)}\n`), new Uint8Array(data.buffer)]);
}

/**
 * Return an archive.
 * @param {Record<string, Member>} members
 */
export function archived(members) {
  const parts = [], directory = [];
  let at = 0;
  for (const [key, member] of Object.entries(members)) {
    const name = new TextEncoder().encode(`${key}.npy`), data = array(member), size = data.length;
    /** @type {[number, number][]} */
    const common = [[20, 2], [0, 2], [0, 2], [0, 2], [DATE, 2], [checksum(data), 4], [size, 4], [size, 4], [name.length, 2], [0, 2]];
    const head = joined([packed([0x04034b50, 4], ...common), name]);
    directory.push(packed([0x02014b50, 4], [20, 2], ...common, [0, 2], [0, 2], [0, 2], [0, 4], [at, 4]), name);
    parts.push(head, data);
    at += head.length + size;
  }
  const index = joined(directory), count = Object.keys(members).length;
  return joined([...parts, index, packed([0x06054b50, 4], [0, 2], [0, 2], [count, 2], [count, 2], [index.length, 4], [at, 4], [0, 2])]);
}
