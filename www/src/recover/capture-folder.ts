/** Opens a capture folder that a visitor drops or chooses. */

import { messageOf, missingScript, PhotoError } from '../shared/errors.js';
import { normalisePath } from './page-files.js';

const MANIFEST = 'capture.json';
const ZIP_NAME = /\.zip$/i;
const ZIP_SIGNATURE = 0x504b0304;

/** The compiler does not know this method of directories, which all browsers with `FileSystemDirectoryHandle` have. */
interface DirectoryHandle {
  entries(): AsyncIterableIterator<[string, FileSystemDirectoryHandle | FileSystemFileHandle]>;
}

type Files = Map<string, Blob>;

/**
 * Gives the files of a capture folder by their paths, relative to the folder with `capture.json`. `source` is what was
 * dropped (call this before the first `await` of the listener), a folder that was picked, the files of an
 * `<input webkitdirectory>`, or a zip. Rejects with `capture-manifest` if there is no `capture.json`, and with
 * `capture-file` if a file cannot be read.
 */
export async function openCaptureFolder(
  source: DataTransfer | FileSystemDirectoryHandle | FileList | readonly File[] | Blob,
): Promise<ReadonlyMap<string, Blob>> {
  return relativeToManifest(await readFiles(source));
}

async function readFiles(source: Parameters<typeof openCaptureFolder>[0]): Promise<Files> {
  if (source instanceof Blob) return readZip(source);
  if ('items' in source) return readDrop(source);
  const files: Files = new Map();
  try {
    if ('getDirectoryHandle' in source) await readDirectory(source, '', files);
    else for (const file of source) files.set(file.webkitRelativePath || file.name, file);
  } catch (cause) {
    throw unreadable(cause);
  }
  return unzipSingle(files);
}

/** The items are valid only until the listener ends. */
async function readDrop({ items, files: dropped }: DataTransfer): Promise<Files> {
  const fileItems = [...items].filter(({ kind }) => kind === 'file');
  const entries = fileItems.map((item) => item.webkitGetAsEntry?.() ?? null);
  const all = [...dropped];
  const files: Files = new Map();
  try {
    for (const [i, entry] of entries.entries()) {
      const file = all[i];
      if (entry?.isDirectory) await readEntry(entry, files);
      else if (file) files.set(file.name, file);
    }
  } catch (cause) {
    throw unreadable(cause);
  }
  return unzipSingle(files);
}

async function readEntry(entry: FileSystemEntry, files: Files): Promise<void> {
  if (entry.isFile) {
    const fileEntry = entry as FileSystemFileEntry;
    const file = await new Promise<File>((resolve, reject) => fileEntry.file(resolve, reject));
    files.set(entry.fullPath, file);
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  // Browsers give a hundred entries at a time.
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) =>
      reader.readEntries(resolve, reject),
    );
    if (some.length === 0) return;
    for (const inner of some) await readEntry(inner, files);
  }
}

async function readDirectory(
  directory: FileSystemDirectoryHandle,
  path: string,
  files: Files,
): Promise<void> {
  for await (const [name, handle] of (directory as unknown as DirectoryHandle).entries()) {
    if (handle.kind === 'directory') await readDirectory(handle, `${path}${name}/`, files);
    else files.set(`${path}${name}`, await handle.getFile());
  }
}

/** The contents of a zip that was dropped or chosen by itself. */
async function unzipSingle(files: Files): Promise<Files> {
  const [[name, file] = ['', null]] = files;
  return files.size === 1 && file && ZIP_NAME.test(name) ? readZip(file) : files;
}

async function readZip(zip: Blob): Promise<Files> {
  const start = new DataView(await zip.slice(0, 4).arrayBuffer());
  if (start.byteLength < 4 || start.getUint32(0) !== ZIP_SIGNATURE) {
    const message = 'The file is no zip; give a capture folder, or a zip of it.';
    throw new PhotoError('capture-manifest', message);
  }
  const { unzip } = await import('./unzip.js').catch((cause: unknown) => {
    throw missingScript('worker-unavailable', 'zip files', cause);
  });
  try {
    return await unzip(zip);
  } catch (cause) {
    const message = `The zip cannot be read: ${messageOf(cause)}. Make or copy it again.`;
    throw new PhotoError('capture-file', message, cause);
  }
}

/** The files of the folder with the manifest. */
function relativeToManifest(files: Files): Files {
  const byPath: Files = new Map();
  for (const [path, file] of files) byPath.set(normalisePath(path), file);
  const depth = (path: string) => path.split('/').length;
  const manifests = [...byPath.keys()].filter((path) => path.split('/').at(-1) === MANIFEST);
  const least = Math.min(...manifests.map(depth));
  const [manifest, other] = manifests.filter((path) => depth(path) === least);
  if (manifest === undefined) {
    const message = `There is no ${MANIFEST} in these files; give the folder that holds it.`;
    throw new PhotoError('capture-manifest', message);
  }
  if (other !== undefined) {
    const message = `There are several captures, ${manifest} and ${other}; give one of their folders.`;
    throw new PhotoError('capture-manifest', message);
  }
  const folder = manifest.slice(0, -MANIFEST.length);
  const inside = [...byPath].filter(([path]) => path.startsWith(folder));
  return new Map(inside.map(([path, file]) => [path.slice(folder.length), file]));
}

function unreadable(cause: unknown): PhotoError {
  const message = `A file of the folder cannot be read: ${messageOf(cause)}. Copy the folder, and give it again.`;
  return new PhotoError('capture-file', message, cause);
}
