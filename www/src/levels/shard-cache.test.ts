import assert from 'node:assert/strict';
import test from 'node:test';
import { type CachedShard, ShardCache } from './shard-cache.js';

/** A cache of 100 bytes, shards of 40, and the names of those that were freed. */
function createCache() {
  const evicted: string[] = [];
  const cache = new ShardCache(100);
  const add = (name: string): CachedShard => {
    const shard = { bytes: 40, evict: () => void evicted.push(name) };
    cache.add(shard);
    return shard;
  };
  return { cache, add, evicted };
}

test('the least recently seen go first', () => {
  const { cache, add, evicted } = createCache();
  const [a, b] = [add('a'), add('b')];
  cache.show('element', [b], new Set([b]));
  cache.show('element', [a], new Set([a]));
  const c = add('c');
  cache.show('element', [c], new Set([c]));
  assert.deepEqual(evicted, ['b']);
});

test('a shard that is to be loaded has room made for it', () => {
  const { cache, add, evicted } = createCache();
  const a = add('a');
  add('b');
  // A shard that is shown stays, whether or not it is needed.
  cache.show('element', [a], new Set());
  const release = cache.reserve(40);
  assert.deepEqual(evicted, ['b']);
  cache.reserve(40);
  assert.deepEqual(evicted, ['b']);
  cache.show('element', [a], new Set());
  assert.deepEqual(evicted, ['b'], 'and while the other is loaded');
  cache.show('element', [], new Set());
  const again = cache.reserve(0);
  assert.deepEqual(evicted, ['b', 'a']);
  add('c');
  again();
  release();
  cache.reserve(20);
  assert.deepEqual(evicted, ['b', 'a'], 'the room is free again');
  cache.reserve(1);
  assert.deepEqual(evicted, ['b', 'a', 'c']);
});

test('what an element shows and does not need stays only if there is room', () => {
  const { cache, add, evicted } = createCache();
  const [a, b] = [add('a'), add('b')];
  cache.show('element', [a, b], new Set([b]));
  assert.deepEqual(evicted, []);
  const c = add('c');
  cache.show('element', [a, b, c], new Set([b, c]));
  assert.deepEqual(evicted, ['a']);
});

test('what any element needs stays', () => {
  const { cache, add, evicted } = createCache();
  const [a, b] = [add('a'), add('b')];
  cache.show('one', [a, b], new Set([a, b]));
  const c = add('c');
  cache.show('other', [c], new Set([c]));
  assert.deepEqual(evicted, []);
  cache.delete(a);
  cache.remove('one');
  const d = add('d');
  cache.show('other', [c, d], new Set([c, d]));
  assert.deepEqual(evicted, ['b']);
});
