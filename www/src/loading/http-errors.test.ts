import assert from 'node:assert/strict';
import test from 'node:test';
import { fileName } from './http-errors.js';

test('the file name is the last part of the path', () => {
  assert.equal(fileName('https://museum.example/windows/rose.ltm?v=2'), 'rose.ltm');
  assert.equal(fileName('https://museum.example/'), 'museum.example');
});
