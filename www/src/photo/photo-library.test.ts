import assert from 'node:assert/strict';
import test from 'node:test';
import type { LoadOptions } from './load-options.js';
import { LoadQueue, OUT_OF_VIEW } from './load-queue.js';
import {
  type PhotoAddress,
  PhotoLibrary,
  type PhotoUser,
  type SharedPhoto,
} from './photo-library.js';
import type { LoadedPhotograph } from './photograph.js';

/** The next load starts in a later task. */
const settle = () => new Promise((resolve) => setTimeout(resolve, 5));

/** The size of each fake photograph; the library holds two. */
const PHOTO_BYTES = 100;

const nameOf = (src: PhotoAddress['src']) => (typeof src === 'string' ? src : 'source');

function fakeLibrary() {
  const log: string[] = [];
  const loads = new Map<
    string,
    { options: LoadOptions; resolve(): void; reject(e: Error): void }
  >();
  const fakePhotograph = (name: string): LoadedPhotograph & { isLost: boolean } => {
    const info = { decodedBytes: PHOTO_BYTES };
    const free = () => log.push(`free ${name}`);
    return { info, isLost: false, free } as unknown as LoadedPhotograph & { isLost: boolean };
  };
  const library = new PhotoLibrary(
    (address, options) =>
      new Promise((resolve, reject) => {
        const src = nameOf(address.src);
        let isLoading = true;
        log.push(`load ${src}`);
        options.signal.addEventListener('abort', () => {
          if (isLoading) log.push(`abort ${src}`);
          reject(options.signal.reason);
        });
        const finish = () => {
          isLoading = false;
          resolve(fakePhotograph(src));
        };
        loads.set(src, { options, resolve: finish, reject });
      }),
    new LoadQueue(),
    2 * PHOTO_BYTES,
  );
  const address = (src: PhotoAddress['src']) => ({ src, credentials: 'same-origin' }) as const;
  /** An element. It rests when it is asked. */
  const open = (
    src: PhotoAddress['src'],
    placement = 0,
    { isResting = false, isReload = false } = {},
  ) => {
    const abort = new AbortController();
    const events: unknown[] = [];
    let photo: SharedPhoto | null = null;
    const leave = () => {
      abort.abort();
      photo?.release();
      photo = null;
    };
    const user: PhotoUser & { wantsPreviews: boolean } = {
      placement,
      isResting,
      wantsPreviews: true,
      canRest: true,
      progress: (...progress: [number, number]) => events.push(progress),
      preview: (shared: SharedPhoto) => {
        shared.retain();
        events.push(shared);
      },
      rest: () => {
        log.push(`rest ${nameOf(src)}`);
        leave();
      },
    };
    const opened = library.open(address(src), user, abort.signal, isReload).then((shared) => {
      photo = shared;
      return shared;
    });
    opened.catch(() => {});
    return { user, opened, events, leave };
  };
  return {
    library,
    open,
    fakePhotograph,
    loads,
    /** The log since the last call. */
    async takeLog() {
      await settle();
      return log.splice(0);
    },
    async finish(src: string) {
      await settle();
      loads.get(src)?.resolve();
      await settle();
    },
  };
}

test('elements with the same address share one photograph, which the last of them frees', async () => {
  const f = fakeLibrary();
  const [one, other] = [f.open('a'), f.open('a')];
  await settle();
  f.loads.get('a')?.options.onProgress(3, 10);
  await f.finish('a');
  const late = f.open('a');
  assert.equal(await one.opened, await other.opened);
  assert.equal(await late.opened, await one.opened);
  assert.deepEqual([one.events, other.events], [[[3, 10]], [[3, 10]]]);
  one.leave();
  late.leave();
  assert.deepEqual(await f.takeLog(), ['load a']);
  other.leave();
  assert.deepEqual(await f.takeLog(), ['free a']);
  f.open('a');
  assert.deepEqual(await f.takeLog(), ['load a'], 'it is loaded again');
});

test('credentials distinguish addresses', async () => {
  const f = fakeLibrary();
  f.open('a');
  const { user } = f.open('a');
  const { signal } = new AbortController();
  void f.library.open({ src: 'a', credentials: 'include' }, user, signal);
  await f.finish('a');
  assert.deepEqual(await f.takeLog(), ['load a', 'load a']);
});

test('elements with the same source share one photograph; another source is another one', async () => {
  const f = fakeLibrary();
  const source = { load: () => Promise.reject(new Error('the test loads')) };
  const [one, other, third] = [f.open(source), f.open(source), f.open({ ...source })];
  await f.finish('source');
  assert.equal(await one.opened, await other.opened);
  await f.finish('source');
  assert.notEqual(await third.opened, await one.opened);
  one.leave();
  other.leave();
  third.leave();
  assert.deepEqual(await f.takeLog(), ['load source', 'load source', 'free source', 'free source']);
});

test('a load ends with its last element, in the queue or in progress', async () => {
  const f = fakeLibrary();
  const [running, waiting] = [f.open('a'), f.open('b')];
  const second = f.open('a');
  assert.deepEqual(await f.takeLog(), ['load a']);
  waiting.leave();
  running.leave();
  await assert.rejects(running.opened, { name: 'AbortError' });
  assert.deepEqual(await f.takeLog(), []);
  second.leave();
  assert.deepEqual(await f.takeLog(), ['abort a']);
  f.open('c');
  assert.deepEqual(await f.takeLog(), ['load c']);
});

test('a failed load rejects for all its elements, and the next element tries again', async () => {
  const f = fakeLibrary();
  const both = [f.open('a'), f.open('a')];
  await settle();
  const error = new Error('404');
  f.loads.get('a')?.reject(error);
  for (const { opened } of both) await assert.rejects(opened, error);
  f.open('a');
  assert.deepEqual(await f.takeLog(), ['load a', 'load a']);
});

test('a reload, and a photograph that lost tiles, are loaded once for all who ask', async () => {
  const f = fakeLibrary();
  const first = f.open('a');
  await f.finish('a');
  const reloads = [f.open('a', 0, { isReload: true }), f.open('a', 0, { isReload: true })];
  assert.deepEqual(await f.takeLog(), ['load a', 'load a']);
  await f.finish('a');
  assert.equal(await reloads[0]?.opened, await reloads[1]?.opened);
  assert.notEqual(await reloads[0]?.opened, await first.opened);
  const lost = (await reloads[0]?.opened)?.value as { isLost: boolean };
  lost.isLost = true;
  f.open('a');
  f.open('a');
  assert.deepEqual(await f.takeLog(), ['load a']);
});

test('a preview goes to the elements that want it, and lives as long as they use it', async () => {
  const f = fakeLibrary();
  const [one, other] = [f.open('a'), f.open('a')];
  other.user.wantsPreviews = false;
  await settle();
  const options = f.loads.get('a')?.options;
  options?.onPreview?.(f.fakePhotograph('preview'));
  assert.deepEqual([one.events.length, other.events.length], [1, 0]);
  assert.deepEqual(await f.takeLog(), ['load a']);
  (one.events[0] as SharedPhoto).release();
  assert.deepEqual(await f.takeLog(), ['free preview']);
  one.user.wantsPreviews = false;
  assert.equal(options?.onPreview, null);
});

test('beyond the limit, photographs out of view rest, the farthest first', async () => {
  const f = fakeLibrary();
  f.open('far', OUT_OF_VIEW + 3000);
  f.open('visible', 10);
  f.open('below', OUT_OF_VIEW + 200);
  for (const src of ['visible', 'below', 'far']) await f.finish(src);
  assert.deepEqual(await f.takeLog(), [
    'load visible',
    'load below',
    'load far',
    'rest far',
    'free far',
  ]);
  const more = [f.open('more', 20), f.open('most', 30)];
  await f.finish('more');
  await f.finish('most');
  assert.deepEqual(await f.takeLog(), ['load more', 'rest below', 'free below', 'load most']);
  for (const { opened } of more) await opened;
});

test('a photograph that an element in view shares does not rest', async () => {
  const f = fakeLibrary();
  f.open('a', 10);
  f.open('a', OUT_OF_VIEW + 5000);
  f.open('b', 20);
  f.open('c', 30);
  for (const src of ['a', 'b', 'c']) await f.finish(src);
  assert.deepEqual(await f.takeLog(), ['load a', 'load b', 'load c']);
});

test('a resting picture near the viewport waits for room, one in view does not', async () => {
  const f = fakeLibrary();
  const first = f.open('a', OUT_OF_VIEW + 500);
  await f.finish('a');
  first.user.rest();
  const visible = [f.open('b', 10), f.open('c', 20)];
  for (const src of ['b', 'c']) await f.finish(src);
  await f.takeLog();
  const again = f.open('a', OUT_OF_VIEW + 500, { isResting: true });
  assert.deepEqual(await f.takeLog(), []);
  visible[0]?.leave();
  assert.deepEqual(await f.takeLog(), ['free b', 'load a']);
  again.leave();
  f.open('d', 15);
  await f.finish('d');
  await f.takeLog();
  f.open('a', 30, { isResting: true });
  assert.deepEqual(await f.takeLog(), ['load a']);
});
