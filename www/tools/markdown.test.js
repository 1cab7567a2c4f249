import assert from 'node:assert/strict';
import { test } from 'node:test';
import { buildPages } from './pages.js';

test('indented and fenced blocks of the documents are code on the site', async () => {
  const pages = await buildPages();
  for (const [path, code] of /** @type {const} */ ([
    ['docs/hosting.html', 'Content-Security-Policy: default-src'],
    ['docs/hosting.html', 'location ~'],
    ['docs/wordpress.html', '[relightable_photo src='],
    ['docs/format.html', '┌────'],
  ])) {
    const blocks = [...(pages.get(path) ?? '').matchAll(/<pre[^>]*><code[^>]*>(.*?)<\/code>/gs)];
    const texts = blocks.map(([, text]) => text ?? '');
    assert.ok(
      texts.some((text) => text.includes(code)),
      `${path}: ${code}`,
    );
  }
});
