/** Files that a worker reads within a call. */

import type { PageFiles } from '../engine/capture-reader-exports.js';

/** The compiler knows only the global scope of pages. */
declare const FileReaderSync: new () => { readAsArrayBuffer(blob: Blob): ArrayBuffer };

export function pageFiles(files: ReadonlyMap<string, Blob>): PageFiles {
  const find = (name: string) => files.get(normalisePath(name));
  return {
    size: (name) => find(name)?.size,
    read(name, offset, length) {
      const part = (find(name) ?? new Blob()).slice(offset, offset + length);
      return new Uint8Array(new FileReaderSync().readAsArrayBuffer(part));
    },
  };
}

/** A path without `.` and `..`, with slashes. */
export function normalisePath(path: string): string {
  const parts: string[] = [];
  for (const part of path.replaceAll('\\', '/').split('/')) {
    if (part === '..') parts.pop();
    else if (part !== '.' && part !== '') parts.push(part);
  }
  return parts.join('/');
}
