import assert from 'node:assert/strict';
import test from 'node:test';
import type { ImportedPhoto, Light, RelightModule } from '../engine/wasm-exports.js';
import { PhotoError } from '../shared/errors.js';
import { toImageLight } from './image-pixels.js';
import { LightCache } from './light-cache.js';
import type { LightSetting } from './light-setting.js';
import type { LightImageSource, LinearImage } from './light-source.js';

const GOOD: LinearImage = { data: new Float32Array(3), width: 1, height: 1 };
const BAD: LinearImage = { data: new Float32Array(1), width: 1, height: 1 };

const setting = (picture: LightImageSource | null): LightSetting => ({
  name: 'fire',
  torch: null,
  image: picture && toImageLight(picture),
});

/** A cache whose lights have names, and the names of the lights that are not freed. */
function createCache() {
  const live = new Set<string>();
  const light = (name: string) => {
    live.add(name);
    return { name, free: () => live.delete(name) } as unknown as Light;
  };
  const module = {
    Light: {
      builtin: (_: ImportedPhoto, name: string) => light(name),
      torch: (_: ImportedPhoto, x: number, y: number, size?: number) =>
        light(`torch ${x} ${y} ${size}`),
      fire: (_: ImportedPhoto, seconds: number) => light(`fire ${seconds}`),
      fromLinear: (_: ImportedPhoto, values: Float32Array) => {
        if (values.length !== 3) throw new PhotoError('light-size', 'three values');
        return light('linear');
      },
    },
  };
  const cache = new LightCache(
    module as unknown as Pick<RelightModule, 'Light'>,
    {
      behind: (x: number, y: number) => Float64Array.of(100 * x, 10 * y),
      free: () => {},
    } as unknown as ImportedPhoto,
  );
  return { cache, live };
}

test('the cache holds one light at a time', () => {
  const { cache, live } = createCache();
  cache.get(setting(null));
  cache.get(setting(GOOD));
  assert.deepEqual([...live], ['linear']);
  cache.free();
  assert.equal(live.size, 0);
});

test('a built-in light is made again only for another setting', () => {
  const { cache, live } = createCache();
  const get = (setting: LightSetting) => cache.get(setting).light;
  const builtin = setting(null);
  const fire = get(builtin);
  assert.equal(get(builtin), fire);
  const torch = get({ name: 'torch', torch: { x: 0.5, y: 0.5 }, image: null });
  assert.notEqual(get({ name: 'torch', torch: { x: 0.5, y: 0.6 }, image: null }), torch);
  const image = setting(GOOD);
  assert.notEqual(get(image), get(image), 'the content of an image may have changed');
  assert.notEqual(get(builtin), fire);
  assert.equal(live.size, 1);
});

test('the last light substitutes for an unreadable image, and the built-in light before any', () => {
  const { cache, live } = createCache();
  const first = cache.get(setting(BAD));
  assert.equal(first.lightError?.code, 'light-size');
  assert.deepEqual([...live], ['fire 0']);
  cache.get(setting(GOOD));
  const last = cache.get(setting(BAD));
  assert.equal(last.lightError?.code, 'light-size');
  assert.deepEqual([...live], ['linear']);
  assert.equal(cache.get(setting(null)).lightError, null);
  assert.deepEqual([...live], ['fire 0']);
});

test('a torch has a size, and a fire has a time', () => {
  const { cache, live } = createCache();
  cache.get({ name: 'torch', torch: { x: 0.2, y: 0.3 }, size: 0.5, image: null });
  assert.deepEqual([...live], ['torch 20 3 0.5']);
  cache.get({ name: 'torch', torch: null, size: 0.5, image: null });
  assert.deepEqual([...live], ['torch 50 5 0.5']);
  cache.get({ name: 'fire', torch: null, seconds: 0.1, image: null });
  assert.deepEqual([...live], ['fire 0.1']);
  cache.get({ name: 'fire', torch: null, seconds: 0.2, image: null });
  assert.deepEqual([...live], ['fire 0.2']);
});
