import assert from 'node:assert/strict';
import test from 'node:test';
import type { Backend } from '../engine/types.js';
import type { ImageLight } from '../lights/image-light.js';
import type { Photograph } from '../photo/photograph.js';
import type { Renderer } from '../renderers/types.js';
import { PhotoError } from '../shared/errors.js';
import { PhotoSession, type SessionSettings } from './photo-session.js';
import { exposed, wanting } from './settings-fakes.js';

const SETTINGS: SessionSettings = {
  src: 'a.ltm',
  credentials: 'same-origin',
  renderOptions: wanting(['webgpu', 'cpu']),
  light: { name: 'flood', torch: null, image: null },
  output: exposed(1),
};

/** Lets every promise that can settle do so. */
const settle = () => new Promise((resolve) => setImmediate(resolve));

/** A world in which each load and each set-up of a back end waits for the test. */
function world() {
  const log: string[] = [];
  /** Back ends that were lost, and why. */
  const losing: string[] = [];
  const opens = new Map<
    string,
    { preview(share: number): void; resolve(): void; reject(error: Error): void }
  >();
  const draws: { backend: Backend; resolve(): void; reject(error: Error): void }[] = [];
  const losses: ((reason: string) => void)[] = [];
  const frames: (() => void)[] = [];
  const timers = new Map<() => void, number>();
  let now = 0;
  /** What a frame in full detail takes that is drawn at once. */
  let cost = 0;
  let lostAtRender = false;
  let lightFault: PhotoError | null = null;
  /** Ends frames that take time, in order; null while all are drawn at once. */
  let slow: { done(fault?: PhotoError | null): void; fail(error: Error): void }[] | null = null;
  const session = new PhotoSession<Renderer>(
    {
      open: (src, _credentials, signal, _, onPreview) =>
        new Promise((resolve, reject) => {
          signal.addEventListener('abort', () => log.push(`abort ${src}`));
          opens.set(src, {
            preview: (share) =>
              onPreview?.({
                share,
                free: () => log.push(`free ${share} of ${src}`),
              } as unknown as Photograph),
            resolve: () =>
              resolve({ share: 1, free: () => log.push(`free ${src}`) } as unknown as Photograph),
            reject,
          });
        }),
      prepare: () => {},
      draw: (backend, _photo, renderOptions, lost) =>
        new Promise((resolve, reject) => {
          const renderer: Renderer = {
            kernel: 'fake',
            gamut: renderOptions.gamut,
            render: ({ name }, _look, detail) => {
              if (lostAtRender) throw new PhotoError('backend-lost', 'the device is gone.');
              log.push(`${backend} draws ${name}${detail < 1 ? ` by ${detail}` : ''}`);
              now += cost * detail;
              const frames = slow;
              return frames
                ? new Promise((done, fail) =>
                    frames.push({
                      done: (fault = null) => done({ lightApplied: !fault, lightError: fault }),
                      fail,
                    }),
                  )
                : { lightApplied: !lightFault, lightError: lightFault };
            },
            free: () => log.push(`free ${backend}`),
          };
          losses.push(lost);
          draws.push({ backend, resolve: () => resolve(renderer), reject });
        }),
      nextFrame: (callback) => frames.push(callback),
      later: (ms, callback) => {
        timers.set(callback, now + ms);
        return () => timers.delete(callback);
      },
      now: () => now,
    },
    {
      loadStarted: () => log.push('loading'),
      progress: () => {},
      frameDrawn: ({ lightError }) =>
        lightError && log.push(`not that light: ${lightError.message}`),
      qualityChanged: (detail) => log.push(`detail ${detail}`),
      loaded: () => log.push('loaded'),
      rendererChanged: () => {},
      backendLost: (backend, reason) => losing.push(`${backend}: ${reason}`),
      backendChanged: (backend, previous, reason) =>
        log.push(`backend ${previous} -> ${backend}${reason && ` (${reason})`}`),
      failed: (error) => log.push(`failed ${error.code}: ${error.message}`),
      recovered: () => log.push('recovered'),
    },
  );
  return {
    session,
    log,
    losing,
    draws,
    losses,
    frames,
    /** What happened since the last call. */
    happened: () => log.splice(0),
    async opened(src: string) {
      opens.get(src)?.resolve();
      await settle();
    },
    async previewed(src: string, share: number) {
      opens.get(src)?.preview(share);
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
    async drawLost(index: number, message: string) {
      draws[index]?.reject(new PhotoError('photo-lost', message));
      await settle();
    },
    /** Frames take time from now on. */
    slowDown() {
      slow = [];
      return slow;
    },
    /** The browser is about to draw; the page's own scripts had their turn before. */
    async frame(page = () => {}) {
      const callbacks = frames.splice(0);
      page();
      for (const callback of callbacks) callback();
      await settle();
    },
    /** Time goes by. */
    async pass(ms: number) {
      now += ms;
      for (const [callback, at] of timers) {
        if (at <= now && timers.delete(callback)) callback();
      }
      await settle();
    },
    /** Frames in full detail keep the page busy for so long from now on. */
    spend(ms: number) {
      cost = ms;
    },
    /** Lights cannot be had from now on, or can again. */
    spoilLights(fault: PhotoError | null) {
      lightFault = fault;
    },
    loseAtRender(lost: boolean) {
      lostAtRender = lost;
    },
  };
}

async function loadedWorld(settings = SETTINGS) {
  const w = world();
  w.session.set(settings);
  await w.opened('a.ltm');
  await w.drawn(0);
  w.happened();
  return w;
}

test('a photograph is loaded, given a back end, drawn', async () => {
  const w = world();
  w.session.set(SETTINGS);
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
  w.session.set(SETTINGS);
  w.session.set({ ...SETTINGS, src: 'b.ltm' });
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

test('a removed photograph is freed, its renderer first', async () => {
  const w = await loadedWorld();
  w.session.stop();
  assert.deepEqual(w.happened(), ['free webgpu', 'free a.ltm']);
  w.session.set(SETTINGS);
  assert.deepEqual(w.happened(), ['loading']);
});

test('a photograph removed while a back end is being set up is freed once that is done', async () => {
  const w = world();
  w.session.set(SETTINGS);
  await w.opened('a.ltm');
  w.session.stop();
  assert.deepEqual(w.happened(), ['loading']);
  await w.drawn(0);
  assert.deepEqual(w.happened(), ['free webgpu', 'free a.ltm']);
});

test('changes of one frame are drawn once', async () => {
  const w = await loadedWorld();
  w.session.set({ ...SETTINGS, light: { name: 'torch', torch: { x: 0, y: 0 }, image: null } });
  w.session.set({ ...SETTINGS, light: { name: 'torch', torch: { x: 1, y: 0 }, image: null } });
  assert.equal(w.frames.length, 1);
  w.frames[0]?.();
  assert.deepEqual(w.happened(), ['webgpu draws torch']);
});

test('a back end that cannot be had is passed over with its reason', async () => {
  const w = world();
  w.session.set(SETTINGS);
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
  w.session.set({ ...SETTINGS, renderOptions: wanting(['webgpu']) });
  await w.opened('a.ltm');
  await w.drawFails(0, 'no adapter');
  assert.match(w.happened()[1] ?? '', /^failed backend-unavailable: .*WebGPU: no adapter\./);
  w.session.set({ ...SETTINGS, renderOptions: wanting(['cpu']) });
  await w.drawn(1);
  assert.deepEqual(w.happened(), ['backend null -> cpu', 'cpu draws flood', 'recovered', 'loaded']);
});

test('another order changes the back end; the photograph is not loaded again', async () => {
  const w = await loadedWorld();
  w.session.set({ ...SETTINGS, renderOptions: wanting(['cpu']) });
  await w.drawn(1);
  assert.deepEqual(w.happened(), ['backend webgpu -> cpu', 'cpu draws flood', 'free webgpu']);
  // One that begins with the back end in use leaves it alone.
  w.session.set({ ...SETTINGS, renderOptions: wanting(['cpu', 'webgpu']) });
  await settle();
  assert.deepEqual(w.happened(), ['cpu draws flood']);
});

test('the last of two quick changes of order wins', async () => {
  const w = await loadedWorld();
  w.session.set({ ...SETTINGS, renderOptions: wanting(['webgl2']) });
  w.session.set({ ...SETTINGS, renderOptions: wanting(['cpu']) });
  await w.drawn(2);
  await w.drawn(1);
  assert.deepEqual(w.happened(), [
    'backend webgpu -> cpu',
    'cpu draws flood',
    'free webgpu',
    'free webgl2',
  ]);
});

for (const how of ['by the browser', 'at the next renderer']) {
  test(`a back end lost ${how} is set up anew`, async () => {
    const w = await loadedWorld();
    if (how === 'by the browser') {
      w.losses[0]?.('the device is gone.');
    } else {
      w.loseAtRender(true);
      w.session.set({ ...SETTINGS, output: exposed(2) });
      await w.frame();
      w.loseAtRender(false);
    }
    await w.drawn(1);
    assert.deepEqual(w.happened(), [
      'free webgpu',
      'backend webgpu -> webgpu (WebGPU was lost: the device is gone.)',
      'webgpu draws flood',
    ]);
  });
}

test('a back end lost that cannot be had any more is replaced by the next', async () => {
  const w = await loadedWorld();
  w.losses[0]?.('the device is gone.');
  await w.drawFails(1, 'it was lost 3 times');
  await w.drawn(2);
  assert.deepEqual(w.happened(), [
    'free webgpu',
    'backend webgpu -> cpu (WebGPU was lost: the device is gone. WebGPU: it was lost 3 times.)',
    'cpu draws flood',
  ]);
});

test('a back end that draws nothing before it is lost is not tried again', async () => {
  const w = world();
  w.session.set(SETTINGS);
  await w.opened('a.ltm');
  w.loseAtRender(true);
  await w.drawn(0);
  w.loseAtRender(false);
  await w.drawn(1);
  assert.deepEqual(w.happened(), [
    'loading',
    'backend null -> webgpu',
    'free webgpu',
    'backend webgpu -> cpu (WebGPU was lost: the device is gone.)',
    'cpu draws flood',
    'loaded',
  ]);
});

test('a back end lost while another is looked for does not end that search', async () => {
  const w = await loadedWorld({ ...SETTINGS, renderOptions: wanting(['webgl2']) });
  w.session.set({ ...SETTINGS, renderOptions: wanting(['webgpu', 'webgl2', 'cpu']) });
  w.losses[0]?.('the browser took it away.');
  assert.deepEqual(w.happened(), []);
  await w.drawn(1);
  assert.deepEqual(w.happened(), ['free webgl2', 'backend webgl2 -> webgpu', 'webgpu draws flood']);
});

test('a back end lost while another is looked for is set up anew when its turn comes', async () => {
  const w = await loadedWorld({ ...SETTINGS, renderOptions: wanting(['webgl2']) });
  w.session.set({ ...SETTINGS, renderOptions: wanting(['webgpu', 'webgl2', 'cpu']) });
  w.losses[0]?.('the browser took it away.');
  await w.drawFails(1, 'no adapter');
  await w.drawn(2);
  assert.deepEqual(w.happened(), [
    'free webgl2',
    'backend webgl2 -> webgl2 (WebGPU: no adapter.)',
    'webgl2 draws flood',
  ]);
});

test('the loss of a back end in use is told once, and another gamut is no other back end', async () => {
  const w = await loadedWorld({ ...SETTINGS, renderOptions: wanting(['webgl2']) });
  w.session.set({ ...SETTINGS, renderOptions: { ...wanting(['webgl2']), gamut: 'display-p3' } });
  await w.drawn(1);
  assert.deepEqual(w.happened(), ['webgl2 draws flood', 'free webgl2']);
  assert.deepEqual(w.losing, []);
  w.losses[1]?.('the browser took it away.');
  w.losses[1]?.('the browser took it away.');
  assert.deepEqual(w.losing, ['webgl2: the browser took it away.']);
});

test('a back end lost while it is being set up is passed over with its reason', async () => {
  const w = world();
  w.session.set(SETTINGS);
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

test('a back end that cannot be set up as it was lost says that', async () => {
  const w = world();
  w.session.set(SETTINGS);
  await w.opened('a.ltm');
  w.losses[0]?.('the device is gone.');
  await w.drawFails(0, 'null pointer passed to rust');
  await w.drawn(1);
  assert.match(
    w.happened().join(),
    /WebGPU: it was lost while it was being set up: the device is gone/,
  );
});

test('a back end lost at any moment after it was set up is replaced, and freed once', async () => {
  for (let ticks = 0; ticks < 10; ticks += 1) {
    const w = world();
    w.session.set(SETTINGS);
    await w.opened('a.ltm');
    w.draws[0]?.resolve();
    for (let tick = 0; tick < ticks; tick += 1) await Promise.resolve();
    w.losses[0]?.('the device is gone.');
    await settle();
    // Where it had drawn, it is tried again.
    if (w.draws[1]?.backend === 'webgpu') await w.drawFails(1, 'it is gone');
    await w.drawn(w.draws.length - 1);
    const happened = w.happened();
    const lasting = happened.filter((line) => /^free|^failed|^cpu|loaded/.test(line));
    const expected = ['free webgpu', 'cpu draws flood', 'loaded'];
    assert.deepEqual(lasting.sort(), expected.sort(), `after ${ticks} ticks`);
    const reasons = happened.filter((line) => line.startsWith('backend'));
    assert.match(reasons.at(-1) ?? '', /-> cpu \(WebGPU.* lost.*: the device is gone\./);
    assert.equal(w.session.backend, 'cpu');
  }
});

test('the last back end lost says so, and what came of the next try', async () => {
  const w = await loadedWorld({ ...SETTINGS, renderOptions: wanting(['webgpu']) });
  w.losses[0]?.('the device is gone.');
  await w.drawFails(1, 'no adapter');
  const [freed, failed] = w.happened();
  assert.equal(freed, 'free webgpu');
  assert.match(
    failed ?? '',
    /^failed backend-unavailable: WebGPU was lost: the device is gone\..* WebGPU: no adapter\./,
  );
  await assert.rejects(w.session.renderNow(), { code: 'not-loaded' });
});

test('of settings that come faster than frames, the newest is drawn next', async () => {
  const w = await loadedWorld();
  const frames = w.slowDown();
  for (const name of ['torch', 'fire', 'stripes'] as const) {
    w.session.set({ ...SETTINGS, light: { name, torch: null, image: null } });
    await w.frame();
  }
  assert.deepEqual(w.happened(), ['webgpu draws torch']);
  // At once, without another frame of the browser's.
  frames[0]?.done();
  await settle();
  assert.deepEqual(w.happened(), ['webgpu draws stripes']);
  frames[1]?.done();
  await settle();
  assert.deepEqual(w.happened(), []);
});

test('a picture that is asked for is the next, however many frames are asked for', async () => {
  const w = await loadedWorld();
  const frames = w.slowDown();
  const light = (name: 'torch' | 'fire' | 'stripes') => {
    w.session.set({ ...SETTINGS, light: { name, torch: null, image: null } });
    return w.frame();
  };
  await light('torch');
  let given = false;
  const asked = w.session.renderNow().then(() => {
    given = true;
  });
  await light('fire');
  frames[0]?.done();
  await settle();
  await light('stripes');
  assert.equal(given, false, 'that frame was older than the question');
  frames[1]?.done();
  await asked;
  assert.deepEqual(w.happened().slice(0, 2), ['webgpu draws torch', 'webgpu draws fire']);
});

test('a photograph is loaded once its first frame is there', async () => {
  const w = world();
  const frames = w.slowDown();
  w.session.set(SETTINGS);
  await w.opened('a.ltm');
  await w.drawn(0);
  assert.ok(!w.happened().includes('loaded'));
  frames[0]?.done();
  await settle();
  assert.deepEqual(w.happened(), ['loaded']);
});

test('a back end lost at a frame that takes time is replaced', async () => {
  const w = await loadedWorld();
  const frames = w.slowDown();
  w.session.set({ ...SETTINGS, output: exposed(2) });
  await w.frame();
  const asked = w.session.renderNow();
  frames[0]?.fail(new PhotoError('backend-lost', 'the device is gone.'));
  await settle();
  await w.drawFails(1, 'no adapter');
  await w.drawn(2);
  frames[1]?.done();
  assert.equal(await asked, w.session.renderer, 'the replacement draws what was asked for');
  assert.deepEqual(w.happened(), [
    'webgpu draws flood',
    'free webgpu',
    'backend webgpu -> cpu (WebGPU was lost: the device is gone. WebGPU: no adapter.)',
    'cpu draws flood',
  ]);
});

test('a picture at which a loss is found is drawn by what comes in its place', async () => {
  const w = await loadedWorld();
  const frames = w.slowDown();
  const asked = w.session.renderNow();
  w.losses[0]?.('the device is gone.');
  frames[0]?.fail(new PhotoError('backend-lost', 'the device is gone.'));
  await settle();
  await w.drawFails(1, 'no adapter');
  await w.drawn(2);
  frames[1]?.done();
  assert.equal(await asked, w.session.renderer);
  assert.deepEqual([w.session.backend, w.session.quality], ['cpu', 1]);
});

test('what was wrong with another light than there is now is not told', async () => {
  const w = await loadedWorld();
  const frames = w.slowDown();
  const image = {} as ImageLight;
  w.session.set({ ...SETTINGS, light: { ...SETTINGS.light, image } });
  await w.frame();
  w.session.set(SETTINGS);
  frames[0]?.done(new PhotoError('light-tainted', 'of another origin'));
  await settle();
  assert.deepEqual(w.happened(), ['webgpu draws flood']);
});

test('what becomes of a frame of another photograph is nobody’s concern', async () => {
  const w = await loadedWorld();
  const frames = w.slowDown();
  w.session.set({ ...SETTINGS, output: exposed(2) });
  await w.frame();
  w.session.set({ ...SETTINGS, src: 'b.ltm' });
  w.happened();
  frames[0]?.fail(new PhotoError('photo-lost', 'the photograph was let go'));
  await settle();
  assert.deepEqual(w.happened(), []);
});

test('a photograph of which parts are gone is fetched anew, and its picture stays until then', async () => {
  const w = await loadedWorld({ ...SETTINGS, renderOptions: wanting(['cpu']) });
  const frames = w.slowDown();
  w.session.set({ ...SETTINGS, renderOptions: wanting(['cpu']), output: exposed(2) });
  await w.frame();
  const asked = assert.rejects(w.session.renderNow(), { name: 'PhotoError' });
  frames[0]?.fail(new PhotoError('photo-lost', 'a worker stopped.'));
  await asked;
  // Not 'loading', which would take the picture away.
  assert.deepEqual(w.happened(), ['cpu draws flood', 'free cpu', 'free a.ltm']);
  // Nor a coarser one.
  await w.previewed('a.ltm', 0.5);
  assert.equal(w.draws.length, 1);
  await w.opened('a.ltm');
  await w.drawn(1);
  frames[1]?.done();
  await settle();
  assert.deepEqual(w.happened(), [
    'backend cpu -> cpu (a worker stopped.)',
    'cpu draws flood',
    'loaded',
  ]);
});

test('a photograph that loses parts to a back end is fetched anew, and no other is tried', async () => {
  const w = await loadedWorld({ ...SETTINGS, renderOptions: wanting(['cpu']) });
  w.session.set({ ...SETTINGS, renderOptions: wanting(['webgl2', 'webgpu']) });
  await w.drawLost(1, 'a worker stopped.');
  assert.deepEqual(w.happened(), ['free cpu', 'free a.ltm']);
  assert.equal(w.draws.length, 2);
  await w.opened('a.ltm');
  await w.drawn(2);
  assert.deepEqual(w.happened(), [
    'backend cpu -> webgl2 (a worker stopped.)',
    'webgl2 draws flood',
    'loaded',
  ]);
});

test('a photograph that cannot be fetched anew fails', async () => {
  const w = await loadedWorld({ ...SETTINGS, renderOptions: wanting(['cpu']) });
  w.session.set({ ...SETTINGS, renderOptions: wanting(['webgl2']) });
  await w.drawLost(1, 'a worker stopped.');
  await w.openFails('a.ltm', new PhotoError('http-network', 'the server cannot be reached'));
  assert.equal(w.happened().at(-1), 'failed http-network: the server cannot be reached');
});

test('a photograph that loses parts again and again fails, unless it is drawn between', async () => {
  const cpu: SessionSettings = { ...SETTINGS, renderOptions: wanting(['cpu']) };
  const w = await loadedWorld(cpu);
  const frames = w.slowDown();
  w.session.set({ ...cpu, output: exposed(2) });
  await w.frame();
  let fetched = 0;
  const lose = async () => {
    frames.pop()?.fail(new PhotoError('photo-lost', 'a worker stopped.'));
    await settle();
    if (w.happened().some((line) => line.startsWith('failed'))) return false;
    fetched += 1;
    await w.opened('a.ltm');
    await w.drawn(w.draws.length - 1);
    return true;
  };
  for (let i = 0; i < 4; i += 1) assert.ok(await lose());
  frames.pop()?.done();
  await settle();
  w.session.set(cpu);
  await w.frame();
  while (fetched < 100 && (await lose()));
  assert.equal(fetched, 4 + 5);
  assert.equal(w.session.backend, null);
  // Whoever asks for it gets it.
  w.session.set(cpu, true);
  await w.opened('a.ltm');
  await w.drawn(w.draws.length - 1);
  assert.ok(await lose());
});

test('a load that fails says so, and the same address can be tried again', async () => {
  const w = world();
  w.session.set(SETTINGS);
  await w.openFails('a.ltm', new PhotoError('http-status', 'the server answered 404'));
  assert.deepEqual(w.happened(), ['loading', 'failed http-status: the server answered 404']);
  w.session.set(SETTINGS, true);
  await w.opened('a.ltm');
  await w.drawn(0);
  assert.equal(w.happened().at(-1), 'loaded');
});

test('no address is src-missing', () => {
  const w = world();
  w.session.set({ ...SETTINGS, src: null });
  assert.match(w.happened()[1] ?? '', /^failed src-missing/);
});

test('a light that cannot be had is told with each frame, which counts as drawn', async () => {
  const w = world();
  w.spoilLights(new PhotoError('light-tainted', 'of another origin'));
  w.session.set(SETTINGS);
  await w.opened('a.ltm');
  await w.drawn(0);
  assert.deepEqual(w.happened().slice(2), [
    'webgpu draws flood',
    'not that light: of another origin',
    'loaded',
  ]);
  w.spoilLights(null);
  w.session.redraw();
  await w.frame();
  assert.deepEqual(w.happened(), ['webgpu draws flood']);
});

test('frames of a light that come before a browser’s own are one', async () => {
  const w = await loadedWorld();
  for (let i = 0; i < 3; i += 1) w.session.redraw();
  assert.equal(w.frames.length, 1);
  await w.frame();
  assert.deepEqual(w.happened(), ['webgpu draws flood']);
});

test('what a page changes before each of the browser’s frames is in that frame', async () => {
  const w = await loadedWorld();
  for (let i = 0; i < 10; i += 1) await w.frame(() => w.session.redraw());
  assert.equal(w.happened().length, 9, 'there was none to wait for before the first');
  await w.frame();
  assert.equal(w.frames.length, 0);
});

test('what nobody sees is not drawn, and once when it comes into view', async () => {
  const w = await loadedWorld();
  w.session.setVisible(false);
  for (const exposure of [2, 3]) {
    w.session.set({ ...SETTINGS, output: exposed(exposure) });
    w.session.redraw();
  }
  assert.equal(w.frames.length, 0);
  w.session.setVisible(true);
  await w.frame();
  assert.deepEqual(w.happened(), ['webgpu draws flood']);
  for (const visible of [false, true]) w.session.setVisible(visible);
  await w.frame();
  assert.deepEqual(w.happened(), [], 'nothing has changed');
});

test('what goes out of view before its frame waits until it is back', async () => {
  const w = await loadedWorld();
  w.session.redraw();
  w.session.setVisible(false);
  await w.frame();
  assert.deepEqual(w.happened(), []);
  w.session.setVisible(true);
  await w.frame();
  assert.deepEqual(w.happened(), ['webgpu draws flood']);
});

test('the first picture, another back end’s, and one that is asked for are drawn unseen', async () => {
  const w = world();
  w.session.setVisible(false);
  w.session.set(SETTINGS);
  await w.opened('a.ltm');
  await w.drawn(0);
  assert.equal(w.happened().at(-1), 'loaded');
  w.session.set({ ...SETTINGS, renderOptions: wanting(['cpu']) });
  await w.drawn(1);
  assert.deepEqual(w.happened().slice(-2), ['cpu draws flood', 'free webgpu']);
  w.session.redraw();
  await w.session.renderNow();
  assert.deepEqual(w.happened(), ['cpu draws flood']);
  w.session.setVisible(true);
  assert.equal(w.frames.length, 0, 'it is up to date');
});

type World = Awaited<ReturnType<typeof loadedWorld>>;

/**
 * Frames of a motion that are drawn at once, but the browser is ready for the next only after `ms`, or
 * less where they are drawn by less.
 */
async function move(w: World, count: number, ms: number): Promise<void> {
  for (let frame = 0; frame < count; frame += 1) {
    w.session.redraw();
    await w.frame();
    await w.pass(ms * (w.session.quality ?? 1));
  }
}

/** Nothing is asked for meanwhile. */
async function rest(w: World): Promise<void> {
  await w.frame();
  await w.pass(150);
}

/** One that is drawn by less than all of the photograph. */
async function softWorld() {
  const w = await loadedWorld();
  await move(w, 20, 60);
  assert.equal(w.happened().at(-1), 'webgpu draws flood by 0.5');
  return w;
}

test('frames that are late are drawn by less, and once more in full at rest', async () => {
  const w = await loadedWorld();
  assert.equal(w.session.quality, 1);
  await move(w, 12, 60);
  assert.equal(w.session.quality, 0.5);
  const happened = w.happened();
  assert.deepEqual(new Set(happened.slice(0, 8)), new Set(['webgpu draws flood']));
  assert.equal(happened.filter((line) => line.startsWith('detail')).join(), 'detail 0.5');
  await w.frame();
  await w.pass(140);
  assert.deepEqual(w.happened(), [], 'not yet');
  await w.pass(10);
  assert.deepEqual(w.happened(), ['webgpu draws flood', 'detail 1']);
  assert.equal(w.session.quality, 1);
  await w.pass(10_000);
  await w.frame();
  assert.deepEqual(w.happened(), []);
  assert.equal(w.frames.length, 0);
});

test('frames that take time themselves are drawn by less where that is long', async () => {
  for (const [ms, detail] of [
    [20, 1],
    [60, 0.5],
    [200, 0.25],
  ] as const) {
    const w = await loadedWorld();
    const frames = w.slowDown();
    for (let frame = 0; frame < 12; frame += 1) {
      w.session.redraw();
      await w.frame();
      await w.pass(ms);
      frames.shift()?.done();
      await settle();
    }
    assert.equal(w.session.quality, detail, `${ms} ms`);
  }
});

test('frames that keep the page busy are drawn by less where that is long', async () => {
  for (const [ms, detail] of [
    [30, 1],
    [60, 0.5],
  ] as const) {
    const w = await loadedWorld();
    w.spend(ms);
    for (let i = 0; i < 30; i += 1) await w.frame(() => w.session.redraw());
    assert.equal(w.session.quality, detail, `${ms} ms`);
  }
});

test('frames in time are drawn in full, however seldom one is asked for', async () => {
  const w = await loadedWorld();
  for (const wait of [0, 20, 80, 140]) {
    for (let frame = 0; frame < 20; frame += 1) {
      await move(w, 1, 16);
      await w.frame();
      await w.pass(wait);
    }
  }
  assert.deepEqual(new Set(w.happened()), new Set(['webgpu draws flood']));
});

test('a newer frame comes before the one in full', async () => {
  const w = await softWorld();
  await w.frame();
  await w.pass(80);
  w.session.redraw();
  await w.pass(1000);
  assert.deepEqual(w.happened(), [], 'it waits for the browser');
  await w.frame();
  assert.deepEqual(w.happened(), ['webgpu draws flood by 0.5']);
  await rest(w);
  assert.deepEqual(w.happened(), ['webgpu draws flood', 'detail 1']);
});

test('a picture whose frames are far apart, as the browser is late, is not at rest', async () => {
  const w = await softWorld();
  for (let i = 0; i < 10; i += 1) {
    await w.frame(() => w.session.redraw());
    await w.pass(500);
  }
  assert.ok(!w.happened().includes('webgpu draws flood'));
});

test('a picture at rest is drawn in full once it is in view', async () => {
  const w = await softWorld();
  w.session.setVisible(false);
  await rest(w);
  assert.deepEqual(w.happened(), []);
  w.session.setVisible(true);
  await w.frame();
  w.session.setVisible(false);
  await rest(w);
  assert.deepEqual(w.happened(), [], 'nor if it was so for a moment');
  w.session.setVisible(true);
  await rest(w);
  assert.deepEqual(w.happened(), ['webgpu draws flood', 'detail 1']);
  w.session.setVisible(false);
  w.session.setVisible(true);
  await rest(w);
  assert.deepEqual(w.happened(), [], 'it is');
});

test('a picture that is let go does not come to rest', async () => {
  const w = await softWorld();
  w.session.stop();
  assert.equal(w.session.quality, null);
  w.happened();
  await rest(w);
  assert.deepEqual(w.happened(), []);
});

test('a picture that is asked for is in full detail, in the middle of a motion', async () => {
  const w = await softWorld();
  await w.session.renderNow();
  assert.deepEqual(w.happened(), ['webgpu draws flood', 'detail 1']);
  await rest(w);
  assert.deepEqual(w.happened(), [], 'so there is none to come');
  w.session.redraw();
  await w.session.renderNow();
  await w.frame();
  assert.deepEqual(w.happened(), ['webgpu draws flood'], 'nor one that was asked for before');
  const frames = w.slowDown();
  const light = { name: 'torch', torch: null, image: null } as const;
  w.session.set({ ...SETTINGS, light });
  await w.frame();
  // Whether or not a frame of the motion is to come next.
  w.session.redraw();
  await w.frame();
  const asked = w.session.renderNow();
  frames[0]?.done();
  await settle();
  frames[1]?.done();
  await asked;
  assert.deepEqual(w.happened(), [
    'webgpu draws torch by 0.5',
    'detail 0.5',
    'webgpu draws torch',
    'detail 1',
  ]);
});

test('another back end, and another photograph, start in full detail', async () => {
  const w = await softWorld();
  w.session.set({ ...SETTINGS, renderOptions: wanting(['cpu']) });
  await w.drawn(1);
  assert.deepEqual(w.happened().slice(-3), ['cpu draws flood', 'free webgpu', 'detail 1']);
  await move(w, 20, 60);
  assert.equal(w.session.quality, 0.5);
  w.session.set({ ...SETTINGS, src: 'b.ltm' });
  await w.opened('b.ltm');
  await w.drawn(2);
  assert.equal(w.session.quality, 1);
  w.happened();
  await rest(w);
  assert.deepEqual(w.happened(), [], 'what came to rest is gone');
  await move(w, 2, 60);
  assert.deepEqual(new Set(w.happened()), new Set(['webgpu draws flood']));
});

test('coarser photographs are drawn while the file comes, each by the back end of the one before', async () => {
  const w = world();
  w.session.set(SETTINGS);
  await w.previewed('a.ltm', 0.125);
  await w.drawFails(0, 'no adapter');
  await w.drawn(1);
  assert.deepEqual(w.happened(), [
    'loading',
    'backend null -> cpu (WebGPU: no adapter.)',
    'cpu draws flood',
    'detail 0.125',
  ]);
  assert.equal(w.session.quality, 0.125);
  w.session.redraw();
  await w.frame();
  assert.deepEqual(w.happened(), ['cpu draws flood'], 'the light may move');
  await w.previewed('a.ltm', 0.5);
  await w.previewed('a.ltm', 0.75);
  const left = ['free cpu', 'free 0.125 of a.ltm', 'free 0.75 of a.ltm'];
  assert.deepEqual(w.happened(), left, 'one is on its way to the screen');
  assert.equal(w.session.backend, 'cpu');
  await w.drawn(2);
  assert.deepEqual(w.happened(), ['cpu draws flood', 'detail 0.5']);
  await w.opened('a.ltm');
  await w.drawn(3);
  assert.deepEqual(
    w.draws.map(({ backend }) => backend),
    ['webgpu', 'cpu', 'cpu', 'cpu'],
  );
  assert.deepEqual(w.happened(), [
    'free cpu',
    'free 0.5 of a.ltm',
    'cpu draws flood',
    'detail 1',
    'loaded',
  ]);
});

test('a whole photograph waits for who draws a coarser one, and is drawn by the same', async () => {
  const w = world();
  w.session.set(SETTINGS);
  await w.previewed('a.ltm', 0.5);
  await w.opened('a.ltm');
  assert.equal(w.draws.length, 1);
  await w.drawn(0);
  await w.drawn(1);
  assert.deepEqual(w.happened(), [
    'loading',
    'backend null -> webgpu',
    'webgpu draws flood',
    'detail 0.5',
    'webgpu draws flood',
    'free webgpu',
    'free 0.5 of a.ltm',
    'detail 1',
    'loaded',
  ]);
});

test('a whole photograph that nobody wants any more is freed while it waits', async () => {
  const w = world();
  w.session.set(SETTINGS);
  await w.previewed('a.ltm', 0.5);
  await w.opened('a.ltm');
  w.session.stop();
  await settle();
  assert.deepEqual(w.happened(), ['loading', 'abort a.ltm', 'free a.ltm']);
  await w.drawn(0);
  assert.deepEqual(w.happened(), ['free webgpu', 'free 0.5 of a.ltm']);
});

test('a coarser photograph that no back end draws, or that is lost, is made up for by the whole one', async () => {
  const w = world();
  w.session.set({ ...SETTINGS, renderOptions: wanting(['cpu']) });
  await w.previewed('a.ltm', 0.25);
  await w.drawFails(0, 'no canvas');
  assert.deepEqual(w.happened(), ['loading']);
  await w.previewed('a.ltm', 0.5);
  w.draws[1]?.reject(new PhotoError('photo-lost', 'a worker stopped'));
  await settle();
  await w.opened('a.ltm');
  await w.drawn(2);
  assert.deepEqual(w.happened(), [
    'free 0.25 of a.ltm',
    'free 0.5 of a.ltm',
    'backend null -> cpu',
    'cpu draws flood',
    'loaded',
  ]);
});

test('a photograph that fails to come whole leaves its last picture, and says so', async () => {
  const w = world();
  w.session.set(SETTINGS);
  await w.previewed('a.ltm', 0.5);
  await w.drawn(0);
  w.happened();
  await w.openFails('a.ltm', new PhotoError('http-short', 'it ended'));
  assert.deepEqual(w.happened(), ['failed http-short: it ended']);
  w.session.redraw();
  await w.frame();
  assert.deepEqual(w.happened(), ['webgpu draws flood']);
  w.session.stop();
  assert.deepEqual(w.happened(), ['free webgpu', 'free 0.5 of a.ltm']);
});

test('what waits for a frame of a coarser photograph is drawn by the whole one', async () => {
  const cpu = { ...SETTINGS, renderOptions: wanting(['cpu']) };
  const w = world();
  const frames = w.slowDown();
  w.session.set(cpu);
  await w.previewed('a.ltm', 0.5);
  await w.drawn(0);
  frames.shift()?.done();
  await settle();
  w.session.set({ ...cpu, output: exposed(2) });
  await w.frame();
  assert.equal(frames.length, 1);
  // Asked for while that is drawn.
  const waiting = w.session.renderNow();
  await w.opened('a.ltm');
  frames.shift()?.fail(new PhotoError('internal', 'it was let go'));
  await settle();
  await w.drawn(1);
  for (let i = 0; i < 5; i += 1) {
    frames.shift()?.done();
    await settle();
  }
  assert.ok(w.happened().includes('loaded'));
  assert.equal(await waiting, w.session.renderer);
});
