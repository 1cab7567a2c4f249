import assert from 'node:assert/strict';
import test from 'node:test';
import { type RecoveryPorts, runRecovery } from './recover.js';
import { type FakeAnswers, FakeWorker, settle, TILES } from './recovery-fakes.js';
import type { FolderInput, PicturesInput, RecoverOptions, RecoveryProgress } from './types.js';

const MANIFEST = {
  camera: { width: 128, height: 96 },
  light: { width: 64, height: 48 },
  shots: Array.from({ length: 10 }, () => ({})),
};
const FOLDER: FolderInput = {
  folder: new Map([['capture.json', new Blob([JSON.stringify(MANIFEST)])]]),
};
const picture = (width: number, height: number) => ({
  width,
  height,
  data: new Float32Array(3 * width * height),
});
const PICTURES: PicturesInput = {
  patterns: [picture(8, 8), picture(8, 8)],
  photographs: [picture(16, 16), picture(16, 16)],
  correspondence: [
    [0.5, 0, 0],
    [0, 0.5, 0],
  ],
};

function start(
  input: FolderInput | PicturesInput,
  options: RecoverOptions = {},
  answers: FakeAnswers = {},
  ports: Partial<RecoveryPorts> = {},
) {
  const workers: FakeWorker[] = [];
  const startWorker = () => {
    const worker = new FakeWorker(answers);
    workers.push(worker);
    return worker;
  };
  const all = { startWorker, hasSimd: () => true, ...ports };
  const done = runRecovery(input, {}, { workers: 2, ...options }, all);
  done.catch(() => {});
  return { done, workers };
}

test('a folder is recovered, and only its coordinator lives on until the photograph is freed', async () => {
  const { done, workers } = start(FOLDER);
  const photograph = await done;
  const [coordinator, tileWorker] = workers;
  assert.equal(coordinator?.tiles.length, TILES);
  assert.deepEqual([coordinator?.hasEnded, tileWorker?.hasEnded], [false, true]);
  const { width, height, lightWidth, lightHeight, window, rank, shotsUsed } = photograph;
  assert.deepEqual(
    [width, height, lightWidth, lightHeight, window, rank],
    [128, 96, 64, 48, 15, 20],
  );
  assert.deepEqual(shotsUsed, [0, 1, 3]);
  assert.deepEqual(
    photograph.warnings.map(({ code }) => code),
    ['unknown-fields', 'low-snr', 'overexposed'],
  );
  assert.match(photograph.warnings[1]?.message ?? '', /only 12\.3 dB/);
  assert.deepEqual([...new Uint8Array(await (await photograph.toBlob()).arrayBuffer())], [1, 2, 3]);
  photograph.free();
  assert.ok(coordinator?.hasEnded);
  await assert.rejects(photograph.toBlob(), /was freed/);
});

test('pictures are sent one by one, in order', async () => {
  const exposures: unknown[] = [];
  const addShot = (index: number, _: unknown, __: unknown, exposure: number) =>
    exposures.push([index, exposure]);
  const dark = picture(16, 16);
  const { done, workers } = start({ ...PICTURES, dark, exposures: [1, 4] }, {}, { addShot });
  (await done).free();
  assert.deepEqual(workers[0]?.log.slice(0, 6), [
    'beginPictures',
    'setDark',
    'setCorrespondence',
    'addShot',
    'addShot',
    'finishPictures',
  ]);
  assert.deepEqual(exposures, [
    [0, 1],
    [1, 4],
  ]);
});

test('progress rises through the stages to 1', async () => {
  const reports: RecoveryProgress[] = [];
  const { done } = start(FOLDER, { onProgress: (progress) => reports.push(progress) });
  (await done).free();
  const stages = [...new Set(reports.map(({ stage }) => stage))];
  assert.deepEqual(stages, ['reading', 'preparing', 'recovering']);
  assert.ok(reports.every(({ fraction }, i) => fraction >= (reports[i - 1]?.fraction ?? 0)));
  assert.equal(reports.at(-1)?.fraction, 1);
  assert.equal(reports.at(-1)?.secondsLeft, 0);
});

test('an abort ends all workers at once, at every stage, with the reason of the signal', async () => {
  for (const method of ['readFolder', 'prepare', 'recoverTile', 'finish'] as const) {
    const controller = new AbortController();
    const { done, workers } = start(FOLDER, { signal: controller.signal });
    await settleUntil(() => workers.length === 2);
    if (workers[0]) workers[0].silentMethod = method;
    await settleUntil(() => workers[0]?.log.includes(method) === true);
    const reason = new Error('enough');
    controller.abort(reason);
    assert.ok(workers.every(({ hasEnded }) => hasEnded));
    await assert.rejects(done, reason);
  }
  const reason = new Error('before');
  const { done, workers } = start(FOLDER, { signal: AbortSignal.abort(reason) });
  await assert.rejects(done, reason);
  assert.equal(workers.length, 0);
});

test('an error of the coordinator keeps its code and ends all workers', async () => {
  const readFolder = () => {
    throw Object.assign(new Error('photos/3.png: is missing'), { code: 'capture-file' });
  };
  const { done, workers } = start(FOLDER, {}, { readFolder });
  await assert.rejects(done, { name: 'PhotoError', code: 'capture-file', message: /photos\/3/ });
  await settle();
  assert.ok(workers.every(({ hasEnded }) => hasEnded));
});

test('a recovery that takes too much memory does not start', async () => {
  const { done, workers } = start(FOLDER, { memoryLimit: 2 ** 20 });
  await assert.rejects(done, {
    code: 'recover-memory',
    message: /takes about \d+ MiB.*limit is 1 MiB/,
  });
  assert.equal(workers.length, 0);
});

test('what is missing in the browser is named', async () => {
  const { done } = start(FOLDER, {}, {}, { hasSimd: () => false });
  await assert.rejects(done, { code: 'wasm-simd' });
  const blocked = start(FOLDER, {}, {}, { startWorker: () => null });
  await assert.rejects(blocked.done, { code: 'worker-unavailable', message: /worker-src/ });
});

test('invalid options are named', async () => {
  const cases: readonly (readonly [Partial<PicturesInput>, RecoverOptions, RegExp])[] = [
    [{ patterns: [] }, {}, /^patterns is empty/],
    [{ photographs: [] }, {}, /^photographs is a list of 0; it must be a list of 2/],
    [{ exposures: [1] }, {}, /^exposures is a list of 1/],
    [{ exposures: [1, 0] }, {}, /^exposures is 0/],
    [{ grayCode: [] }, {}, /^correspondence is given with grayCode/],
    [{ lightGamma: 0 }, {}, /^lightGamma is 0/],
    [{ black: 70000 }, {}, /^black is 70000/],
    [{ white: 0 }, {}, /^white is 0/],
    [{}, { workers: 0 }, /^workers is 0/],
    [{}, { memoryLimit: -1 }, /^memoryLimit is -1/],
  ];
  for (const [input, options, message] of cases) {
    const { done } = start({ ...PICTURES, ...input }, options);
    await assert.rejects(done, { code: 'recover-options', message });
  }
  const ports = { startWorker: () => null, hasSimd: () => true };
  for (const settings of [{ window: 4 }, { window: 1e9 + 1 }, { quality: { snr: Number.NaN } }]) {
    const done = runRecovery(PICTURES, settings, {}, ports);
    await assert.rejects(done, { code: 'recover-options' });
  }
});

async function settleUntil(condition: () => boolean): Promise<void> {
  for (let i = 0; i < 2000 && !condition(); i += 1) {
    await new Promise((resolve) => setImmediate(resolve));
  }
  assert.ok(condition());
}
