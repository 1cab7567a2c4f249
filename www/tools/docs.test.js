import assert from 'node:assert/strict';
import { test } from 'node:test';
import { outdatedDocuments } from './docs.js';

test('the generated parts of the documents agree with their sources', async () => {
  const outdated = await outdatedDocuments();
  assert.deepEqual(
    outdated.map(({ path }) => path),
    [],
    'Run: npm run docs',
  );
});
