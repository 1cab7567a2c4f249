import assert from 'node:assert/strict';
import test from 'node:test';
import { nameOf } from './http-errors.js';

test('a file is called by the last part of its path', () => {
  assert.equal(nameOf('https://museum.example/windows/rose.ltm?v=2'), 'rose.ltm');
  assert.equal(nameOf('https://museum.example/'), 'museum.example');
});
