import assert from 'node:assert/strict';
import test from 'node:test';
import type { Backend } from '../engine/types.js';
import { PhotoError } from '../shared/errors.js';
import { backendsAfter, backendsFrom, firstWorking } from './backends.js';

const always = () => {};

test('the first choice is taken without a reason', async () => {
  const chosen = await firstWorking(['webgl2', 'cpu'], async (backend) => `on ${backend}`, always);
  assert.deepEqual(chosen, { backend: 'webgl2', value: 'on webgl2', reason: '' });
});

test('each failure leads to the next and is told', async () => {
  const tried: Backend[] = [];
  const chosen = await firstWorking(
    ['webgpu', 'webgl2', 'cpu'],
    async (backend) => {
      tried.push(backend);
      if (backend !== 'cpu') throw new Error(`no ${backend} here`);
      return backend;
    },
    always,
  );
  assert.deepEqual(tried, ['webgpu', 'webgl2', 'cpu']);
  assert.equal(chosen.reason, 'WebGPU: no webgpu here. WebGL2: no webgl2 here.');
});

test('none working is backend-unavailable, with every reason', async () => {
  await assert.rejects(
    firstWorking(['webgpu', 'webgl2'], (backend) => Promise.reject(new Error(backend)), always),
    {
      code: 'backend-unavailable',
      message: /WebGPU: webgpu\. WebGL2: webgl2\./,
    },
  );
});

test('a search nobody waits for tries no further', async () => {
  const tried: Backend[] = [];
  const search = firstWorking(
    ['webgpu', 'cpu'],
    (backend) => {
      tried.push(backend);
      return Promise.reject(new Error('no'));
    },
    () => {
      throw new Error('abandoned');
    },
  );
  await assert.rejects(search, /abandoned/);
  assert.deepEqual(tried, ['webgpu']);
});

test('after a loss, those further down the order are left', () => {
  assert.deepEqual(backendsAfter(['webgpu', 'webgl2', 'cpu'], 'webgl2'), ['cpu']);
  assert.deepEqual(backendsAfter(['cpu'], 'cpu'), []);
  assert.deepEqual(backendsFrom(['webgpu', 'webgl2', 'cpu'], 'webgl2'), ['webgl2', 'cpu']);
});

test('what no back end is allowed to do is told at once', async () => {
  const tried: Backend[] = [];
  const refused = new PhotoError('csp-wasm', 'WebAssembly may not run here.');
  const search = firstWorking(
    ['webgpu', 'cpu'],
    (backend) => {
      tried.push(backend);
      return Promise.reject(refused);
    },
    () => {},
  );
  await assert.rejects(search, { code: 'csp-wasm' });
  assert.deepEqual(tried, ['webgpu']);
});
