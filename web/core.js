// The compiled core as a WebAssembly module. Functions and structs are declared by their C prototypes, as in iccm/native;
// a test compares the prototypes with those of Python.
//
// Arrays are copied into the module's memory for each call, and back unless the argument is const: Float64Array for
// double and Complex (pairs of doubles), Int32Array for int64_t, Uint8Array for bool. Callbacks are functions of addresses.

/** @typedef {Float64Array | Int32Array | Uint8Array} Numbers */
/** @typedef {{kind: string, constant: boolean, pointer: boolean}} Parameter */
/** @typedef {{parameters: Parameter[], values: Value[]}} Struct */
/** @typedef {(...addresses: number[]) => number} Callback */
/** @typedef {Numbers | Scratch | Struct | Callback | number | boolean | null} Value */
/**
 * @typedef {object} Runtime
 * @property {WebAssembly.Memory} memory
 * @property {WebAssembly.Table} __indirect_function_table
 * @property {(size: number) => number} malloc
 * @property {(at: number) => void} free
 * @property {() => void} _initialize
 */

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

/** Numbers of addresses that callbacks take, by type. @type {Record<string, number>} */
const CALLBACKS = {TotalCallback: 1, DerivativesCallback: 3};

/** @type {(Runtime & Record<string, Function>) | null} */
let core = null;
/** The function that the core calls at present for each type of callback, and its number in the core's table. @type {Record<string, {call: Callback, place: number}>} */
const callbacks = {};

/**
 * Compile and start the module.
 * @param {BufferSource} bytes
 */
export async function load(bytes) {
  const {instance} = await WebAssembly.instantiate(bytes, {});
  core = /** @type {Runtime & Record<string, Function>} */ (/** @type {unknown} */ (instance.exports));
  core._initialize();
  for (const [kind, count] of Object.entries(CALLBACKS)) {
    const current = {call: /** @type {Callback} */ (() => 0), place: core.__indirect_function_table.grow(1)};
    core.__indirect_function_table.set(current.place, await tableFunction((...addresses) => current.call(...addresses), count));
    callbacks[kind] = current;
  }
}

/**
 * Return a function of addresses that returns a double, as a table of WebAssembly takes it: the export of a module that
 * exports what it imports.
 * @param {Callback} call
 * @param {number} count number of addresses
 */
async function tableFunction(call, count) {
  const [int, double] = [0x7f, 0x7c], type = [1, 0x60, count, ...Array(count).fill(int), 1, double];
  const name = [1, 'f'.charCodeAt(0)], own = [1, ...name, ...name, 0, 0], out = [1, ...name, 0, 0];
  const sections = [[1, type], [2, own], [7, out]].flatMap(([number, body]) => [number, /** @type {number[]} */ (body).length, body].flat());
  const module = Uint8Array.from([0, 0x61, 0x73, 0x6d, 1, 0, 0, 0, .../** @type {number[]} */ (sections)]);
  const {instance} = await WebAssembly.instantiate(module, {f: {f: call}});
  return instance.exports.f;
}

/**
 * Return numbers in the core's memory, for a callback.
 * @param {number} address
 * @param {number} count
 */
export function numbersAt(address, count) {
  if (!core) throw new Error('the core has not been loaded');
  return new Float64Array(core.memory.buffer, address, count);
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
    if (typeof value === 'function') {
      callbacks[parameter.kind].call = value;
      return callbacks[parameter.kind].place;
    }
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
