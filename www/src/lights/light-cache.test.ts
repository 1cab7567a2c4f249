import assert from 'node:assert/strict';
import test from 'node:test';
import type { DrawingModule, DrawnPhoto, Light } from '../engine/types.js';
import { PhotoError } from '../shared/errors.js';
import { Projected } from './image-light.js';
import { Lamp } from './light-cache.js';
import type { LightSetting } from './light-setting.js';
import type { LightPicture, LinearLight } from './light-source.js';

const PHOTO = {} as DrawnPhoto;
const GOOD: LinearLight = { data: new Float32Array(3), width: 1, height: 1 };
const BAD: LinearLight = { data: new Float32Array(1), width: 1, height: 1 };

const setting = (picture: LightPicture | null): LightSetting => ({
  name: 'fire',
  torch: null,
  picture: picture && new Projected(picture),
});

/** A lamp whose lights have names, and the names of those that are not freed. */
function lamp() {
  const lit = new Set<string>();
  const light = (name: string) => {
    lit.add(name);
    return { name, free: () => lit.delete(name) } as unknown as Light;
  };
  const engine = {
    Light: {
      builtin: (_: DrawnPhoto, name: string) => light(name),
      torch: (_: DrawnPhoto, x: number, y: number, size?: number) =>
        light(`torch ${x} ${y} ${size}`),
      fire: (_: DrawnPhoto, seconds: number) => light(`fire ${seconds}`),
      fromLinear: (_: DrawnPhoto, values: Float32Array) => {
        if (values.length !== 3) throw new PhotoError('light-size', 'three values');
        return light('linear');
      },
    },
  };
  const lamp = new Lamp(engine as unknown as Pick<DrawingModule, 'Light'>);
  return { lamp, lit };
}

test('a lamp has one light at a time', () => {
  const { lamp: it, lit } = lamp();
  it.turnTo(setting(null), PHOTO);
  it.turnTo(setting(GOOD), PHOTO);
  assert.deepEqual([...lit], ['linear']);
  it.free();
  assert.equal(lit.size, 0);
});

test('a built-in light is made again only where it is another one', () => {
  const { lamp: it, lit } = lamp();
  const turn = (setting: LightSetting) => it.turnTo(setting, PHOTO).light;
  const fire = turn(setting(null));
  assert.equal(turn({ ...setting(null) }), fire);
  const torch = turn({ name: 'torch', torch: { x: 0.5, y: 0.5 }, picture: null });
  assert.equal(turn({ name: 'torch', torch: { x: 0.5, y: 0.5 }, picture: null }), torch);
  assert.notEqual(turn({ name: 'torch', torch: { x: 0.5, y: 0.6 }, picture: null }), torch);
  const picture = turn(setting(GOOD));
  assert.notEqual(turn(setting(GOOD)), picture, 'what a picture shows may have changed');
  assert.notEqual(turn(setting(null)), fire);
  assert.equal(lit.size, 1);
});

test('a light that cannot be had leaves the last one, and before any the built-in one', () => {
  const { lamp: it, lit } = lamp();
  const first = it.turnTo(setting(BAD), PHOTO);
  assert.equal(first.fault?.code, 'light-size');
  assert.deepEqual([...lit], ['fire 0']);
  it.turnTo(setting(GOOD), PHOTO);
  const last = it.turnTo(setting(BAD), PHOTO);
  assert.equal(last.fault?.code, 'light-size');
  assert.deepEqual([...lit], ['linear']);
  assert.equal(it.turnTo(setting(null), PHOTO).fault, null);
  assert.deepEqual([...lit], ['fire 0']);
});

test('a torch has a size, and a fire burns', () => {
  const { lamp: it, lit } = lamp();
  it.turnTo({ name: 'torch', torch: { x: 0.2, y: 0.3 }, size: 0.5, picture: null }, PHOTO);
  assert.deepEqual([...lit], ['torch 0.2 0.3 0.5']);
  it.turnTo({ name: 'torch', torch: null, size: 0.5, picture: null }, PHOTO);
  assert.deepEqual([...lit], ['torch 0.5 0.5 0.5']);
  it.turnTo({ name: 'fire', torch: null, seconds: 0.1, picture: null }, PHOTO);
  assert.deepEqual([...lit], ['fire 0.1']);
  const burning = it.turnTo({ name: 'fire', torch: null, seconds: 0.2, picture: null }, PHOTO);
  assert.deepEqual([...lit], ['fire 0.2']);
  const same = it.turnTo({ name: 'fire', torch: null, seconds: 0.2, picture: null }, PHOTO);
  assert.equal(same.light, burning.light);
});
