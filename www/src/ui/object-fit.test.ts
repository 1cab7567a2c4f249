import assert from 'node:assert/strict';
import test from 'node:test';
import { parsePosition } from './object-fit.js';

test('computed positions are shares of the free space and offsets', () => {
  const cases: [text: string, x: [number, number], y: [number, number]][] = [
    ['50% 50%', [0.5, 0], [0.5, 0]],
    ['0% 100%', [0, 0], [1, 0]],
    ['10px -2.5px', [0, 10], [0, -2.5]],
    ['calc(100% - 10px) calc(25% + 4px)', [1, -10], [0.25, 4]],
    ['calc(-10px + 100%) 20%', [1, -10], [0.2, 0]],
    ['', [0.5, 0], [0.5, 0]],
  ];
  for (const [text, x, y] of cases) {
    const [left, top] = parsePosition(text);
    assert.deepEqual([left.share, left.offset], x, text);
    assert.deepEqual([top.share, top.offset], y, text);
  }
});
