/** A photograph and a module for tests. A tile is one row of one pixel, whose value is the tile's index. */

import assert from 'node:assert/strict';
import type { CpuModule, DecodedPhoto, ImportedPhoto, Light } from '../engine/wasm-exports.js';

const TILE_SIDE = 1;

/** A light whose values are the range of rows that was asked for. */
export const fakeLight: Light = {
  linearRgb: (first, end) => Float32Array.of(first, end),
  free: () => {},
};

/**
 * A photograph of `tileCount` tiles, one below the other, in the decoder's module, and a module that draws.
 * `tilesInModules` has the tiles that are in either of them; `state.alive` counts the photographs in
 * modules.
 */
export function fakePhoto(tileCount: number) {
  const tilesInModules = new Set(Array.from({ length: tileCount }, (_, i) => i));
  const state = { alive: 0, isOutOfMemory: false };
  const createModulePhoto = (tiles: Set<number>) => {
    let isFreed = false;
    state.alive += 1;
    return {
      takeTile: (index: number) => {
        assert.ok(!isFreed);
        assert.ok(tiles.delete(index) && tilesInModules.delete(index), `tile ${index} exists once`);
        return Uint8Array.of(index);
      },
      putTile: (index: number, bytes: Uint8Array) => {
        assert.ok(!isFreed);
        if (state.isOutOfMemory) {
          throw Object.assign(new Error('out of memory'), { code: 'format-limit' });
        }
        assert.equal(bytes[0], index);
        tiles.add(index);
        tilesInModules.add(index);
      },
      behind: (x: number, y: number) => Float64Array.of(x, y),
      free: () => {
        assert.ok(!isFreed);
        isFreed = true;
        state.alive -= 1;
      },
    } satisfies ImportedPhoto;
  };
  const photo: DecodedPhoto = {
    width: 1,
    height: tileCount,
    lightWidth: 1,
    lightHeight: tileCount,
    tileSide: TILE_SIDE,
    tiles: tileCount,
    metadata: '{}',
    decodedBytes: tileCount,
    packGeometry: () => new Float64Array(12),
    packBasis: () => new Float32Array(9),
    ...createModulePhoto(new Set(tilesInModules)),
  };
  const module = {
    Photo: { receive: () => createModulePhoto(new Set()) },
    Light: { builtin: () => fakeLight, torch: () => fakeLight },
    OutputTransform: class {
      free() {}
    },
    cpuKernel: () => 'fake, on the page',
    CanvasRelighter: class {
      readonly gamut = 'srgb';
      free() {}
    },
  } as unknown as CpuModule;
  return { photo, tilesInModules, state, module };
}
