import assert from 'node:assert/strict';
import test from 'node:test';
import type { CaptureReaderModule, LinearPng } from '../engine/capture-reader-exports.js';
import { PictureReader } from './picture-reader.js';
import type { SentPicture } from './protocol.js';

const SIZE = { width: 2, height: 1 };
const SETTINGS = { lightGamma: 2, black: 100, white: 1100 };

/** A module whose PNGs have the values that the test gives. */
function fakeReader(png: Float32Array = new Float32Array(6)) {
  const calls: unknown[] = [];
  let freed = 0;
  const decode = (...args: unknown[]): LinearPng => {
    calls.push(args.slice(1));
    return { ...SIZE, data: png, free: () => (freed += 1) } as unknown as LinearPng;
  };
  const module = { readPhotograph: decode, readPattern: decode } as unknown as CaptureReaderModule;
  const emissionOfCodes = (gamma: number) =>
    Float32Array.from({ length: 256 }, (_, code) => (code / 255) ** gamma);
  const reader = new PictureReader({ emissionOfCodes }, async () => module, SETTINGS);
  return { reader, calls, freed: () => freed };
}

const codes = (...rgba: number[]) =>
  ({ ...SIZE, data: Uint8ClampedArray.from(rgba) }) as unknown as SentPicture;

test('8-bit photographs are linear, and 255 is saturated', async () => {
  const { reader } = fakeReader();
  const picture = codes(0, 10, 188, 255, 255, 128, 64, 0);
  const linear = [...(await reader.photograph(picture, 'photograph 0', SIZE))];
  const expected = [0, 10 / 255 / 12.92, 0.5029, Number.NaN, 0.2159, 0.0513];
  for (const [i, value] of expected.entries()) {
    if (Number.isNaN(value)) assert.ok(Number.isNaN(linear[i]));
    else assert.ok(Math.abs((linear[i] ?? 0) - value) < 1e-4, `${linear[i]} is ${value}`);
  }
});

test('codes of patterns have the gamma of the light, also at 255', async () => {
  const { reader } = fakeReader();
  const grey = await reader.pattern(codes(255, 255, 255, 255, 51, 51, 51, 255), 'pattern 0', SIZE);
  assert.deepEqual([...grey], [1, Math.fround(0.04)]);
  const rgb = await reader.pattern(codes(255, 0, 0, 255, 0, 0, 0, 255), 'pattern 0', SIZE);
  assert.deepEqual([...rgb], [1, 0, 0, 0, 0, 0]);
  const light = await reader.light(codes(255, 255, 255, 255, 0, 0, 0, 255), 'light', SIZE);
  assert.deepEqual([...light], [1, 1, 1, 0, 0, 0]);
});

test('PNGs are decoded by the module, and freed', async () => {
  const png = Float32Array.of(0, 0.5, 1, 0, 0, 0);
  const { reader, calls, freed } = fakeReader(png);
  assert.equal(await reader.photograph(new Blob(), 'photograph 3', SIZE), png);
  assert.equal(await reader.pattern(new Blob(), 'pattern 4', SIZE), png);
  assert.deepEqual(calls, [
    ['photograph 3', 100, 1100],
    ['pattern 4', 2],
  ]);
  assert.equal(freed(), 2);
});

test('a picture of another size, or with too few values, is named', async () => {
  const { reader } = fakeReader();
  const linear = (width: number, height: number, length: number) => ({
    width,
    height,
    data: new Float32Array(length),
  });
  for (const [picture, message] of [
    [linear(1, 2, 6), /^photograph 7 is 1x2, others are 2x1/],
    [linear(2, 1, 2), /^photograph 7 has 2 values for 2x1 pixels; give 3 for each/],
  ] as const) {
    await assert.rejects(reader.photograph(picture, 'photograph 7', SIZE), {
      code: 'capture-size',
      message,
    });
  }
  assert.deepEqual([...(await reader.pattern(linear(2, 1, 2), 'pattern', SIZE))], [0, 0]);
  await assert.rejects(reader.pattern(linear(2, 1, 5), 'pattern', SIZE), { code: 'capture-size' });
});
