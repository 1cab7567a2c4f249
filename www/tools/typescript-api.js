/** Parses TypeScript by the analyser's own version of the compiler: newer ones lack this API. */

import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';

const repository = join(import.meta.dirname, '..', '..');

export const ts = createRequire(import.meta.resolve('@custom-elements-manifest/analyzer/cli.js'))(
  'typescript',
);

/** @param {string} file path in the repository */
export function parseTypeScript(file) {
  const text = readFileSync(join(repository, file), 'utf8');
  return ts.createSourceFile(file, text, ts.ScriptTarget.ES2022, true);
}
