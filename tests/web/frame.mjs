// Computes the frame in WebAssembly and compares its number with that of the native program.
//
// usage: node frame.mjs MODULE NATIVE_NUMBER
import { readFile } from "node:fs/promises";

// Relative. Vector instructions of the native program add in another order.
const TOLERANCE = 1e-5;

const [module, native] = process.argv.slice(2);
// The module imports nothing: it needs no more of a page than memory.
const { instance } = await WebAssembly.instantiate(await readFile(module), {});
const found = instance.exports.mean_of_lightmap();
const difference = Math.abs(found / Number(native) - 1);
console.log(`mean of the lightmap: ${found} on the web, ${native} natively`);
if (!(difference <= TOLERANCE)) {
    console.log(`relative difference: ${difference}, expected at most ${TOLERANCE}`);
    process.exit(1);
}
