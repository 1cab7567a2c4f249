/** Writes PNG files with the samples that captures have, which a canvas cannot write. */

const SIGNATURE = Uint8Array.of(137, 80, 78, 71, 13, 10, 26, 10);
const GREY = 0;
const RGB = 2;
const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let value = byte;
  for (let i = 0; i < 8; i += 1) value = value & 1 ? 0xedb88320 ^ (value >>> 1) : value >>> 1;
  return value;
});

/** 8-bit grey. @param {number} width @param {number} height @param {Uint8Array} codes */
export function greyPng(width, height, codes) {
  return encode(width, height, { bits: 8, type: GREY, rowBytes: width, samples: codes });
}

/** 16-bit RGB. @param {number} width @param {number} height @param {Uint16Array} codes */
export function rgb16Png(width, height, codes) {
  const samples = new Uint8Array(2 * codes.length);
  const view = new DataView(samples.buffer);
  for (const [i, code] of codes.entries()) view.setUint16(2 * i, code);
  return encode(width, height, { bits: 16, type: RGB, rowBytes: 6 * width, samples });
}

/** @param {number} width @param {number} height @param {{ bits: number, type: number, rowBytes: number, samples: Uint8Array }} picture */
async function encode(width, height, { bits, type, rowBytes, samples }) {
  const header = new Uint8Array(13);
  const view = new DataView(header.buffer);
  view.setUint32(0, width);
  view.setUint32(4, height);
  header.set([bits, type], 8);
  // Each row begins with the number of its filter: none.
  const rows = new Uint8Array(height * (1 + rowBytes));
  for (let y = 0; y < height; y += 1) {
    rows.set(samples.subarray(y * rowBytes, (y + 1) * rowBytes), y * (1 + rowBytes) + 1);
  }
  const chunks = [chunk('IHDR', header), chunk('IDAT', await deflate(rows)), chunk('IEND')];
  return new Blob([SIGNATURE, ...chunks], { type: 'image/png' });
}

/** @param {string} name @param {Uint8Array} [data] */
function chunk(name, data = new Uint8Array()) {
  const bytes = new Uint8Array(12 + data.length);
  const view = new DataView(bytes.buffer);
  view.setUint32(0, data.length);
  bytes.set(new TextEncoder().encode(name), 4);
  bytes.set(data, 8);
  view.setUint32(8 + data.length, crc32(bytes.subarray(4, 8 + data.length)));
  return bytes;
}

/** @param {Uint8Array<ArrayBuffer>} bytes */
async function deflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new CompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The checksum of a chunk. @param {Uint8Array} bytes */
function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) crc = (CRC_TABLE[(crc ^ byte) & 255] ?? 0) ^ (crc >>> 8);
  return (crc ^ 0xffffffff) >>> 0;
}
