import assert from 'node:assert/strict';
import test, { type TestContext } from 'node:test';
import type { Backend, CpuModule } from '../engine/wasm-exports.js';
import { LoadedPhotograph } from '../photo/photograph.js';
import { fakePhoto } from '../photo/photograph-fakes.js';
import { RefCounted } from '../photo/ref-counted.js';
import { PhotoSession } from '../player/photo-session.js';
import type { SessionSettings } from '../player/types.js';
import { PhotoError } from '../shared/errors.js';
import { cpuRenderers } from './cpu/create-cpu-renderer.js';
import type { WorkerPool } from './cpu/worker-pool.js';
import { type FakeWorker, fakePool, settle } from './cpu/worker-pool-fakes.js';
import { gpuRenderers } from './gpu/create-gpu-renderer.js';
import type { Devices, LoadGraphics } from './gpu/devices.js';
import { rendererFactory } from './renderer-factory.js';
import { PLAIN, withBackends, withExposure } from './settings-fakes.js';
import type { BackendPreferences } from './types.js';

const SETTINGS: SessionSettings = {
  src: 'a.ltm',
  credentials: 'same-origin',
  backendOptions: withBackends(['cpu']),
  light: { name: 'flood', torch: null, image: null },
  output: withExposure(1),
};

/** Replaces the document. */
function fakeDocument(t: TestContext): void {
  const newCanvas = () => {
    const canvas = {
      width: 0,
      height: 0,
      addEventListener: () => {},
      getContext: () => ({ canvas, putImageData: () => {} }),
    };
    return canvas;
  };
  const fakes = { document: { createElement: newCanvas }, ImageData: class {} };
  Object.assign(globalThis, fakes);
  t.after(() => {
    for (const name of Object.keys(fakes)) Reflect.deleteProperty(globalThis, name);
  });
}

/** A factory with one module for all backends. */
const factoryFor = (module: unknown, pool: WorkerPool, devices: Devices) =>
  rendererFactory({
    gpu: async () => gpuRenderers((async () => module) as unknown as LoadGraphics, devices),
    cpu: async () => cpuRenderers(pool),
    cpuModule: async () => module as CpuModule,
  });

/** Devices that log how many tiles are in modules when a renderer is created. */
function fakeDevices(tilesInModules: ReadonlySet<number>) {
  const created: string[] = [];
  /** Devices that are available once `open` resolves. WebGL2 is a software renderer. */
  const createDevices = (open: (backend: Backend) => Promise<void>) => {
    const lease = async (_: unknown, backend: Backend, { software }: BackendPreferences) => {
      await open(backend);
      if (backend === 'webgl2' && !software)
        throw new PhotoError('backend-unavailable', 'a software renderer');
      const draw = async () => {
        created.push(`${backend} of ${tilesInModules.size}`);
        return { kernel: 'fake', gamut: 'srgb', render: () => {}, free: () => {} };
      };
      const release = () => released.push(backend);
      return { graphics: { kernel: 'fake', draw }, release };
    };
    return { lease } as unknown as Devices;
  };
  const released: Backend[] = [];
  return { createDevices, created, released };
}

/** A session of a photograph of four tiles, which two workers draw. */
async function startSession(t: TestContext, open = async (_: Backend): Promise<void> => {}) {
  fakeDocument(t);
  const { pool, workers, countAlive } = fakePool(2);
  const { photo, tilesInModules, module } = fakePhoto(4);
  const { createDevices, created, released } = fakeDevices(tilesInModules);
  const frames: (() => void)[] = [];
  const changes: string[] = [];
  const session = new PhotoSession(
    {
      library: {
        open: async () => new RefCounted(LoadedPhotograph.fromModule(photo)),
        update: () => {},
      },
      copyCanvas: ({ canvas }) => canvas,
      prepare: () => {},
      createRenderer: factoryFor(module, pool, createDevices(open)).createRenderer,
      nextFrame: (callback) => frames.push(callback),
      callLater: () => () => {},
      now: () => 0,
    },
    {
      placement: 0,
      loadStarted: () => {},
      progress: () => {},
      frameDrawn: () => {},
      qualityChanged: () => {},
      loaded: () => {},
      rendererChanged: () => {},
      backendChanged: (backend) => changes.push(backend),
      backendLost: () => {},
      failed: (error) => changes.push(error.code),
      warned: (error) => changes.push(error.code),
      recovered: () => {},
    },
  );
  session.set(SETTINGS);
  await settle();
  assert.equal(tilesInModules.size, 0);
  return { session, workers, countAlive, tilesInModules, created, released, frames, changes };
}

test('frames that wait during a change of the backend are drawn by the new one, and move no tiles', async (t) => {
  const { session, workers, countAlive, tilesInModules, created, frames, changes } =
    await startSession(t);
  for (const worker of workers) worker.isSlow = true;
  session.set({ ...SETTINGS, output: withExposure(2) });
  frames.shift()?.();
  await settle();
  const waiting = session.renderNow();
  session.set({ ...SETTINGS, backendOptions: withBackends(['webgl2']) });
  const during = session.renderNow();
  await settle();
  for (const worker of workers) worker.catchUp();
  await settle();
  assert.deepEqual(changes, ['cpu', 'webgl2']);
  assert.equal(await waiting, session.renderer);
  assert.equal(await during, session.renderer);
  await settle();
  assert.deepEqual([tilesInModules.size, await countAlive()], [4, 0]);
  assert.deepEqual(created, ['webgl2 of 4']);
  assert.equal(workers.length, 2, 'none is started for a frame that nobody sees');
});

test('renderNow rejects with not-loaded if the photograph is replaced during a frame', async (t) => {
  const { session, workers } = await startSession(t);
  for (const worker of workers as FakeWorker[]) worker.isSlow = true;
  const asked = [session.renderNow(), session.renderNow()].map((picture) =>
    assert.rejects(picture, { code: 'not-loaded' }),
  );
  await settle();
  session.set({ ...SETTINGS, src: null });
  await Promise.all(asked);
});

test("a renderer on the page's thread says why there are no workers", async (t) => {
  fakeDocument(t);
  const { pool } = fakePool(2, (worker) => worker.crash());
  const { photo, tilesInModules, module } = fakePhoto(4);
  const { createDevices } = fakeDevices(tilesInModules);
  const { createRenderer } = factoryFor(
    module,
    pool,
    createDevices(async () => {}),
  );
  const photograph = LoadedPhotograph.fromModule(photo);
  const { signal } = new AbortController();
  for (let time = 0; time < 2; time += 1) {
    const renderer = await createRenderer(
      'cpu',
      photograph,
      withBackends(['cpu']),
      () => {},
      signal,
    );
    assert.equal(renderer.kernel, 'fake, on the page');
    assert.match(renderer.warning ?? '', /without workers: .*out of memory/);
  }
});

/** Opens devices when the test answers. */
function openingDevices() {
  const requested: Backend[] = [];
  let answer = (_: boolean): void => {};
  const open = (backend: Backend): Promise<void> => {
    requested.push(backend);
    return new Promise((resolve, reject) => {
      const missing = new PhotoError('backend-unavailable', 'there is none');
      answer = (yes) => (yes ? resolve() : reject(missing));
    });
  };
  const answers = async (yes: boolean) => {
    answer(yes);
    await settle();
  };
  return { open, requested, answers };
}

test('unavailable backends leave the tiles in the workers', async (t) => {
  const { open, requested, answers } = openingDevices();
  const { session, workers, tilesInModules, changes } = await startSession(t, open);
  session.set({ ...SETTINGS, backendOptions: withBackends(['webgpu', 'webgl2', 'cpu']) });
  await settle();
  await answers(false);
  await answers(false);
  await session.renderNow();
  assert.deepEqual(requested, ['webgpu', 'webgl2']);
  assert.deepEqual([tilesInModules.size, changes], [0, ['cpu']]);
  assert.ok(workers.every(({ log }) => !log.includes('take')));
});

test('a software renderer is skipped unless the page names backends', async (t) => {
  const { session, tilesInModules, changes, created, released } = await startSession(t);
  const order = withBackends(['webgl2', 'cpu']);
  session.set({ ...SETTINGS, backendOptions: { ...order, software: false } });
  await session.renderNow();
  assert.deepEqual([tilesInModules.size, changes, created], [0, ['cpu'], []]);
  session.set({ ...SETTINGS, backendOptions: order });
  await session.renderNow();
  assert.deepEqual([changes, created], [['cpu', 'webgl2'], ['webgl2 of 4']]);
  // It is replaced once the page names none any more.
  session.set({ ...SETTINGS, backendOptions: { ...order, software: false } });
  await session.renderNow();
  assert.deepEqual(changes, ['cpu', 'webgl2', 'cpu']);
  session.stop();
  assert.deepEqual(released, ['webgl2']);
});

test('a backend that does not answer does not delay the next choice, and gets no tiles', async (t) => {
  const { open, requested, answers } = openingDevices();
  const { session, workers, created } = await startSession(t, open);
  session.set({ ...SETTINGS, backendOptions: withBackends(['webgpu']) });
  await settle();
  session.set(SETTINGS);
  assert.equal((await session.renderNow()).kernel, 'fake, 2 workers');
  await answers(true);
  assert.deepEqual([requested, created], [['webgpu'], []]);
  assert.ok(workers.every(({ log }) => !log.includes('take')));
});

test('a freed renderer rejects and moves no tiles', async (t) => {
  fakeDocument(t);
  const { pool, workers, countAlive } = fakePool(2);
  const { photo, tilesInModules, module } = fakePhoto(4);
  const { createDevices } = fakeDevices(tilesInModules);
  const photograph = LoadedPhotograph.fromModule(photo);
  const renderer = await factoryFor(
    module,
    pool,
    createDevices(async () => {}),
  ).createRenderer(
    'cpu',
    photograph,
    SETTINGS.backendOptions,
    () => {},
    new AbortController().signal,
  );
  for (const worker of workers) worker.isSlow = true;
  const frame = assert.rejects(Promise.resolve(renderer.render(SETTINGS.light, PLAIN, 1)), {
    code: 'internal',
  });
  await settle();
  renderer.free();
  for (const worker of workers) worker.catchUp();
  await frame;
  await photograph.withModule(module, () => {});
  await assert.rejects(Promise.resolve(renderer.render(SETTINGS.light, PLAIN, 1)), {
    code: 'internal',
  });
  assert.deepEqual([tilesInModules.size, await countAlive()], [4, 0]);
});

/** A factory that warms up the CPU; its module loads when the test says. */
function warmingUp(t: TestContext) {
  fakeDocument(t);
  const { pool, workers, countAlive } = fakePool(4);
  const { module } = fakePhoto(4);
  let loaded = (_: CpuModule): void => {};
  let fail = (_: Error): void => {};
  const cpuModule = new Promise<CpuModule>((resolve, reject) => {
    loaded = resolve;
    fail = reject;
  });
  const { prepare } = rendererFactory({
    gpu: () => Promise.reject(new PhotoError('backend-unavailable', 'none here')),
    cpu: async () => cpuRenderers(pool),
    cpuModule: () => cpuModule,
  });
  const abort = new AbortController();
  const done = prepare({ ...withBackends(['webgl2', 'cpu']), software: false }, abort.signal);
  return { load: () => loaded(module), fail, abort, done, workers, countAlive };
}

test('workers start once their module is loaded, and end if there is no photograph', async (t) => {
  const { load, abort, done, workers, countAlive } = warmingUp(t);
  await settle();
  assert.equal(workers.length, 0);
  load();
  await done;
  assert.equal(workers.length, 2);
  abort.abort();
  await settle();
  assert.equal(await countAlive(), 0);
});

test('no worker starts after an abort, or without a module', async (t) => {
  const first = warmingUp(t);
  first.abort.abort();
  first.load();
  await first.done;
  const second = warmingUp(t);
  second.fail(new Error('offline'));
  await second.done;
  assert.equal(first.workers.length + second.workers.length, 0);
});
