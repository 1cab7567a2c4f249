import assert from 'node:assert/strict';
import test from 'node:test';

interface FakeWorker {
  readonly url: unknown;
}

test('a page that does not list the policy decides by its own policies whether a worker starts', async () => {
  const scope = globalThis as Record<string, unknown>;
  scope['trustedTypes'] = {
    createPolicy: () => {
      throw new TypeError('Policy "relightable-photo" disallowed.');
    },
  };
  scope['Worker'] = class {
    constructor(readonly url: unknown) {}
  };
  const { createTrustedWorker } = await import('./trusted-worker.js');
  const url = new URL('https://museum.example/worker.js');
  const worker = createTrustedWorker(() => new Worker(url)) as unknown as FakeWorker;
  assert.equal(worker.url, url);
});
