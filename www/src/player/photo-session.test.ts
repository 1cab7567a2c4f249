import assert from 'node:assert/strict';
import test from 'node:test';
import type { PhotoUser } from '../photo/photo-library.js';
import { withBackends, withExposure } from '../renderers/settings-fakes.js';
import { PhotoError } from '../shared/errors.js';
import { type FakeSession, fakeSession, loadedSession, SETTINGS, settle } from './session-fakes.js';
import type { SessionSettings } from './types.js';

test('a photograph is loaded, gets a backend and is drawn', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.finishLoad('a.ltm');
  await f.createRenderer(0);
  assert.deepEqual(f.takeLog(), [
    'loading',
    'backend null -> webgpu',
    'webgpu draws flood',
    'loaded',
  ]);
});

test('another address aborts the load, and only the new photograph is drawn', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  f.session.set({ ...SETTINGS, src: 'b.ltm' });
  // The old load succeeds too late.
  await f.finishLoad('a.ltm');
  await f.finishLoad('b.ltm');
  await f.createRenderer(0);
  assert.deepEqual(f.takeLog(), [
    'loading',
    'abort a.ltm',
    'loading',
    'free a.ltm',
    'backend null -> webgpu',
    'webgpu draws flood',
    'loaded',
  ]);
});

test('stop frees the renderer and then the photograph', async () => {
  const f = await loadedSession();
  f.session.stop();
  assert.deepEqual(f.takeLog(), ['free webgpu', 'free a.ltm']);
  f.session.set(SETTINGS);
  assert.deepEqual(f.takeLog(), ['loading']);
});

test('a photograph that is removed during a backend search is freed after it', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.finishLoad('a.ltm');
  f.session.stop();
  assert.deepEqual(f.takeLog(), ['loading']);
  await f.createRenderer(0);
  assert.deepEqual(f.takeLog(), ['free webgpu', 'free a.ltm']);
});

test('loaded is reported after the first frame', async () => {
  const f = fakeSession();
  const frames = f.slowDown();
  f.session.set(SETTINGS);
  await f.finishLoad('a.ltm');
  await f.createRenderer(0);
  assert.ok(!f.takeLog().includes('loaded'));
  frames[0]?.done();
  await settle();
  assert.deepEqual(f.takeLog(), ['loaded']);
});

test('a failed frame of the last photograph is not reported', async () => {
  const f = await loadedSession();
  const frames = f.slowDown();
  f.session.set({ ...SETTINGS, output: withExposure(2) });
  await f.frame();
  f.session.set({ ...SETTINGS, src: 'b.ltm' });
  f.takeLog();
  frames[0]?.fail(new PhotoError('photo-lost', 'the photograph was let go'));
  await settle();
  assert.deepEqual(f.takeLog(), []);
});

test('a failed load is reported, and the same address can be loaded again', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.failLoad('a.ltm', new PhotoError('http-status', 'the server answered 404'));
  assert.deepEqual(f.takeLog(), ['loading', 'failed http-status: the server answered 404']);
  f.session.set(SETTINGS, true);
  await f.finishLoad('a.ltm');
  await f.createRenderer(0);
  assert.equal(f.takeLog().at(-1), 'loaded');
});

test('no address is src-missing', () => {
  const f = fakeSession();
  f.session.set({ ...SETTINGS, src: null });
  assert.match(f.takeLog()[1] ?? '', /^failed src-missing/);
});

test('a photograph that cannot be fetched again is a warning, as its picture stays', async () => {
  const f = await loadedSession({ ...SETTINGS, backendOptions: withBackends(['cpu']) });
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['webgl2']) });
  await f.failRenderer(1, 'a worker stopped.', 'photo-lost');
  await f.failLoad('a.ltm', new PhotoError('http-network', 'the server cannot be reached'));
  assert.equal(f.takeLog().at(-1), 'warned http-network: the server cannot be reached');
});

test('a photograph that lost tiles is fetched again, and its picture stays until then', async () => {
  const f = await loadedSession({ ...SETTINGS, backendOptions: withBackends(['cpu']) });
  const frames = f.slowDown();
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['cpu']), output: withExposure(2) });
  await f.frame();
  const asked = assert.rejects(f.session.renderNow(), { name: 'PhotoError' });
  frames[0]?.fail(new PhotoError('photo-lost', 'a worker stopped.'));
  await asked;
  // There is no 'loading', which would remove the picture.
  assert.deepEqual(f.takeLog(), ['cpu draws flood', 'free cpu', 'free a.ltm']);
  // Previews are not drawn either.
  await f.sendPreview('a.ltm', 0.5);
  assert.equal(f.requests.length, 1);
  await f.finishLoad('a.ltm');
  await f.createRenderer(1);
  frames[1]?.done();
  await settle();
  assert.deepEqual(f.takeLog(), [
    'backend cpu -> cpu (a worker stopped.)',
    'cpu draws flood',
    'loaded',
  ]);
});

test('if tiles are lost during a setup, the photograph is fetched again and no other backend is tried', async () => {
  const f = await loadedSession({ ...SETTINGS, backendOptions: withBackends(['cpu']) });
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['webgl2', 'webgpu']) });
  await f.failRenderer(1, 'a worker stopped.', 'photo-lost');
  assert.deepEqual(f.takeLog(), ['free cpu', 'free a.ltm']);
  assert.equal(f.requests.length, 2);
  await f.finishLoad('a.ltm');
  await f.createRenderer(2);
  assert.deepEqual(f.takeLog(), [
    'backend cpu -> webgl2 (a worker stopped.)',
    'webgl2 draws flood',
    'loaded',
  ]);
});

test('repeated losses of tiles fail after five fetches without a frame', async () => {
  const cpu: SessionSettings = { ...SETTINGS, backendOptions: withBackends(['cpu']) };
  const f = await loadedSession(cpu);
  const frames = f.slowDown();
  f.session.set({ ...cpu, output: withExposure(2) });
  await f.frame();
  let fetched = 0;
  const lose = async () => {
    frames.pop()?.fail(new PhotoError('photo-lost', 'a worker stopped.'));
    await settle();
    if (f.takeLog().some((line) => line.startsWith('warned'))) return false;
    fetched += 1;
    await f.finishLoad('a.ltm');
    await f.createRenderer(f.requests.length - 1);
    return true;
  };
  for (let i = 0; i < 4; i += 1) assert.ok(await lose());
  frames.pop()?.done();
  await settle();
  f.session.set(cpu);
  await f.frame();
  while (fetched < 100 && (await lose()));
  assert.equal(fetched, 4 + 5);
  assert.equal(f.session.backend, null);
  // A reload on request starts the count again.
  f.session.set(cpu, true);
  await f.finishLoad('a.ltm');
  await f.createRenderer(f.requests.length - 1);
  assert.ok(await lose());
});

test('previews are drawn while the file loads, each with the backend of the last', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.sendPreview('a.ltm', 0.125);
  await f.failRenderer(0, 'no adapter');
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), [
    'loading',
    'backend null -> cpu (WebGPU: no adapter.)',
    'cpu draws flood',
    'quality 0.125',
  ]);
  assert.equal(f.session.quality, 0.125);
  f.session.redraw();
  await f.frame();
  assert.deepEqual(f.takeLog(), ['cpu draws flood'], 'the light may move');
  await f.sendPreview('a.ltm', 0.5);
  await f.sendPreview('a.ltm', 0.75);
  const left = ['free cpu', 'free 0.125 of a.ltm'];
  assert.deepEqual(
    f.takeLog(),
    left,
    'one is on its way to the screen, so that 0.75 is not needed',
  );
  assert.equal(f.session.backend, 'cpu');
  await f.createRenderer(2);
  assert.deepEqual(f.takeLog(), ['cpu draws flood', 'quality 0.5']);
  await f.finishLoad('a.ltm');
  await f.createRenderer(3);
  assert.deepEqual(
    f.requests.map(({ backend }) => backend),
    ['webgpu', 'cpu', 'cpu', 'cpu'],
  );
  assert.deepEqual(f.takeLog(), [
    'free cpu',
    'free 0.5 of a.ltm',
    'cpu draws flood',
    'quality 1',
    'loaded',
  ]);
});

test('the photograph waits for the preview’s search and uses its backend', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.sendPreview('a.ltm', 0.5);
  await f.finishLoad('a.ltm');
  assert.equal(f.requests.length, 1);
  await f.createRenderer(0);
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), [
    'loading',
    'backend null -> webgpu',
    'webgpu draws flood',
    'quality 0.5',
    'webgpu draws flood',
    'free webgpu',
    'free 0.5 of a.ltm',
    'quality 1',
    'loaded',
  ]);
});

test('a photograph that waits for a search is freed if the session stops', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.sendPreview('a.ltm', 0.5);
  await f.finishLoad('a.ltm');
  f.session.stop();
  await settle();
  assert.deepEqual(f.takeLog(), ['loading', 'free a.ltm']);
  await f.createRenderer(0);
  assert.deepEqual(f.takeLog(), ['free webgpu', 'free 0.5 of a.ltm']);
});

test('a preview without a backend, or whose tiles are lost, is not reported', async () => {
  const f = fakeSession();
  f.session.set({ ...SETTINGS, backendOptions: withBackends(['cpu']) });
  await f.sendPreview('a.ltm', 0.25);
  await f.failRenderer(0, 'no canvas');
  assert.deepEqual(f.takeLog(), ['loading']);
  await f.sendPreview('a.ltm', 0.5);
  f.requests[1]?.reject(new PhotoError('photo-lost', 'a worker stopped'));
  await settle();
  await f.finishLoad('a.ltm');
  await f.createRenderer(2);
  assert.deepEqual(f.takeLog(), [
    'free 0.25 of a.ltm',
    'free 0.5 of a.ltm',
    'backend null -> cpu',
    'cpu draws flood',
    'loaded',
  ]);
});

test('a failed load keeps the last preview and reports the error', async () => {
  const f = fakeSession();
  f.session.set(SETTINGS);
  await f.sendPreview('a.ltm', 0.5);
  await f.createRenderer(0);
  f.takeLog();
  await f.failLoad('a.ltm', new PhotoError('http-short', 'it ended'));
  assert.deepEqual(f.takeLog(), ['failed http-short: it ended']);
  f.session.redraw();
  await f.frame();
  assert.deepEqual(f.takeLog(), ['webgpu draws flood']);
  f.session.stop();
  assert.deepEqual(f.takeLog(), ['free webgpu', 'free 0.5 of a.ltm']);
});

test('a request that waits for a preview’s frame is drawn with the photograph', async () => {
  const cpu = { ...SETTINGS, backendOptions: withBackends(['cpu']) };
  const f = fakeSession();
  const frames = f.slowDown();
  f.session.set(cpu);
  await f.sendPreview('a.ltm', 0.5);
  await f.createRenderer(0);
  frames.shift()?.done();
  await settle();
  f.session.set({ ...cpu, output: withExposure(2) });
  await f.frame();
  assert.equal(frames.length, 1);
  // Requested during that frame.
  const waiting = f.session.renderNow();
  await f.finishLoad('a.ltm');
  frames.shift()?.fail(new PhotoError('internal', 'it was let go'));
  await settle();
  await f.createRenderer(1);
  for (let i = 0; i < 5; i += 1) {
    frames.shift()?.done();
    await settle();
  }
  assert.ok(f.takeLog().includes('loaded'));
  assert.equal(await waiting, f.session.renderer);
});

const CPU: SessionSettings = { ...SETTINGS, backendOptions: withBackends(['cpu']) };

/** The library's view of a session with a photograph. */
function userOf({ users }: FakeSession): PhotoUser {
  const [user] = users;
  assert.ok(user);
  return user;
}

/** A session whose photograph was released while it was out of view. */
async function restingSession(settings = CPU) {
  const f = await loadedSession(settings);
  f.session.setVisible(false);
  userOf(f).rest();
  return f;
}

test('only a whole photograph that is drawn and out of view may rest', async () => {
  const f = fakeSession();
  const frames = f.slowDown();
  f.session.setVisible(false);
  f.session.set(CPU);
  const canRest = () => userOf(f).canRest;
  assert.ok(!canRest());
  await f.finishLoad('a.ltm');
  await f.createRenderer(0);
  assert.ok(!canRest(), 'its first frame is in progress');
  frames.shift()?.done();
  await settle();
  assert.ok(canRest());
  const picture = f.session.renderNow();
  assert.ok(!canRest(), 'a script waits for it');
  frames.shift()?.done();
  await picture;
  await settle();
  assert.ok(canRest());
  f.session.setVisible(true);
  assert.ok(!canRest());
});

test('a resting picture stays as it is, and its photograph returns silently when it comes near', async () => {
  const f = await restingSession();
  const { session } = f;
  assert.deepEqual(f.takeLog(), ['free cpu', 'free a.ltm']);
  assert.equal(f.users.size, 0);
  const { backend, quality, renderer, photo } = session;
  assert.deepEqual([backend, quality, renderer?.kernel], ['cpu', 1, 'fake']);
  assert.ok(photo);
  // Changes are drawn when it is back.
  session.set({ ...CPU, light: { ...CPU.light, name: 'torch' } });
  await f.frame();
  assert.equal(f.users.size, 0);
  session.setNear(true);
  assert.ok(userOf(f).isResting);
  session.setVisible(true);
  await f.finishLoad('a.ltm');
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), ['cpu draws torch']);
  assert.ok(!userOf(f).isResting);
});

test('a resting picture that leaves again gives up its place in the queue', async () => {
  const f = await restingSession();
  f.session.setNear(true);
  f.session.setNear(false);
  assert.equal(f.users.size, 0);
  f.session.setNear(true);
  await f.finishLoad('a.ltm');
  await f.createRenderer(1);
  assert.equal(f.takeLog().at(-1), 'cpu draws flood');
});

test('the picture of a graphics device is copied before it rests', async () => {
  const f = await restingSession(SETTINGS);
  assert.deepEqual(f.takeLog(), ['webgpu draws flood', 'copy', 'free webgpu', 'free a.ltm']);
});

test('renderNow opens the photograph of a resting picture before all others', async () => {
  const f = await restingSession();
  f.takeLog();
  const picture = f.session.renderNow();
  assert.deepEqual([userOf(f).placement, userOf(f).isResting], [0, false]);
  f.session.setNear(false);
  await f.finishLoad('a.ltm');
  await f.createRenderer(1);
  assert.equal(await picture, f.session.renderer);
  assert.ok(f.takeLog().includes('cpu draws flood'));
});

test('a resting picture whose photograph cannot be opened is a warning, and the next time works', async () => {
  const f = await restingSession();
  f.takeLog();
  f.session.setNear(true);
  await f.failLoad('a.ltm', new PhotoError('http-network', 'the server cannot be reached'));
  assert.deepEqual(f.takeLog(), ['warned http-network: the server cannot be reached']);
  await assert.rejects(
    Promise.all([
      f.session.renderNow(),
      f.failLoad('a.ltm', new PhotoError('http-network', 'still not')),
    ]),
    { code: 'not-loaded' },
  );
  f.takeLog();
  f.session.setNear(true);
  await f.finishLoad('a.ltm');
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), ['cpu draws flood', 'recovered']);
});

test('another address replaces a resting picture', async () => {
  const f = await restingSession();
  f.takeLog();
  f.session.set({ ...CPU, src: 'b.ltm' });
  assert.equal(f.session.photo, null);
  await f.finishLoad('b.ltm');
  await f.createRenderer(1);
  assert.deepEqual(f.takeLog(), ['loading', 'backend null -> cpu', 'cpu draws flood', 'loaded']);
});

test('a resting picture that becomes visible while its photograph is drawn opens it once', async () => {
  const f = await restingSession();
  f.takeLog();
  const frames = f.slowDown();
  f.session.setNear(true);
  await f.finishLoad('a.ltm');
  await f.createRenderer(1);
  f.session.setVisible(true);
  assert.equal(f.users.size, 1);
  frames.shift()?.done();
  await settle();
  assert.deepEqual(f.takeLog(), ['cpu draws flood']);
});

test('a resting picture stays if no backend can draw its photograph again', async () => {
  const f = await restingSession();
  f.takeLog();
  f.session.setNear(true);
  await f.finishLoad('a.ltm');
  await f.failRenderer(1, 'no memory is left');
  assert.match(f.takeLog().join(), /^warned backend-unavailable: .*no memory is left/);
  f.session.setVisible(true);
  await f.finishLoad('a.ltm');
  await f.createRenderer(2);
  assert.deepEqual(f.takeLog(), ['free a.ltm', 'cpu draws flood', 'recovered']);
});
