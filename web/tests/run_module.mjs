// Run one of the module's functions on many rows: node run_module.mjs MODULE FUNCTION COLUMNS RESULTS [ARGUMENT...] < rows > results
//
// Rows of COLUMNS doubles come in; for each, RESULTS doubles go out: what the function wrote to its arrays one after the other, and last
// what it returned. The function gets where its row is and then the ARGUMENTs: "@n" an array of n results, "%" the last column of the row
// itself, another number itself. With the one ARGUMENT "columns" it gets the row's numbers instead.
import { readFileSync, writeSync } from "node:fs";

const [path, name, columns, results, ...rest] = process.argv.slice(2);
const { instance } = await WebAssembly.instantiate(readFileSync(path));
const kernel = instance.exports;
const memory = new Float64Array(kernel.memory.buffer, kernel.shared_rows(), kernel.shared_size());
const input = readFileSync(0);
const rows = new Float64Array(input.buffer.slice(input.byteOffset, input.byteOffset + input.byteLength));
const n = rows.length / columns;
const output = new Float64Array(n * results);

let end = Number(columns);
const call = [() => kernel.shared_rows()];
for (const word of rest) {
  const place = kernel.shared_rows() + 8 * end;
  if (word.startsWith("@")) {
    call.push(() => place);
    end += Number(word.slice(1));
  } else {
    call.push(word === "%" ? (row) => row.at(-1) : () => Number(word));
  }
}
const argumentsOf = rest[0] === "columns" ? (row) => row : (row) => call.map((each) => each(row));
const began = performance.now();
for (let i = 0; i < n; i++) {
  const row = rows.subarray(i * columns, (i + 1) * columns);
  memory.set(row);
  const returned = kernel[name](...argumentsOf(row));
  output.set(memory.subarray(columns, end), i * results);
  output[(i + 1) * results - 1] = returned ?? 0;
}
process.stderr.write(`${(((performance.now() - began) / n) * 1000).toFixed(1)} us a call\n`);
const bytes = Buffer.from(output.buffer);
for (let at = 0; at < bytes.length; ) at += writeSync(1, bytes, at);
