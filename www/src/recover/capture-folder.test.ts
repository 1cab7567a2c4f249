import assert from 'node:assert/strict';
import test from 'node:test';
import { crc32, deflateRawSync } from 'node:zlib';
import { openCaptureFolder } from './capture-folder.js';
import { normalisePath } from './page-files.js';

const MANIFEST = new Blob(['{}']);
const PHOTO = new Blob(['photo']);

/** A folder of the File System Access API. */
function fakeDirectory(files: Record<string, Blob | Record<string, Blob>>) {
  return {
    kind: 'directory',
    getDirectoryHandle() {},
    async *entries() {
      for (const [name, content] of Object.entries(files)) {
        if (content instanceof Blob) yield [name, { kind: 'file', getFile: async () => content }];
        else yield [name, fakeDirectory(content)];
      }
    },
  };
}

const asHandle = (files: Record<string, Blob | Record<string, Blob>>) =>
  fakeDirectory(files) as unknown as FileSystemDirectoryHandle;

const asFiles = (files: Record<string, Blob>) =>
  Object.entries(files).map(([webkitRelativePath, blob]) =>
    Object.assign(new File([blob], webkitRelativePath.split('/').at(-1) ?? ''), {
      webkitRelativePath,
    }),
  );

/** A dropped folder, whose directories give two entries at a time. */
function fakeDrop(files: Record<string, Blob | Record<string, Blob>>) {
  const toEntry = (fullPath: string, content: Blob | Record<string, Blob>): unknown => {
    if (content instanceof Blob) {
      const file = (resolve: (file: Blob) => void) => resolve(content);
      return { isFile: true, isDirectory: false, fullPath, file };
    }
    const left = Object.entries(content).map(([name, inner]) =>
      toEntry(`${fullPath}/${name}`, inner),
    );
    const readEntries = (resolve: (entries: unknown[]) => void) => resolve(left.splice(0, 2));
    return { isFile: false, isDirectory: true, fullPath, createReader: () => ({ readEntries }) };
  };
  const entries = Object.entries(files);
  const text = { kind: 'string', webkitGetAsEntry: () => null };
  const fileItems = entries.map(([name, content]) => ({
    kind: 'file',
    webkitGetAsEntry: () => toEntry(`/${name}`, content),
  }));
  const dropped = entries.map(([name, content]) =>
    content instanceof Blob ? new File([content], name) : new File([], name),
  );
  return { items: [text, ...fileItems], files: dropped } as unknown as DataTransfer;
}

/** A zip with compressed entries. */
function makeZip(files: Record<string, string>): Blob {
  const parts: Buffer[] = [];
  const directory: Buffer[] = [];
  let offset = 0;
  for (const [name, text] of Object.entries(files)) {
    const raw = Buffer.from(text);
    const data = deflateRawSync(raw);
    const header = Buffer.alloc(26);
    header.writeUInt16LE(20, 0);
    header.writeUInt16LE(8, 4);
    header.writeUInt32LE(crc32(raw), 10);
    header.writeUInt32LE(data.length, 14);
    header.writeUInt32LE(raw.length, 18);
    header.writeUInt16LE(name.length, 22);
    const local = Buffer.concat([Buffer.from('PK\x03\x04'), header, Buffer.from(name), data]);
    const rest = Buffer.alloc(14);
    rest.writeUInt32LE(offset, 10);
    directory.push(
      Buffer.concat([Buffer.from('PK\x01\x02\x14\x00'), header, rest, Buffer.from(name)]),
    );
    parts.push(local);
    offset += local.length;
  }
  const list = Buffer.concat(directory);
  const end = Buffer.alloc(22);
  end.write('PK\x05\x06', 'latin1');
  end.writeUInt16LE(directory.length, 8);
  end.writeUInt16LE(directory.length, 10);
  end.writeUInt32LE(list.length, 12);
  end.writeUInt32LE(offset, 16);
  return new Blob([Uint8Array.from(Buffer.concat([...parts, list, end]))]);
}

test('a folder is the one that holds capture.json, however it is given', async () => {
  const inner = { 'capture.json': MANIFEST, 'a.png': PHOTO, 'b.png': PHOTO };
  const zip = makeZip({ 'glass/capture.json': '{}', 'glass/a.png': 'a', 'glass/b.png': 'b' });
  for (const source of [
    asHandle(inner),
    asHandle({ glass: inner, 'notes.txt': PHOTO }),
    asFiles({ 'glass/capture.json': MANIFEST, 'glass/a.png': PHOTO, 'glass/b.png': PHOTO }),
    fakeDrop({ glass: inner }),
    fakeDrop(inner),
    zip,
    fakeDrop({ 'glass.zip': zip }),
    [new File([zip], 'glass.zip')],
  ]) {
    const files = await openCaptureFolder(source);
    assert.deepEqual([...files.keys()].sort(), ['a.png', 'b.png', 'capture.json']);
  }
  const files = await openCaptureFolder(zip);
  assert.equal(await files.get('a.png')?.text(), 'a');
});

test('a folder without one capture is refused', async () => {
  await assert.rejects(openCaptureFolder(asHandle({ 'a.png': PHOTO })), {
    code: 'capture-manifest',
    message: /no capture\.json/,
  });
  const two = { a: { 'capture.json': MANIFEST }, b: { 'capture.json': MANIFEST } };
  await assert.rejects(openCaptureFolder(asHandle(two)), {
    code: 'capture-manifest',
    message: /a\/capture\.json and b\/capture\.json/,
  });
});

test('a file that is no zip, and a damaged one, are refused', async () => {
  await assert.rejects(openCaptureFolder(PHOTO), { code: 'capture-manifest' });
  const zip = makeZip({ 'capture.json': '{}' });
  const damaged = zip.slice(0, zip.size - 30);
  await assert.rejects(openCaptureFolder(damaged), { code: 'capture-file' });
});

test('paths of capture.json may be written in several ways', () => {
  assert.equal(normalisePath('./photos/../photos//a.png'), 'photos/a.png');
  assert.equal(normalisePath('photos\\a.png'), 'photos/a.png');
});
