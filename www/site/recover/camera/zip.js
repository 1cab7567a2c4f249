/** Writes a zip of files that are compressed already, with zip.js, which is loaded then. */

/** @param {ReadonlyMap<string, Blob>} files by their paths @returns {Promise<Blob>} */
export async function zip(files) {
  /** @type {typeof import('@zip.js/zip.js')} */
  const library = await import(new URL('../../../vendor/zip.js', import.meta.url).href);
  const { BlobReader, BlobWriter, ZipWriter } = library;
  const writer = new ZipWriter(new BlobWriter('application/zip'), {
    level: 0,
    useWebWorkers: false,
  });
  for (const [path, file] of files) await writer.add(path, new BlobReader(file));
  return writer.close();
}
