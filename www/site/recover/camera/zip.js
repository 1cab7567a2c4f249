/** Writes a zip of files that are compressed already. */

import { crc32 } from './crc32.js';

const LOCAL_HEADER = 0x04034b50;
const DIRECTORY_HEADER = 0x02014b50;
const END = 0x06054b50;
/** 2.0: folders. */
const VERSION = 20;
const UTF8_NAMES = 0x0800;
/** The first of January 1980: files do not tell when they were made. */
const DATE = 0x0021;

/** @param {ReadonlyMap<string, Blob>} files by their paths */
export async function zip(files) {
  /** @type {Uint8Array<ArrayBuffer>[]} */
  const parts = [];
  /** @type {Uint8Array<ArrayBuffer>[]} */
  const directory = [];
  let offset = 0;
  for (const [path, file] of files) {
    const [name, bytes] = [
      new TextEncoder().encode(path),
      new Uint8Array(await file.arrayBuffer()),
    ];
    const crc = crc32(bytes);
    /** Version to method, time and date, checksum, both sizes, length of the name, no extra field. */
    const common = [
      [VERSION, 2],
      [UTF8_NAMES, 2],
      [0, 2],
      [0, 2],
      [DATE, 2],
      [crc, 4],
      [bytes.length, 4],
      [bytes.length, 4],
      [name.length, 2],
      [0, 2],
    ];
    const local = [record([[LOCAL_HEADER, 4], ...common]), name, bytes];
    directory.push(
      // After the common fields: comment, disk, attributes of two kinds, place of the local header.
      record([
        [DIRECTORY_HEADER, 4],
        [VERSION, 2],
        ...common,
        [0, 2],
        [0, 2],
        [0, 2],
        [0, 4],
        [offset, 4],
      ]),
      name,
    );
    parts.push(...local);
    offset += length(local);
  }
  const end = record([
    [END, 4],
    [0, 2],
    [0, 2],
    [files.size, 2],
    [files.size, 2],
    [length(directory), 4],
    [offset, 4],
    [0, 2],
  ]);
  return new Blob([...parts, ...directory, end], { type: 'application/zip' });
}

/** @param {number[][]} fields values, each with its number of bytes */
function record(fields) {
  const bytes = new Uint8Array(fields.reduce((sum, [, size = 0]) => sum + size, 0));
  const view = new DataView(bytes.buffer);
  let at = 0;
  for (const [value = 0, size = 0] of fields) {
    if (size === 2) view.setUint16(at, value, true);
    else view.setUint32(at, value, true);
    at += size;
  }
  return bytes;
}

/** @param {Uint8Array[]} parts */
function length(parts) {
  return parts.reduce((sum, part) => sum + part.length, 0);
}
