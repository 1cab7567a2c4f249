import assert from 'node:assert/strict';
import test from 'node:test';
import type { ImageLight } from '../lights/light-setting.js';
import { withBackends, withExposure } from '../renderers/settings-fakes.js';
import { PhotoError } from '../shared/errors.js';
import { type FakeSession, fakeSession, loadedSession, SETTINGS, settle } from './session-fakes.js';

/**
 * Frames of an animation. Each is drawn at once, but the browser's next frame follows after `ms`, or after a share of
 * that if the frame has reduced quality.
 */
async function animate(f: FakeSession, count: number, ms: number): Promise<void> {
  for (let frame = 0; frame < count; frame += 1) {
    f.session.redraw();
    await f.frame();
    await f.pass(ms * (f.session.quality ?? 1));
  }
}

/** Nothing changes until the picture is at rest. */
async function rest(f: FakeSession): Promise<void> {
  await f.frame();
  await f.pass(150);
}

/** A session whose last frame has reduced quality. */
async function reducedSession() {
  const f = await loadedSession();
  await animate(f, 20, 60);
  assert.equal(f.takeLog().at(-1), 'webgpu draws flood with 0.5');
  return f;
}

test('all changes before a frame of the browser are drawn once', async () => {
  const f = await loadedSession();
  f.session.set({ ...SETTINGS, light: { name: 'torch', torch: { x: 0, y: 0 }, image: null } });
  f.session.set({ ...SETTINGS, light: { name: 'torch', torch: { x: 1, y: 0 }, image: null } });
  assert.equal(f.frames.length, 1);
  f.frames[0]?.();
  assert.deepEqual(f.takeLog(), ['webgpu draws torch']);
});

test('if settings change faster than frames are drawn, the newest is drawn next', async () => {
  const f = await loadedSession();
  const frames = f.slowDown();
  for (const name of ['torch', 'fire', 'stripes'] as const) {
    f.session.set({ ...SETTINGS, light: { name, torch: null, image: null } });
    await f.frame();
  }
  assert.deepEqual(f.takeLog(), ['webgpu draws torch']);
  // At once, without waiting for the browser's next frame.
  frames[0]?.done();
  await settle();
  assert.deepEqual(f.takeLog(), ['webgpu draws stripes']);
  frames[1]?.done();
  await settle();
  assert.deepEqual(f.takeLog(), []);
});

test('renderNow resolves with the next frame, even if more are requested', async () => {
  const f = await loadedSession();
  const frames = f.slowDown();
  const light = (name: 'torch' | 'fire' | 'stripes') => {
    f.session.set({ ...SETTINGS, light: { name, torch: null, image: null } });
    return f.frame();
  };
  await light('torch');
  let given = false;
  const asked = f.session.renderNow().then(() => {
    given = true;
  });
  await light('fire');
  frames[0]?.done();
  await settle();
  await light('stripes');
  assert.equal(given, false, 'that frame was older than the question');
  frames[1]?.done();
  await asked;
  assert.deepEqual(f.takeLog().slice(0, 2), ['webgpu draws torch', 'webgpu draws fire']);
});

test('the error of a light that was replaced is not reported', async () => {
  const f = await loadedSession();
  const frames = f.slowDown();
  const image = {} as ImageLight;
  f.session.set({ ...SETTINGS, light: { ...SETTINGS.light, image } });
  await f.frame();
  f.session.set(SETTINGS);
  frames[0]?.done(new PhotoError('light-tainted', 'of another origin'));
  await settle();
  assert.deepEqual(f.takeLog(), ['webgpu draws flood']);
});

test('the error of a light is reported with each frame, which counts as drawn', async () => {
  const f = fakeSession();
  f.setLightError(new PhotoError('light-tainted', 'of another origin'));
  f.session.set(SETTINGS);
  await f.finishLoad('a.ltm');
  await f.createRenderer(0);
  assert.deepEqual(f.takeLog().slice(2), [
    'webgpu draws flood',
    'no light: of another origin',
    'loaded',
  ]);
  f.setLightError(null);
  f.session.redraw();
  await f.frame();
  assert.deepEqual(f.takeLog(), ['webgpu draws flood']);
});

test('redraws before a frame of the browser are drawn once', async () => {
  const f = await loadedSession();
  for (let i = 0; i < 3; i += 1) f.session.redraw();
  assert.equal(f.frames.length, 1);
  await f.frame();
  assert.deepEqual(f.takeLog(), ['webgpu draws flood']);
});

test('a change in the page’s frame callback is drawn in that frame', async () => {
  const f = await loadedSession();
  for (let i = 0; i < 10; i += 1) await f.frame(() => f.session.redraw());
  assert.equal(f.takeLog().length, 9, 'there was none to wait for before the first');
  await f.frame();
  assert.equal(f.frames.length, 0);
});

test('changes are not drawn while hidden, and once when visible', async () => {
  const f = await loadedSession();
  f.session.setVisible(false);
  for (const exposure of [2, 3]) {
    f.session.set({ ...SETTINGS, output: withExposure(exposure) });
    f.session.redraw();
  }
  assert.equal(f.frames.length, 0);
  f.session.setVisible(true);
  await f.frame();
  assert.deepEqual(f.takeLog(), ['webgpu draws flood']);
  for (const visible of [false, true]) f.session.setVisible(visible);
  await f.frame();
  assert.deepEqual(f.takeLog(), [], 'nothing has changed');
});

test('a frame that is hidden before it is drawn waits until it is visible', async () => {
  const f = await loadedSession();
  f.session.redraw();
  f.session.setVisible(false);
  await f.frame();
  assert.deepEqual(f.takeLog(), []);
  f.session.setVisible(true);
  await f.frame();
  assert.deepEqual(f.takeLog(), ['webgpu draws flood']);
});

test('the first frame, that of another backend and renderNow are drawn while hidden', async () => {
  const f = fakeSession();
  f.session.setVisible(false);
  f.session.set(SETTINGS);
  await f.finishLoad('a.ltm');
  await f.createRenderer(0);
  assert.equal(f.takeLog().at(-1), 'loaded');
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['cpu']) });
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog().slice(-2), ['cpu draws flood', 'free webgpu']);
  f.session.redraw();
  await f.session.renderNow();
  assert.deepEqual(f.takeLog(), ['cpu draws flood']);
  f.session.setVisible(true);
  assert.equal(f.frames.length, 0, 'it is up to date');
});

test('slow frames are drawn with less quality, and once more in full at rest', async () => {
  const f = await loadedSession();
  assert.equal(f.session.quality, 1);
  await animate(f, 12, 60);
  assert.equal(f.session.quality, 0.5);
  const log = f.takeLog();
  assert.deepEqual(new Set(log.slice(0, 8)), new Set(['webgpu draws flood']));
  assert.equal(log.filter((line) => line.startsWith('quality')).join(), 'quality 0.5');
  await f.frame();
  await f.pass(140);
  assert.deepEqual(f.takeLog(), [], 'not yet');
  await f.pass(10);
  assert.deepEqual(f.takeLog(), ['webgpu draws flood', 'quality 1']);
  assert.equal(f.session.quality, 1);
  await f.pass(10_000);
  await f.frame();
  assert.deepEqual(f.takeLog(), []);
  assert.equal(f.frames.length, 0);
});

test('slow asynchronous frames are drawn with less quality', async () => {
  for (const [ms, quality] of [
    [20, 1],
    [60, 0.5],
    [200, 0.25],
  ] as const) {
    const f = await loadedSession();
    const frames = f.slowDown();
    for (let frame = 0; frame < 12; frame += 1) {
      f.session.redraw();
      await f.frame();
      await f.pass(ms);
      frames.shift()?.done();
      await settle();
    }
    assert.equal(f.session.quality, quality, `${ms} ms`);
  }
});

test('slow synchronous frames are drawn with less quality', async () => {
  for (const [ms, quality] of [
    [30, 1],
    [60, 0.5],
  ] as const) {
    const f = await loadedSession();
    f.setFrameMs(ms);
    for (let i = 0; i < 30; i += 1) await f.frame(() => f.session.redraw());
    assert.equal(f.session.quality, quality, `${ms} ms`);
  }
});

test('fast frames are drawn in full quality, however rare they are', async () => {
  const f = await loadedSession();
  for (const wait of [0, 20, 80, 140]) {
    for (let frame = 0; frame < 20; frame += 1) {
      await animate(f, 1, 16);
      await f.frame();
      await f.pass(wait);
    }
  }
  assert.deepEqual(new Set(f.takeLog()), new Set(['webgpu draws flood']));
});

test('a newer frame is drawn before the one in full quality', async () => {
  const f = await reducedSession();
  await f.frame();
  await f.pass(80);
  f.session.redraw();
  await f.pass(1000);
  assert.deepEqual(f.takeLog(), [], 'it waits for the browser');
  await f.frame();
  assert.deepEqual(f.takeLog(), ['webgpu draws flood with 0.5']);
  await rest(f);
  assert.deepEqual(f.takeLog(), ['webgpu draws flood', 'quality 1']);
});

test('a picture is not at rest if the browser’s frames are slow', async () => {
  const f = await reducedSession();
  for (let i = 0; i < 10; i += 1) {
    await f.frame(() => f.session.redraw());
    await f.pass(500);
  }
  assert.ok(!f.takeLog().includes('webgpu draws flood'));
});

test('a picture at rest is drawn in full quality once it is visible', async () => {
  const f = await reducedSession();
  f.session.setVisible(false);
  await rest(f);
  assert.deepEqual(f.takeLog(), []);
  f.session.setVisible(true);
  await f.frame();
  f.session.setVisible(false);
  await rest(f);
  assert.deepEqual(f.takeLog(), [], 'nor if it was so for a moment');
  f.session.setVisible(true);
  await rest(f);
  assert.deepEqual(f.takeLog(), ['webgpu draws flood', 'quality 1']);
  f.session.setVisible(false);
  f.session.setVisible(true);
  await rest(f);
  assert.deepEqual(f.takeLog(), [], 'it is');
});

test('a stopped session does not draw at rest', async () => {
  const f = await reducedSession();
  f.session.stop();
  assert.equal(f.session.quality, null);
  f.takeLog();
  await rest(f);
  assert.deepEqual(f.takeLog(), []);
});

test('renderNow draws in full quality during an animation', async () => {
  const f = await reducedSession();
  await f.session.renderNow();
  assert.deepEqual(f.takeLog(), ['webgpu draws flood', 'quality 1']);
  await rest(f);
  assert.deepEqual(f.takeLog(), [], 'so there is none to come');
  f.session.redraw();
  await f.session.renderNow();
  await f.frame();
  assert.deepEqual(f.takeLog(), ['webgpu draws flood'], 'nor one that was asked for before');
  const frames = f.slowDown();
  const light = { name: 'torch', torch: null, image: null } as const;
  f.session.set({ ...SETTINGS, light });
  await f.frame();
  // A requested frame of the animation makes no difference.
  f.session.redraw();
  await f.frame();
  const asked = f.session.renderNow();
  frames[0]?.done();
  await settle();
  frames[1]?.done();
  await asked;
  assert.deepEqual(f.takeLog(), [
    'webgpu draws torch with 0.5',
    'quality 0.5',
    'webgpu draws torch',
    'quality 1',
  ]);
});

test('another backend and another photograph start in full quality', async () => {
  const f = await reducedSession();
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['cpu']) });
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog().slice(-3), ['cpu draws flood', 'free webgpu', 'quality 1']);
  await animate(f, 20, 60);
  assert.equal(f.session.quality, 0.5);
  f.session.set({ ...SETTINGS, src: 'b.ltm' });
  await f.finishLoad('b.ltm');
  await f.createRenderer(2);
  assert.equal(f.session.quality, 1);
  f.takeLog();
  await rest(f);
  assert.deepEqual(f.takeLog(), [], 'what came to rest is gone');
  await animate(f, 2, 60);
  assert.deepEqual(new Set(f.takeLog()), new Set(['webgpu draws flood']));
});
