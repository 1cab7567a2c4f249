import assert from 'node:assert/strict';
import test from 'node:test';
import { START_ID, WorkerClient, type WorkerLike, type WorkerResponse } from './worker-client.js';

type Worker = WorkerLike<string, null, number>;

function fakeWorker() {
  const worker: Worker & { hasEnded: boolean } = {
    onmessage: null,
    onerror: null,
    onmessageerror: null,
    hasEnded: false,
    postMessage() {},
    terminate() {
      worker.hasEnded = true;
    },
  };
  const limits = { intervalMs: 10, maxChecks: 4, maxStartChecks: 4 };
  const options = { name: 'test worker', remedy: 'Try again.', limits };
  const client = new WorkerClient<string, null, number>(worker, options);
  const respond = (data: WorkerResponse<null, number>) =>
    worker.onmessage?.({ data } as MessageEvent<WorkerResponse<null, number>>);
  respond({ kind: 'done', id: START_ID, result: null });
  return { worker, client, respond };
}

const wait = (ms: number) => new Promise((resolve) => setTimeout(resolve, ms));

test('a long task lives as long as it reports progress', async () => {
  const { client, respond } = fakeWorker();
  const steps: number[] = [];
  const result = client.request('long', [], (done) => steps.push(done));
  for (let done = 1; done <= 10; done += 1) {
    await wait(20);
    respond({ kind: 'progress', id: 1, steps: done });
  }
  respond({ kind: 'done', id: 1, result: 42 });
  assert.equal(await result, 42);
  assert.deepEqual(steps, [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
});

test('a task that falls silent after some progress is given up', async () => {
  const { client, respond, worker } = fakeWorker();
  const result = client.request('long');
  respond({ kind: 'progress', id: 1, steps: 1 });
  await assert.rejects(result, { code: 'worker-unavailable', message: /does not answer/ });
  assert.ok(worker.hasEnded && client.isSilent);
});
