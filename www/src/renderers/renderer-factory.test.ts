import assert from 'node:assert/strict';
import test, { type TestContext } from 'node:test';
import type { Backend, CpuModule } from '../engine/types.js';
import { Photograph } from '../photo/photograph.js';
import { PhotoSession, type SessionSettings } from '../player/photo-session.js';
import { exposed, PLAIN, wanting } from '../player/settings-fakes.js';
import { PhotoError } from '../shared/errors.js';
import { cpuRenderers } from './cpu/cpu-renderer.js';
import type { WorkerPool } from './cpu/worker-pool.js';
import { crewOf, type FakeWorker, photoOf, settle } from './cpu/worker-pool-fakes.js';
import type { Devices, LoadGraphics } from './gpu/devices.js';
import { gpuRenderers } from './gpu/gpu-renderer.js';
import { drawer } from './renderer-factory.js';
import type { CanvasRenderer } from './types.js';

const SETTINGS: SessionSettings = {
  src: 'a.ltm',
  credentials: 'same-origin',
  renderOptions: wanting(['cpu']),
  light: { name: 'flood', torch: null, image: null },
  output: exposed(1),
};

/** Stands in for what of the document is used. */
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

/** Draws with one module for all, by a crew, and by devices. */
const drawerOf = (module: unknown, pool: WorkerPool, devices: Devices) =>
  drawer({
    gpu: async () => gpuRenderers((async () => module) as unknown as LoadGraphics, devices),
    cpu: async () => cpuRenderers(pool),
    cpuModule: async () => module as CpuModule,
  });

/** Devices, which note how many tiles modules have when one is set up. */
function fakeDevices(has: ReadonlySet<number>) {
  const setUps: string[] = [];
  /** Devices that are had once `ask` has no objections. */
  const devicesThat = (ask: (backend: Backend) => Promise<void>) => {
    const lease = async (_: unknown, backend: Backend, software: boolean) => {
      await ask(backend);
      if (backend === 'webgl2' && !software)
        throw new PhotoError('backend-unavailable', 'a program');
      const draw = async () => {
        setUps.push(`${backend} of ${has.size}`);
        return { kernel: 'fake', gamut: 'srgb', render: () => {}, free: () => {} };
      };
      const release = () => released.push(backend);
      return { graphics: { kernel: 'fake', draw }, release };
    };
    return { lease } as unknown as Devices;
  };
  const released: Backend[] = [];
  return { devicesThat, setUps, released };
}

/** A session of a photograph of four tiles, which two workers draw. */
async function playing(t: TestContext, ask = async (_: Backend): Promise<void> => {}) {
  fakeDocument(t);
  const { pool, workers, alive } = crewOf(2);
  const { photo, has, module } = photoOf(4);
  const { devicesThat, setUps, released } = fakeDevices(has);
  const frames: (() => void)[] = [];
  const changes: string[] = [];
  const session = new PhotoSession<CanvasRenderer>(
    {
      open: async () => Photograph.decoded(photo),
      prepare: () => {},
      draw: drawerOf(module, pool, devicesThat(ask)).draw,
      nextFrame: (callback) => frames.push(callback),
      later: () => () => {},
      now: () => 0,
    },
    {
      loadStarted: () => {},
      progress: () => {},
      frameDrawn: () => {},
      qualityChanged: () => {},
      loaded: () => {},
      rendererChanged: () => {},
      backendChanged: (backend) => changes.push(backend),
      backendLost: () => {},
      failed: (error) => changes.push(error.code),
      recovered: () => {},
    },
  );
  session.set(SETTINGS);
  await settle();
  assert.equal(has.size, 0);
  return { session, workers, alive, has, setUps, released, frames, changes };
}

test('frames that wait when the back end is switched are drawn by the new one, and move no tiles', async (t) => {
  const { session, workers, alive, has, setUps, frames, changes } = await playing(t);
  for (const worker of workers) worker.slow = true;
  session.set({ ...SETTINGS, output: exposed(2) });
  frames.shift()?.();
  await settle();
  const waiting = session.renderNow();
  session.set({ ...SETTINGS, renderOptions: wanting(['webgl2']) });
  const during = session.renderNow();
  await settle();
  for (const worker of workers) worker.hurry();
  await settle();
  assert.deepEqual(changes, ['cpu', 'webgl2']);
  assert.equal(await waiting, session.renderer);
  assert.equal(await during, session.renderer);
  await settle();
  assert.deepEqual([has.size, await alive()], [4, 0]);
  assert.deepEqual(setUps, ['webgl2 of 4']);
  assert.equal(workers.length, 2, 'none is started for a frame that nobody sees');
});

test('a picture of a photograph that is replaced in the middle of a frame is not-loaded', async (t) => {
  const { session, workers } = await playing(t);
  for (const worker of workers as FakeWorker[]) worker.slow = true;
  const asked = [session.renderNow(), session.renderNow()].map((picture) =>
    assert.rejects(picture, { code: 'not-loaded' }),
  );
  await settle();
  session.set({ ...SETTINGS, src: null });
  await Promise.all(asked);
});

test('a photograph that the page draws for want of workers says why', async (t) => {
  fakeDocument(t);
  const { pool } = crewOf(2, (worker) => worker.die());
  const { photo, has, module } = photoOf(4);
  const { devicesThat } = fakeDevices(has);
  const { draw } = drawerOf(
    module,
    pool,
    devicesThat(async () => {}),
  );
  const photograph = Photograph.decoded(photo);
  const { signal } = new AbortController();
  for (let time = 0; time < 2; time += 1) {
    const renderer = await draw('cpu', photograph, wanting(['cpu']), () => {}, signal);
    assert.equal(renderer.kernel, 'fake, in the page');
    assert.match(renderer.warning ?? '', /without workers: .*out of memory/);
  }
});

/** Asks for back ends, and answers when the test does. */
function asking() {
  const asked: Backend[] = [];
  let answer = (_: boolean): void => {};
  const ask = (backend: Backend): Promise<void> => {
    asked.push(backend);
    return new Promise((resolve, reject) => {
      const missing = new PhotoError('backend-unavailable', 'there is none');
      answer = (yes) => (yes ? resolve() : reject(missing));
    });
  };
  const answers = async (yes: boolean) => {
    answer(yes);
    await settle();
  };
  return { ask, asked, answers };
}

test('back ends that cannot be had leave tiles with the workers', async (t) => {
  const { ask, asked, answers } = asking();
  const { session, workers, has, changes } = await playing(t, ask);
  session.set({ ...SETTINGS, renderOptions: wanting(['webgpu', 'webgl2', 'cpu']) });
  await settle();
  await answers(false);
  await answers(false);
  await session.renderNow();
  assert.deepEqual(asked, ['webgpu', 'webgl2']);
  assert.deepEqual([has.size, changes], [0, ['cpu']]);
  assert.ok(workers.every(({ log }) => !log.includes('take')));
});

test('a device that is a program is passed over, unless back ends were named', async (t) => {
  const { session, has, changes, setUps, released } = await playing(t);
  const order = wanting(['webgl2', 'cpu']);
  session.set({ ...SETTINGS, renderOptions: { ...order, software: false } });
  await session.renderNow();
  assert.deepEqual([has.size, changes, setUps], [0, ['cpu'], []]);
  session.set({ ...SETTINGS, renderOptions: order });
  await session.renderNow();
  assert.deepEqual([changes, setUps], [['cpu', 'webgl2'], ['webgl2 of 4']]);
  // Nor does it stay once they are not named any more.
  session.set({ ...SETTINGS, renderOptions: { ...order, software: false } });
  await session.renderNow();
  assert.deepEqual(changes, ['cpu', 'webgl2', 'cpu']);
  session.stop();
  assert.deepEqual(released, ['webgl2']);
});

test('back ends that do not answer keep nobody waiting who has given them up, and get nothing', async (t) => {
  const { ask, asked, answers } = asking();
  const { session, workers, setUps } = await playing(t, ask);
  session.set({ ...SETTINGS, renderOptions: wanting(['webgpu']) });
  await settle();
  session.set(SETTINGS);
  assert.equal((await session.renderNow()).kernel, 'fake, 2 workers');
  await answers(true);
  assert.deepEqual([asked, setUps], [['webgpu'], []]);
  assert.ok(workers.every(({ log }) => !log.includes('take')));
});

test('a renderer that was freed draws nothing, and leaves tiles where they are', async (t) => {
  fakeDocument(t);
  const { pool, workers, alive } = crewOf(2);
  const { photo, has, module } = photoOf(4);
  const { devicesThat } = fakeDevices(has);
  const photograph = Photograph.decoded(photo);
  const renderer = await drawerOf(
    module,
    pool,
    devicesThat(async () => {}),
  ).draw('cpu', photograph, SETTINGS.renderOptions, () => {}, new AbortController().signal);
  for (const worker of workers) worker.slow = true;
  const frame = assert.rejects(Promise.resolve(renderer.render(SETTINGS.light, PLAIN, 1)), {
    code: 'internal',
  });
  await settle();
  renderer.free();
  for (const worker of workers) worker.hurry();
  await frame;
  await photograph.withModule(module, () => {});
  await assert.rejects(Promise.resolve(renderer.render(SETTINGS.light, PLAIN, 1)), {
    code: 'internal',
  });
  assert.deepEqual([has.size, await alive()], [4, 0]);
});

/** A drawer on the CPU, whose module comes when the test says. */
function preparing(t: TestContext) {
  fakeDocument(t);
  const { pool, workers, alive } = crewOf(4);
  const { module } = photoOf(4);
  let come = (_: CpuModule): void => {};
  let fail = (_: Error): void => {};
  const cpuModule = new Promise<CpuModule>((resolve, reject) => {
    come = resolve;
    fail = reject;
  });
  const { prepare } = drawer({
    gpu: () => Promise.reject(new PhotoError('backend-unavailable', 'none here')),
    cpu: async () => cpuRenderers(pool),
    cpuModule: () => cpuModule,
  });
  const over = new AbortController();
  const done = prepare({ ...wanting(['webgl2', 'cpu']), software: false }, over.signal);
  return { come: () => come(module as unknown as CpuModule), fail, over, done, workers, alive };
}

test('workers get ready once their module is there, and go home unless there is work', async (t) => {
  const { come, over, done, workers, alive } = preparing(t);
  await settle();
  assert.equal(workers.length, 0);
  come();
  await done;
  assert.equal(workers.length, 2);
  over.abort();
  await settle();
  assert.equal(await alive(), 0);
});

test('no worker gets ready for what is over by then, or has no module', async (t) => {
  const first = preparing(t);
  first.over.abort();
  first.come();
  await first.done;
  const second = preparing(t);
  second.fail(new Error('offline'));
  await second.done;
  assert.equal(first.workers.length + second.workers.length, 0);
});
