import assert from 'node:assert/strict';
import test from 'node:test';
import type { Backend, Photo } from './engine.js';
import { PhotoError } from './errors.js';
import { type Drawing, Player, type Settings } from './player.js';

const SETTINGS: Settings = {
  src: 'a.ltm',
  backends: ['webgpu', 'cpu'],
  light: { name: 'flood', torch: null },
  exposure: 1,
};

/** Lets every promise that can settle do so. */
const settle = () => new Promise((resolve) => setImmediate(resolve));

/** A world in which each load and each set-up of a back end waits for the test. */
function world() {
  const log: string[] = [];
  const opens = new Map<string, { resolve(): void; reject(error: Error): void }>();
  const draws: { backend: Backend; resolve(): void; reject(error: Error): void }[] = [];
  const losses: ((reason: string) => void)[] = [];
  const frames: (() => void)[] = [];
  let lostAtRender = false;
  const player = new Player<Drawing>(
    {
      open: (src, signal) =>
        new Promise((resolve, reject) => {
          signal.addEventListener('abort', () => log.push(`abort ${src}`));
          opens.set(src, {
            resolve: () => resolve({ free: () => log.push(`free ${src}`) } as unknown as Photo),
            reject,
          });
        }),
      draw: (backend, _, lost) =>
        new Promise((resolve, reject) => {
          const drawing: Drawing = {
            kernel: 'fake',
            render: ({ name }) => {
              if (lostAtRender) throw new PhotoError('backend-lost', 'the device is gone.');
              log.push(`${backend} draws ${name}`);
            },
            free: () => log.push(`free ${backend}`),
          };
          losses.push(lost);
          draws.push({ backend, resolve: () => resolve(drawing), reject });
        }),
      nextFrame: (callback) => frames.push(callback),
    },
    {
      loading: () => log.push('loading'),
      progress: () => {},
      loaded: () => log.push('loaded'),
      backendChanged: (_, backend, previous, reason) =>
        log.push(`backend ${previous} -> ${backend}${reason && ` (${reason})`}`),
      failed: (error) => log.push(`failed ${error.code}: ${error.message}`),
      recovered: () => log.push('recovered'),
    },
  );
  return {
    player,
    log,
    draws,
    losses,
    frames,
    /** What happened since the last call. */
    happened: () => log.splice(0),
    async opened(src: string) {
      opens.get(src)?.resolve();
      await settle();
    },
    async openFails(src: string, error: Error) {
      opens.get(src)?.reject(error);
      await settle();
    },
    async drawn(index: number) {
      draws[index]?.resolve();
      await settle();
    },
    async drawFails(index: number, message: string) {
      draws[index]?.reject(new PhotoError('backend-unavailable', message));
      await settle();
    },
    loseAtRender(lost: boolean) {
      lostAtRender = lost;
    },
  };
}

async function loadedWorld(settings = SETTINGS) {
  const w = world();
  w.player.set(settings);
  await w.opened('a.ltm');
  await w.drawn(0);
  w.happened();
  return w;
}

test('a photograph is loaded, given a back end, drawn', async () => {
  const w = world();
  w.player.set(SETTINGS);
  await w.opened('a.ltm');
  await w.drawn(0);
  assert.deepEqual(w.happened(), [
    'loading',
    'backend null -> webgpu',
    'webgpu draws flood',
    'loaded',
  ]);
});

test('another address in the middle of a load aborts it, and only the new one shows', async () => {
  const w = world();
  w.player.set(SETTINGS);
  w.player.set({ ...SETTINGS, src: 'b.ltm' });
  // The old load may still succeed, late.
  await w.opened('a.ltm');
  await w.opened('b.ltm');
  await w.drawn(0);
  assert.deepEqual(w.happened(), [
    'loading',
    'abort a.ltm',
    'loading',
    'free a.ltm',
    'backend null -> webgpu',
    'webgpu draws flood',
    'loaded',
  ]);
});

test('a removed photograph is freed, its drawing first', async () => {
  const w = await loadedWorld();
  w.player.stop();
  assert.deepEqual(w.happened(), ['free webgpu', 'free a.ltm']);
  w.player.set(SETTINGS);
  assert.deepEqual(w.happened(), ['loading']);
});

test('a photograph removed while a back end is being set up is freed once that is done', async () => {
  const w = world();
  w.player.set(SETTINGS);
  await w.opened('a.ltm');
  w.player.stop();
  assert.deepEqual(w.happened(), ['loading']);
  await w.drawn(0);
  assert.deepEqual(w.happened(), ['free webgpu', 'free a.ltm']);
});

test('changes of one frame are drawn once', async () => {
  const w = await loadedWorld();
  w.player.set({ ...SETTINGS, light: { name: 'torch', torch: { x: 0, y: 0 } } });
  w.player.set({ ...SETTINGS, light: { name: 'torch', torch: { x: 1, y: 0 } } });
  assert.equal(w.frames.length, 1);
  w.frames[0]?.();
  assert.deepEqual(w.happened(), ['webgpu draws torch']);
});

test('a back end that cannot be had is passed over with its reason', async () => {
  const w = world();
  w.player.set(SETTINGS);
  await w.opened('a.ltm');
  await w.drawFails(0, 'no adapter');
  await w.drawn(1);
  assert.deepEqual(w.happened().slice(1), [
    'backend null -> cpu (WebGPU: no adapter.)',
    'cpu draws flood',
    'loaded',
  ]);
});

test('no back end at all fails, and another order is tried when it comes', async () => {
  const w = world();
  w.player.set({ ...SETTINGS, backends: ['webgpu'] });
  await w.opened('a.ltm');
  await w.drawFails(0, 'no adapter');
  assert.match(w.happened()[1] ?? '', /^failed backend-unavailable: .*WebGPU: no adapter\./);
  w.player.set({ ...SETTINGS, backends: ['cpu'] });
  await w.drawn(1);
  assert.deepEqual(w.happened(), ['backend null -> cpu', 'cpu draws flood', 'recovered', 'loaded']);
});

test('another order changes the back end; the photograph is not loaded again', async () => {
  const w = await loadedWorld();
  w.player.set({ ...SETTINGS, backends: ['cpu'] });
  await w.drawn(1);
  assert.deepEqual(w.happened(), ['free webgpu', 'backend webgpu -> cpu', 'cpu draws flood']);
  // One that begins with the back end in use leaves it alone.
  w.player.set({ ...SETTINGS, backends: ['cpu', 'webgpu'] });
  await settle();
  assert.deepEqual(w.happened(), ['cpu draws flood']);
});

test('the last of two quick changes of order wins', async () => {
  const w = await loadedWorld();
  w.player.set({ ...SETTINGS, backends: ['webgl2'] });
  w.player.set({ ...SETTINGS, backends: ['cpu'] });
  await w.drawn(2);
  await w.drawn(1);
  assert.deepEqual(w.happened(), [
    'free webgpu',
    'backend webgpu -> cpu',
    'cpu draws flood',
    'free webgl2',
  ]);
});

for (const how of ['by the browser', 'at the next drawing']) {
  test(`a back end lost ${how} is replaced by the next`, async () => {
    const w = await loadedWorld();
    if (how === 'by the browser') {
      w.losses[0]?.('the device is gone.');
    } else {
      w.loseAtRender(true);
      w.player.set({ ...SETTINGS, exposure: 2 });
      w.frames[0]?.();
      w.loseAtRender(false);
    }
    await w.drawn(1);
    assert.deepEqual(w.happened(), [
      'free webgpu',
      'backend webgpu -> cpu (WebGPU was lost: the device is gone.)',
      'cpu draws flood',
    ]);
  });
}

test('a back end lost while another is looked for does not end that search', async () => {
  const w = await loadedWorld({ ...SETTINGS, backends: ['webgl2'] });
  w.player.set({ ...SETTINGS, backends: ['webgpu', 'webgl2', 'cpu'] });
  w.losses[0]?.('the browser took it away.');
  assert.deepEqual(w.happened(), []);
  await w.drawn(1);
  assert.deepEqual(w.happened(), ['free webgl2', 'backend webgl2 -> webgpu', 'webgpu draws flood']);
});

test('a back end lost while another is looked for is set up anew when its turn comes', async () => {
  const w = await loadedWorld({ ...SETTINGS, backends: ['webgl2'] });
  w.player.set({ ...SETTINGS, backends: ['webgpu', 'webgl2', 'cpu'] });
  w.losses[0]?.('the browser took it away.');
  await w.drawFails(1, 'no adapter');
  await w.drawn(2);
  assert.deepEqual(w.happened(), [
    'free webgl2',
    'backend webgl2 -> webgl2 (WebGPU: no adapter.)',
    'webgl2 draws flood',
  ]);
});

test('a back end lost while it is being set up is passed over with its reason', async () => {
  const w = world();
  w.player.set(SETTINGS);
  await w.opened('a.ltm');
  w.losses[0]?.('the device is gone.');
  await w.drawn(0);
  await w.drawn(1);
  assert.deepEqual(w.happened(), [
    'loading',
    'free webgpu',
    'backend null -> cpu (WebGPU: it was lost while it was being set up: the device is gone.)',
    'cpu draws flood',
    'loaded',
  ]);
});

test('a back end lost at any moment after it was set up is replaced, and freed once', async () => {
  for (let ticks = 0; ticks < 10; ticks += 1) {
    const w = world();
    w.player.set(SETTINGS);
    await w.opened('a.ltm');
    w.draws[0]?.resolve();
    for (let tick = 0; tick < ticks; tick += 1) await Promise.resolve();
    w.losses[0]?.('the device is gone.');
    await settle();
    await w.drawn(1);
    const happened = w.happened();
    const lasting = happened.filter((line) => /^free|^failed|^cpu|loaded/.test(line));
    const expected = ['free webgpu', 'cpu draws flood', 'loaded'];
    assert.deepEqual(lasting.sort(), expected.sort(), `after ${ticks} ticks`);
    const reasons = happened.filter((line) => line.startsWith('backend'));
    assert.match(reasons.at(-1) ?? '', /-> cpu \(WebGPU.* lost.*: the device is gone\.\)/);
    assert.equal(w.player.backend, 'cpu');
  }
});

test('the last back end lost is backend-lost', async () => {
  const w = await loadedWorld({ ...SETTINGS, backends: ['webgpu'] });
  w.losses[0]?.('the device is gone.');
  const [freed, failed] = w.happened();
  assert.equal(freed, 'free webgpu');
  assert.match(failed ?? '', /^failed backend-lost: WebGPU was lost: the device is gone\./);
  assert.throws(() => w.player.renderNow(), { code: 'not-loaded' });
});

test('a load that fails says so, and the same address can be tried again', async () => {
  const w = world();
  w.player.set(SETTINGS);
  await w.openFails('a.ltm', new PhotoError('http-status', 'the server answered 404'));
  assert.deepEqual(w.happened(), ['loading', 'failed http-status: the server answered 404']);
  w.player.set(SETTINGS, true);
  await w.opened('a.ltm');
  await w.drawn(0);
  assert.equal(w.happened().at(-1), 'loaded');
});

test('no address is src-missing', () => {
  const w = world();
  w.player.set({ ...SETTINGS, src: null });
  assert.match(w.happened()[1] ?? '', /^failed src-missing/);
});
