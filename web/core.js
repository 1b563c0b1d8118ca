// The compiled core as a WebAssembly module. Functions and structs are declared by their C prototypes, as in iccm/native;
// a test compares the prototypes with those of Python.
//
// Arrays are copied into the module's memory for each call, and back unless the argument is const: Float64Array for
// double and Complex (pairs of doubles), Int32Array for int64_t, Uint8Array for bool.

/** @typedef {Float64Array | Int32Array | Uint8Array} Numbers */
/** @typedef {{kind: string, constant: boolean, pointer: boolean}} Parameter */
/** @typedef {{parameters: Parameter[], values: Value[]}} Struct */
/** @typedef {Numbers | Scratch | Struct | number | boolean | null} Value */
/** @typedef {{memory: WebAssembly.Memory, malloc: (size: number) => number, free: (at: number) => void, _initialize: () => void}} Runtime */

const PROTOTYPE = /^(int64_t|double) (\w+)\(([^)]*)\)$/;
const STRUCT = /^struct (\w+) \{ ?(.*?);? ?\}$/;
const PARAMETER = /^(const )?(\w+) (\*?)\w+$/;
const LEAST_BYTES = 16;  // of an allocation: empty arrays have an address, too
/** Sizes of types in bytes; pointers have 4. @type {Record<string, number>} */
const SIZES = {int64_t: 8, double: 8, bool: 1, Complex: 16, TotalCallback: 4, DerivativesCallback: 4};

/** Memory that a function of the core needs for a call, and that nobody reads afterwards. */
export class Scratch {
  /** @param {number} bytes */
  constructor(bytes) {
    this.bytes = bytes;
  }
}

/** @type {(Runtime & Record<string, Function>) | null} */
let core = null;

/**
 * Compile and start the module.
 * @param {BufferSource} bytes
 */
export async function load(bytes) {
  const {instance} = await WebAssembly.instantiate(bytes, {});
  core = /** @type {Runtime & Record<string, Function>} */ (/** @type {unknown} */ (instance.exports));
  core._initialize();
}

/**
 * @param {string} text
 * @returns {Parameter}
 */
function parameterOf(text) {
  const found = PARAMETER.exec(text.trim());
  if (!found) throw new Error(`not a parameter: ${text}`);
  return {kind: found[2], constant: Boolean(found[1]), pointer: found[3] === '*'};
}

/** @param {string} text */
const oneLine = (text) => text.trim().replace(/\s+/g, ' ').replace('( ', '(');

/**
 * Declare a struct; the result makes one from the values of its members.
 * @param {string} declaration
 * @returns {(...values: Value[]) => Struct}
 */
export function struct(declaration) {
  const found = STRUCT.exec(oneLine(declaration));
  if (!found) throw new Error(`not a struct: ${declaration}`);
  const parameters = found[2].split(';').map(parameterOf);
  return (...values) => {
    if (values.length !== parameters.length) throw new Error(`struct ${found[1]}: ${values.length} values`);
    return {parameters, values};
  };
}

/**
 * Declare a function of the core.
 * @param {string} prototype
 * @returns {(...values: Value[]) => number}
 */
export function declare(prototype) {
  const found = PROTOTYPE.exec(oneLine(prototype));
  if (!found) throw new Error(`not a prototype: ${prototype}`);
  const [, returned, name] = found, parameters = found[3].split(',').map(parameterOf);
  return (...values) => {
    if (!core) throw new Error('the core has not been loaded');
    if (values.length !== parameters.length) throw new Error(`${name}: ${values.length} arguments`);
    const call = new Call(core);
    try {
      const given = parameters.map((parameter, k) => call.argument(parameter, values[k]));
      const result = core[name](...given);
      call.copyBack();
      return returned === 'double' ? result : Number(result);
    } finally {
      call.free();
    }
  };
}

/** The memory of one call. */
class Call {
  /** @type {number[]} */
  #taken = [];
  /** @type {{at: number, numbers: Numbers}[]} arrays that the function may change */
  #written = [];
  #core;

  /** @param {Runtime} runtime */
  constructor(runtime) {
    this.#core = runtime;
  }

  /** @param {number} bytes */
  #allocate(bytes) {
    const at = this.#core.malloc(Math.max(bytes, LEAST_BYTES));
    if (!at) throw new Error('out of memory');
    this.#taken.push(at);
    return at;
  }

  /**
   * Return what WebAssembly takes for an argument.
   * @param {Parameter} parameter
   * @param {Value} value
   * @returns {number | bigint}
   */
  argument(parameter, value) {
    if (parameter.pointer) return this.#pointer(parameter, value);
    return parameter.kind === 'int64_t' ? BigInt(Number(value)) : Number(value);
  }

  /**
   * @param {Parameter} parameter
   * @param {Value} value
   */
  #pointer(parameter, value) {
    if (value === null) return 0;
    if (value instanceof Scratch) return this.#allocate(value.bytes);
    if (typeof value !== 'object') throw new Error('not an array');
    if ('parameters' in value) {
      const at = this.#allocate(layout(value)[0]);
      this.#write(value, at);
      return at;
    }
    const at = this.#allocate(value.length * (value instanceof Int32Array ? 8 : value.BYTES_PER_ELEMENT));
    const {buffer} = this.#core.memory;
    if (value instanceof Float64Array) {
      new Float64Array(buffer, at, value.length).set(value);
    } else if (value instanceof Uint8Array) {
      new Uint8Array(buffer, at, value.length).set(value);
    } else {  // the low and the high word of each number
      const words = new Int32Array(buffer, at, 2 * value.length);
      for (let k = 0; k < value.length; k++) {
        words[2 * k] = value[k];
        words[2 * k + 1] = value[k] >> 31;
      }
    }
    if (!parameter.constant) this.#written.push({at, numbers: value});
    return at;
  }

  /**
   * Write a struct to an address.
   * @param {Struct} record
   * @param {number} at
   */
  #write({parameters, values}, at) {
    let offset = at;
    parameters.forEach((parameter, k) => {
      const value = values[k], [size, align] = layoutOf(parameter, value);
      offset = Math.ceil(offset / align) * align;
      if (isStruct(value) && !parameter.pointer) {
        this.#write(value, offset);
      } else {
        const given = this.argument(parameter, value), view = new DataView(this.#core.memory.buffer);
        if (typeof given === 'bigint') view.setBigInt64(offset, given, true);
        else if (parameter.pointer || parameter.kind.endsWith('Callback')) view.setUint32(offset, given, true);
        else if (parameter.kind === 'bool') view.setUint8(offset, given);
        else view.setFloat64(offset, given, true);
      }
      offset += size;
    });
  }

  /** Copy the arrays that the function may have changed from its memory. */
  copyBack() {
    const {buffer} = this.#core.memory;
    for (const {at, numbers} of this.#written) {
      if (numbers instanceof Float64Array) {
        numbers.set(new Float64Array(buffer, at, numbers.length));
      } else if (numbers instanceof Uint8Array) {
        numbers.set(new Uint8Array(buffer, at, numbers.length));
      } else {
        const words = new Int32Array(buffer, at, 2 * numbers.length);
        for (let k = 0; k < numbers.length; k++) numbers[k] = words[2 * k];
      }
    }
  }

  free() {
    for (const at of this.#taken) this.#core.free(at);
  }
}

/**
 * @param {Value} value
 * @returns {value is Struct}
 */
const isStruct = (value) => value !== null && typeof value === 'object' && 'parameters' in value;

/**
 * Return size and alignment of a member, by the C ABI of 32-bit WebAssembly.
 * @param {Parameter} parameter
 * @param {Value} value
 */
function layoutOf(parameter, value) {
  if (parameter.pointer) return [4, 4];
  if (isStruct(value)) return layout(value);
  const size = SIZES[parameter.kind];
  return [size, size];
}

/**
 * Return size and alignment of a struct.
 * @param {Struct} record
 */
function layout({parameters, values}) {
  let end = 0, most = 1;
  parameters.forEach((parameter, k) => {
    const [size, align] = layoutOf(parameter, values[k]);
    end = Math.ceil(end / align) * align + size;
    most = Math.max(most, align);
  });
  return [Math.ceil(end / most) * most, most];
}
