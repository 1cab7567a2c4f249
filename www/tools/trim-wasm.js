/**
 * Takes from a module what nobody outside calls: zstd's stand-ins for C's library are for its C code alone, but
 * cargo exports them, and with them sorting in five kinds: node www/tools/trim-wasm.js FILE.wasm
 */

import { readFileSync, writeFileSync } from 'node:fs';
import binaryen from 'binaryen';

const file = process.argv[2] ?? '';
binaryen.setDebugInfo(true); // names, which the optimiser strips
const module = binaryen.readBinary(readFileSync(file));
for (let index = module.getNumExports() - 1; index >= 0; index -= 1) {
  const { name } = binaryen.getExportInfo(module.getExportByIndex(index));
  if (name.startsWith('rust_zstd_wasm_shim_')) module.removeExport(name);
}
writeFileSync(file, module.emitBinary());
