// Calls functions of the core as a WebAssembly module, and writes what they return and what they change.
//
//     node wasm.mjs core.wasm < calls.json > results.json
//
// A call is {name, returns, args}; an argument is {kind: "int64_t", value}, {kind: "double", value}, {kind: "bool", value},
// {kind: "array", bytes} (base64), {kind: "callback"} (null) or {kind: "record", members: [arguments]}.
import { readFileSync } from "node:fs";

const module = await WebAssembly.compile(readFileSync(process.argv[2]));
const needed = WebAssembly.Module.imports(module);
if (needed.length) throw new Error(`the module needs ${JSON.stringify(needed)}`);
const { exports: core } = await WebAssembly.instantiate(module, {});
core._initialize();

const SIZES = { int64_t: 8, double: 8, bool: 1, array: 4, callback: 4 };

// Size and alignment of a member of a struct, by the C ABI of 32-bit WebAssembly.
function layout(argument) {
    if (argument.kind !== "record") return [SIZES[argument.kind], SIZES[argument.kind]];
    let end = 0, align = 1;
    for (const member of argument.members) {
        const [size, its] = layout(member);
        end = Math.ceil(end / its) * its + size;
        align = Math.max(align, its);
    }
    return [Math.ceil(end / align) * align, align];
}

function call({ name, returns, args }) {
    const taken = [], arrays = [];

    function allocate(size) {
        const at = core.malloc(Math.max(size, 16));
        if (!at) throw new Error("out of memory");
        taken.push(at);
        return at;
    }

    function place(argument) {
        const bytes = Buffer.from(argument.bytes, "base64"), at = allocate(bytes.length);
        new Uint8Array(core.memory.buffer).set(bytes, at);
        arrays.push([at, bytes.length]);
        return at;
    }

    function write(record, at) {
        let offset = at;
        for (const member of record.members) {
            const [size, align] = layout(member);
            offset = Math.ceil(offset / align) * align;
            if (member.kind === "record") write(member, offset);
            else {
                const value = member.kind === "array" ? place(member) : member.value;
                const view = new DataView(core.memory.buffer);
                if (member.kind === "callback") view.setUint32(offset, 0, true);
                else if (member.kind === "array") view.setUint32(offset, value, true);
                else if (member.kind === "int64_t") view.setBigInt64(offset, BigInt(value), true);
                else if (member.kind === "double") view.setFloat64(offset, Number(value), true);
                else view.setUint8(offset, value ? 1 : 0);
            }
            offset += size;
        }
    }

    const given = args.map((argument) => {
        if (argument.kind === "array") return place(argument);
        if (argument.kind === "int64_t") return BigInt(argument.value);
        if (argument.kind !== "record") return Number(argument.value);
        const at = allocate(layout(argument)[0]);
        write(argument, at);
        return at;
    });
    const value = core[name](...given);
    const after = arrays.map(([at, length]) => Buffer.from(core.memory.buffer.slice(at, at + length)).toString("base64"));
    taken.forEach((at) => core.free(at));
    return { value: returns === "double" ? String(value) : value.toString(), arrays: after };
}

const calls = JSON.parse(readFileSync(0, "utf8"));
process.stdout.write(JSON.stringify(calls.map(call)));
