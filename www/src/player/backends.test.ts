import assert from 'node:assert/strict';
import test from 'node:test';
import type { Backend } from '../engine/wasm-exports.js';
import { PhotoError } from '../shared/errors.js';
import { firstWorking } from './backends.js';

const { signal } = new AbortController();

test('the first backend that works has no reason', async () => {
  const working = await firstWorking(['webgl2', 'cpu'], async (backend) => `on ${backend}`, signal);
  assert.deepEqual(working, { value: 'on webgl2', reason: '' });
});

test('each failure leads to the next backend, and is a reason', async () => {
  const tried: Backend[] = [];
  const working = await firstWorking(
    ['webgpu', 'webgl2', 'cpu'],
    async (backend) => {
      tried.push(backend);
      if (backend !== 'cpu') throw new Error(`no ${backend} here`);
      return backend;
    },
    signal,
  );
  assert.deepEqual(tried, ['webgpu', 'webgl2', 'cpu']);
  assert.equal(working.reason, 'WebGPU: no webgpu here. WebGL2: no webgl2 here.');
});

test('if none works, the error has every reason', async () => {
  await assert.rejects(
    firstWorking(['webgpu', 'webgl2'], (backend) => Promise.reject(new Error(backend)), signal),
    {
      code: 'backend-unavailable',
      message: /WebGPU: webgpu\. WebGL2: webgl2\./,
    },
  );
});

test('a cancelled search tries no further', async () => {
  const tried: Backend[] = [];
  const abort = new AbortController();
  const search = firstWorking(
    ['webgpu', 'cpu'],
    (backend) => {
      tried.push(backend);
      abort.abort(new Error('cancelled'));
      return Promise.reject(new Error('no'));
    },
    abort.signal,
  );
  await assert.rejects(search, /cancelled/);
  assert.deepEqual(tried, ['webgpu']);
});

test('csp-wasm ends the search at once', async () => {
  const tried: Backend[] = [];
  const forbidden = new PhotoError('csp-wasm', 'WebAssembly may not run here.');
  const search = firstWorking(
    ['webgpu', 'cpu'],
    (backend) => {
      tried.push(backend);
      return Promise.reject(forbidden);
    },
    signal,
  );
  await assert.rejects(search, { code: 'csp-wasm' });
  assert.deepEqual(tried, ['webgpu']);
});
