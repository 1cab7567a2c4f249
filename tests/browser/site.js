/** The site: every page whole, accessible, by itself, in every width; and the samples it shows, run. */

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, readFileSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { transform } from 'esbuild';
import { composePage, PAGES } from '../../www/tools/pages.js';
import { openPage, origin } from './browser.js';
import { FOLDER, SCREENSHOTS } from './photos.js';

/** @typedef {import('playwright-core').Page} Page */

const repository = join(import.meta.dirname, '../..');
const samples = join(repository, 'www/samples');
const require = createRequire(import.meta.url);
const axe = readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');

/** @param {string} name */
const sample = (name) => readFileSync(join(samples, name), 'utf8');

/** Those that a visitor sees are drawn. @param {Page} page */
async function drawn(page) {
  for (const photo of await page.locator('relightable-photo').all()) {
    await photo.scrollIntoViewIfNeeded();
    await photo.locator('canvas').waitFor();
  }
  await page.evaluate('scrollTo(0, 0)');
}

/** What a page refers to, by element. @param {Page} page @returns {Promise<string[]>} */
function references(page) {
  return page.evaluate(() =>
    [...document.querySelectorAll('[href], [src], [data-manifest]')].flatMap((element) => {
      const names = ['href', 'src', 'data-manifest'];
      return names.flatMap((name) => {
        const value = element.getAttribute(name);
        return value ? [new URL(value, document.baseURI).href] : [];
      });
    }),
  );
}

describe('the site', () => {
  for (const name of PAGES) {
    for (const colorScheme of /** @type {const} */ (['light', 'dark'])) {
      for (const width of [390, 1440]) {
        test(`${name} has no violation axe knows of, ${colorScheme}, ${width}`, async (t) => {
          const viewport = { width, height: 900 };
          const page = await openPage(t, `/${name}`, {
            viewport,
            colorScheme,
            reducedMotion: 'reduce',
          });
          await drawn(page);
          await page.evaluate(axe);
          const { violations } = await page.evaluate('axe.run()');
          const found = violations.map(
            (/** @type {any} */ { id, nodes }) =>
              `${id}: ${nodes.map((/** @type {any} */ node) => node.html).join(' ')}`,
          );
          assert.deepEqual(found, []);
        });
      }
    }

    test(`${name} asks nothing of other hosts, and complains of nothing`, async (t) => {
      const page = await openPage(t, `/${name}`);
      /** @type {string[]} */
      const faults = [];
      page.on('console', (message) => {
        if (message.type() === 'error') faults.push(message.text());
      });
      page.on('request', (request) => {
        if (new URL(request.url()).origin !== origin) faults.push(request.url());
      });
      page.on('response', (response) => {
        if (response.status() >= 400) faults.push(`${response.status()} ${response.url()}`);
      });
      await page.reload();
      await drawn(page);
      assert.deepEqual(faults, []);
    });

    test(`${name} has no dead link`, async (t) => {
      const page = await openPage(t, `/${name}`);
      const inside = (await references(page)).filter((address) => address.startsWith(origin));
      assert.ok(inside.length > 8);
      for (const address of new Set(inside)) {
        const response = await fetch(address);
        assert.equal(response.status, 200, address);
        const { hash } = new URL(address);
        const text = await response.text();
        if (hash) assert.ok(text.includes(`id="${hash.slice(1)}"`), `nothing is at ${address}`);
      }
    });

    for (const width of [320, 390, 820, 1440]) {
      test(`${name} fits ${width} pixels`, async (t) => {
        const page = await openPage(t, `/${name}`, { viewport: { width, height: 900 } });
        const room = await page.evaluate(
          'document.documentElement.scrollWidth - document.documentElement.clientWidth',
        );
        assert.equal(room, 0, 'it scrolls sideways');
        const path = join(SCREENSHOTS, `site-${name.replace('.html', '')}-${width}.png`);
        await page.screenshot({ path, fullPage: true });
      });
    }

    test(`${name} can be read without scripts`, async (t) => {
      const page = await openPage(t, `/${name}`, { javaScriptEnabled: false });
      assert.ok(await page.getByRole('heading', { level: 1 }).isVisible());
      const text = await page.getByRole('main').innerText();
      assert.ok(text.length > 500, `${text.length} characters`);
      for (const picture of await page.locator('relightable-photo noscript img').all()) {
        await picture.scrollIntoViewIfNeeded();
        assert.ok(await picture.isVisible());
      }
    });
  }

  test('has pages with a title, a description and a place in the menu of their own', async (t) => {
    const page = await openPage(t, '/');
    const seen = { titles: new Set(), descriptions: new Set() };
    for (const name of PAGES) {
      await page.goto(`/${name}`);
      seen.titles.add(await page.title());
      seen.descriptions.add(await page.locator('meta[name=description]').getAttribute('content'));
      assert.equal(await page.locator('html').getAttribute('lang'), 'en');
      assert.equal(await page.locator('nav [aria-current=page]').getAttribute('href'), name);
    }
    assert.equal(seen.titles.size, PAGES.length);
    assert.equal(seen.descriptions.size, PAGES.length);
    for (const text of [...seen.titles, ...seen.descriptions]) assert.match(text, /\S{3}/);
  });

  test('begins with a link to the content', async (t) => {
    const page = await openPage(t, '/how-it-works.html');
    await page.keyboard.press('Tab');
    await page.keyboard.press('Enter');
    assert.equal(await page.evaluate('document.activeElement.id'), 'main');
  });

  test('keeps its fire still for who asks for less motion, until they let it burn', async (t) => {
    const page = await openPage(t, '/', { reducedMotion: 'reduce' });
    await drawn(page);
    const paused = () => page.evaluate("document.getElementById('photo').paused");
    assert.equal(await paused(), true);
    await page.getByRole('button', { name: 'Play the fire' }).click();
    assert.equal(await paused(), false);
    await page.getByRole('button', { name: 'Pause the fire' }).click();
    assert.equal(await paused(), true);
  });

  test('tells of every failure there is a code for', () => {
    const codes = readFileSync(join(repository, 'www/src/shared/errors.ts'), 'utf8').matchAll(
      /^ +\| '([a-z-]+)'/gm,
    );
    const page = composePage('troubleshooting.html');
    const told = [...page.matchAll(/<tr id="([a-z-]+)">/g)].map(([, code]) => code).sort();
    assert.ok(told.length >= 25);
    assert.deepEqual([...codes].map(([, code]) => code).sort(), told);
  });
});

describe('the playground', () => {
  test('has a control for every attribute', async (t) => {
    const page = await openPage(t, '/playground.html');
    /** @type {string[]} */
    const attributes = await page.evaluate(async () => {
      const element = await customElements.whenDefined('relightable-photo');
      return [.../** @type {any} */ (element).observedAttributes];
    });
    for (const name of attributes) {
      if (name === 'lang') continue;
      assert.equal(await page.getByLabel(name, { exact: true }).count(), 1, name);
    }
  });

  test('shows what is chosen, its HTML and events, and keeps it in the address', async (t) => {
    const page = await openPage(t, '/playground.html');
    await drawn(page);
    await page.getByLabel('light', { exact: true }).selectOption('stripes');
    await page.getByLabel('alt', { exact: true }).fill('A "window" & more');
    await page.getByLabel('controls', { exact: true }).uncheck();
    const html = page.locator('#html');
    await html.getByText('light="stripes"').waitFor();
    const code = await html.innerText();
    assert.match(code, /alt="A &quot;window&quot; &amp; more"/);
    assert.doesNotMatch(code, /controls/);
    await page.locator('#log').getByText('lightchange').first().waitFor();
    await page.reload();
    assert.equal(await html.innerText(), code);
    assert.equal(await page.locator('relightable-photo').getAttribute('light'), 'stripes');
    await page.getByRole('button', { name: 'Reset all' }).click();
    await html.getByText('light="torch"').waitFor();
    assert.equal(new URL(page.url()).search, '');
    await page.getByLabel('loading', { exact: true }).selectOption('eager');
    await drawn(page);
    assert.equal(await page.locator('relightable-photo').getAttribute('loading'), 'eager');
  });
});

describe('the samples', () => {
  test('are on the page as they are', async (t) => {
    const page = await openPage(t, '/integration.html');
    const shown = await page.locator('[data-sample]').all();
    assert.ok(shown.length >= 12);
    for (const code of shown) {
      const name = (await code.getAttribute('data-sample')) ?? '';
      assert.equal(await code.textContent(), sample(name).trimEnd(), name);
    }
  });

  for (const name of ['plain.html', 'iiif.html', 'kiosk.html']) {
    test(`${name} shows its photograph`, async (t) => {
      const page = await openPage(t, `/samples/${name}`);
      await drawn(page);
      assert.ok(await page.getByRole('img').first().getAttribute('aria-label'));
      assert.equal(await page.getByRole('alert').count(), 0);
    });
  }

  test('the manifest has what IIIF Presentation 3 asks for', async () => {
    const address = `${origin}/samples/manifest.json`;
    const manifest = await (await fetch(address)).json();
    assert.equal(manifest['@context'], 'http://iiif.io/api/presentation/3/context.json');
    assert.deepEqual([manifest.id, manifest.type], [address, 'Manifest']);
    const ids = new Set();
    /** @param {any} thing @param {string} type */
    const check = (thing, type) => {
      assert.equal(thing.type, type);
      assert.ok(URL.canParse(thing.id) && thing.id.startsWith(origin), thing.id);
      assert.ok(!ids.has(thing.id), `${thing.id} is there twice`);
      ids.add(thing.id);
      for (const text of [thing.label, thing.summary].filter(Boolean)) {
        for (const value of Object.values(text)) assert.ok(Array.isArray(value));
      }
    };
    check(manifest, 'Manifest');
    assert.ok(manifest.label, 'manifests must have a label');
    for (const canvas of manifest.items) {
      check(canvas, 'Canvas');
      assert.ok(canvas.width > 0 && canvas.height > 0);
      for (const [pages, motivation] of [
        [canvas.items, 'painting'],
        [canvas.annotations, 'supplementing'],
      ]) {
        for (const page of pages) {
          check(page, 'AnnotationPage');
          for (const annotation of page.items) {
            check(annotation, 'Annotation');
            assert.equal(annotation.motivation, motivation);
            assert.equal(annotation.target, canvas.id);
            check(annotation.body, motivation === 'painting' ? 'Image' : 'Dataset');
            const response = await fetch(annotation.body.id);
            assert.equal(response.headers.get('content-type'), annotation.body.format);
            await response.body?.cancel();
          }
        }
      }
    }
  });

  for (const name of ['Window.jsx', 'vite.config.js', 'iiif.js', 'kiosk.js']) {
    test(`${name} is JavaScript`, async () => {
      await transform(sample(name), {
        loader: name.endsWith('x') ? 'jsx' : 'js',
        target: 'es2022',
      });
    });
  }

  test('Window.vue is a script and a template', async (t) => {
    const [, script = '', template = ''] =
      /^<script setup>\n(.*)<\/script>\n\n<template>\n(.*)<\/template>\n$/s.exec(
        sample('Window.vue'),
      ) ?? [];
    await transform(script, { target: 'es2022' });
    const page = await openPage(t, '/blank');
    // As XML every element has to be closed. Vue's own names of attributes are none of XML's.
    const xml = template.replace(/ [@:](?=[a-z])/g, ' v-').replaceAll('v-else', 'v-else=""');
    const fault = await page.evaluate(
      (xml) =>
        new DOMParser().parseFromString(xml, 'application/xml').querySelector('parsererror')
          ?.textContent,
      xml,
    );
    assert.equal(fault, undefined);
  });

  test('the plugin for WordPress is PHP', () => {
    const { Engine } = require('php-parser');
    const parser = new Engine({ parser: { version: '7.4' } });
    assert.equal(parser.parseCode(sample('relightable-photo.php'), 'plugin.php').kind, 'program');
    assert.throws(() => parser.parseCode('<?php add_filter( ', 'plugin.php'));
  });
});

test('the site is exported as a folder that has all it needs', async () => {
  const out = join(repository, 'target/browser-tests/site');
  const exporter = join(repository, 'www/tools/export.js');
  execFileSync(process.execPath, [exporter, FOLDER, out, 'https://glass.example/photo/']);
  const manifest = readFileSync(join(out, 'samples/manifest.json'), 'utf8');
  assert.match(manifest, /"https:\/\/glass\.example\/photo\/photos\/stained-glass\.ltm"/);
  assert.doesNotMatch(manifest, /museum\.example/);
  for (const name of PAGES) {
    const html = readFileSync(join(out, name), 'utf8');
    for (const [, address = ''] of html.matchAll(/<[^>]* (?:href|src)="([^"#]+)[^"]*"/g)) {
      if (/^https:/.test(address)) continue;
      assert.doesNotMatch(address, /^\//, 'addresses are relative');
      assert.ok(existsSync(join(out, address)), `${name} refers to ${address}`);
    }
  }
  for (const [, address = ''] of readFileSync(join(out, 'site/site.css'), 'utf8').matchAll(
    /url\("([^"]+)"\)/g,
  )) {
    assert.ok(existsSync(join(out, 'site', address)), address);
  }
  rmSync(out, { recursive: true });
});
