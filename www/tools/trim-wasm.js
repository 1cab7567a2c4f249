/**
 * Removes exports that nothing calls: the replacements of C's library for zstd, which cargo exports although only
 * zstd's C code uses them, and which keep five sorting algorithms alive: node www/tools/trim-wasm.js FILE.wasm
 */

import { readFileSync, writeFileSync } from 'node:fs';
import binaryen from 'binaryen';

const file = process.argv[2] ?? '';
binaryen.setDebugInfo(true); // keeps the names; the optimiser removes them later
const module = binaryen.readBinary(readFileSync(file));
for (let index = module.getNumExports() - 1; index >= 0; index -= 1) {
  const { name } = binaryen.getExportInfo(module.getExportByIndex(index));
  if (name.startsWith('rust_zstd_wasm_shim_')) module.removeExport(name);
}
writeFileSync(file, module.emitBinary());
