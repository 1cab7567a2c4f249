/** Reads zip files: a script that is loaded on demand. The browser decompresses. */

import { type Reader, ZipReader } from '@zip.js/zip.js/lib/zip-core-reader.js';

/** Gives the files of a zip by their paths. */
export async function unzip(zip: Blob): Promise<Map<string, Blob>> {
  // In place of zip.js's own readers, which would bring its writers along.
  const source = {
    size: zip.size,
    readUint8Array: async (offset: number, length: number) =>
      new Uint8Array(await zip.slice(offset, offset + length).arrayBuffer()),
    createReadable: ({ offset = 0, size = zip.size }) => zip.slice(offset, offset + size).stream(),
  };
  const reader = new ZipReader(source as unknown as Reader<Blob>, {
    useWebWorkers: false,
    checkSignature: true,
  });
  const files = new Map<string, Blob>();
  for await (const entry of reader.getEntriesGenerator()) {
    if (!entry.directory) files.set(entry.filename, new Blob([await entry.arrayBuffer()]));
  }
  await reader.close();
  return files;
}
