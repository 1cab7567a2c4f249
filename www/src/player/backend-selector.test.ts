import assert from 'node:assert/strict';
import test from 'node:test';
import { withBackends, withExposure } from '../renderers/settings-fakes.js';
import { PhotoError } from '../shared/errors.js';
import { fakeSession, loadedSession, SETTINGS, settle } from './session-fakes.js';

test('an unavailable backend is skipped with its reason', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.finishLoad('a.ltm');
  await f.failRenderer(0, 'no adapter');
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog().slice(1), [
    'backend null -> cpu (WebGPU: no adapter.)',
    'cpu draws flood',
    'loaded',
  ]);
});

test('the session fails without a backend, and tries again with other options', async () => {
  const f = fakeSession();
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['webgpu']) });
  await f.finishLoad('a.ltm');
  await f.failRenderer(0, 'no adapter');
  assert.match(f.takeLog()[1] ?? '', /^failed backend-unavailable: .*WebGPU: no adapter\./);
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['cpu']) });
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), ['backend null -> cpu', 'cpu draws flood', 'recovered', 'loaded']);
});

test('other options change the backend; the photograph is not loaded again', async () => {
  const f = await loadedSession();
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['cpu']) });
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), ['backend webgpu -> cpu', 'cpu draws flood', 'free webgpu']);
  // Options that begin with the active backend keep it.
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['cpu', 'webgpu']) });
  await settle();
  assert.deepEqual(f.takeLog(), ['cpu draws flood']);
});

test('the last of two quick changes of the options wins', async () => {
  const f = await loadedSession();
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['webgl2']) });
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['cpu']) });
  await f.createRenderer(2);
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), [
    'backend webgpu -> cpu',
    'cpu draws flood',
    'free webgpu',
    'free webgl2',
  ]);
});

for (const how of ['by the browser', 'at the next frame']) {
  test(`a backend lost ${how} is set up again`, async () => {
    const f = await loadedSession();
    if (how === 'by the browser') {
      f.lose(0, 'the device is gone.');
    } else {
      f.setLostAtFrame(true);
      f.session.set({ ...SETTINGS, output: withExposure(2) });
      await f.frame();
      f.setLostAtFrame(false);
    }
    await f.createRenderer(1);
    assert.deepEqual(f.takeLog(), [
      'free webgpu',
      'backend webgpu -> webgpu (WebGPU was lost: the device is gone.)',
      'webgpu draws flood',
    ]);
  });
}

test('a lost backend that is no longer available is replaced by the next one', async () => {
  const f = await loadedSession();
  f.lose(0, 'the device is gone.');
  await f.failRenderer(1, 'it was lost 3 times');
  await f.createRenderer(2);
  assert.deepEqual(f.takeLog(), [
    'free webgpu',
    'backend webgpu -> cpu (WebGPU was lost: the device is gone. WebGPU: it was lost 3 times.)',
    'cpu draws flood',
  ]);
});

test('a backend that is lost before its first frame is not tried again', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.finishLoad('a.ltm');
  f.setLostAtFrame(true);
  await f.createRenderer(0);
  f.setLostAtFrame(false);
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), [
    'loading',
    'backend null -> webgpu',
    'free webgpu',
    'backend webgpu -> cpu (WebGPU was lost: the device is gone.)',
    'cpu draws flood',
    'loaded',
  ]);
});

test('a loss during a search does not end the search', async () => {
  const f = await loadedSession({ ...SETTINGS, backendOptions: withBackends(['webgl2']) });
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['webgpu', 'webgl2', 'cpu']) });
  f.lose(0, 'the browser took it away.');
  assert.deepEqual(f.takeLog(), []);
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), ['free webgl2', 'backend webgl2 -> webgpu', 'webgpu draws flood']);
});

test('a backend lost during a search is set up again when its turn comes', async () => {
  const f = await loadedSession({ ...SETTINGS, backendOptions: withBackends(['webgl2']) });
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['webgpu', 'webgl2', 'cpu']) });
  f.lose(0, 'the browser took it away.');
  await f.failRenderer(1, 'no adapter');
  await f.createRenderer(2);
  assert.deepEqual(f.takeLog(), [
    'free webgl2',
    'backend webgl2 -> webgl2 (WebGPU: no adapter.)',
    'webgl2 draws flood',
  ]);
});

test('a loss is reported once, and another gamut is not reported as another backend', async () => {
  const f = await loadedSession({ ...SETTINGS, backendOptions: withBackends(['webgl2']) });
  f.session.set({
    ...SETTINGS,
    backendOptions: { ...withBackends(['webgl2']), gamut: 'display-p3' },
  });
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), ['webgl2 draws flood', 'free webgl2']);
  assert.deepEqual(f.losses, []);
  f.lose(1, 'the browser took it away.');
  f.lose(1, 'the browser took it away.');
  assert.deepEqual(f.losses, ['webgl2: the browser took it away.']);
});

test('a backend that is lost while it is set up is skipped with its reason', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.finishLoad('a.ltm');
  f.lose(0, 'the device is gone.');
  await f.createRenderer(0);
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), [
    'loading',
    'free webgpu',
    'backend null -> cpu (WebGPU: it was lost while it was being set up: the device is gone.)',
    'cpu draws flood',
    'loaded',
  ]);
});

test('an error during the setup of a lost backend is reported as the loss', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.finishLoad('a.ltm');
  f.lose(0, 'the device is gone.');
  await f.failRenderer(0, 'null pointer passed to rust');
  await f.createRenderer(1);
  assert.match(
    f.takeLog().join(),
    /WebGPU: it was lost while it was being set up: the device is gone/,
  );
});

test('a backend lost at any moment after its setup is replaced and freed once', async () => {
  for (let ticks = 0; ticks < 10; ticks += 1) {
    const f = fakeSession();
    f.session.set(SETTINGS);
    await f.finishLoad('a.ltm');
    f.requests[0]?.resolve();
    for (let tick = 0; tick < ticks; tick += 1) await Promise.resolve();
    f.lose(0, 'the device is gone.');
    await settle();
    // A backend that has drawn a frame is tried again.
    if (f.requests[1]?.backend === 'webgpu') await f.failRenderer(1, 'it is gone');
    await f.createRenderer(f.requests.length - 1);
    const log = f.takeLog();
    const lasting = log.filter((line) => /^free|^failed|^cpu|loaded/.test(line));
    const expected = ['free webgpu', 'cpu draws flood', 'loaded'];
    assert.deepEqual(lasting.sort(), expected.sort(), `after ${ticks} ticks`);
    const reasons = log.filter((line) => line.startsWith('backend'));
    assert.match(reasons.at(-1) ?? '', /-> cpu \(WebGPU.* lost.*: the device is gone\./);
    assert.equal(f.session.backend, 'cpu');
  }
});

test('the loss of the last backend reports the loss and the failed attempt', async () => {
  const f = await loadedSession({ ...SETTINGS, backendOptions: withBackends(['webgpu']) });
  f.lose(0, 'the device is gone.');
  await f.failRenderer(1, 'no adapter');
  const [freed, failed] = f.takeLog();
  assert.equal(freed, 'free webgpu');
  assert.match(
    failed ?? '',
    /^failed backend-unavailable: WebGPU was lost: the device is gone\..* WebGPU: no adapter\./,
  );
  await assert.rejects(f.session.renderNow(), { code: 'not-loaded' });
});

test('a backend that is lost during a slow frame is replaced', async () => {
  const f = await loadedSession();
  const frames = f.slowDown();
  f.session.set({ ...SETTINGS, output: withExposure(2) });
  await f.frame();
  const asked = f.session.renderNow();
  frames[0]?.fail(new PhotoError('backend-lost', 'the device is gone.'));
  await settle();
  await f.failRenderer(1, 'no adapter');
  await f.createRenderer(2);
  frames[1]?.done();
  assert.equal(await asked, f.session.renderer, 'the replacement draws what was asked for');
  assert.deepEqual(f.takeLog(), [
    'webgpu draws flood',
    'free webgpu',
    'backend webgpu -> cpu (WebGPU was lost: the device is gone. WebGPU: no adapter.)',
    'cpu draws flood',
  ]);
});

test('renderNow whose frame reveals a loss is drawn by the replacement', async () => {
  const f = await loadedSession();
  const frames = f.slowDown();
  const asked = f.session.renderNow();
  f.lose(0, 'the device is gone.');
  frames[0]?.fail(new PhotoError('backend-lost', 'the device is gone.'));
  await settle();
  await f.failRenderer(1, 'no adapter');
  await f.createRenderer(2);
  frames[1]?.done();
  assert.equal(await asked, f.session.renderer);
  assert.deepEqual([f.session.backend, f.session.quality], ['cpu', 1]);
});
