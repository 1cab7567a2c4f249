/** The site's pages: accessibility, links, widths, no scripts; the playground; the samples; the exported folder. */

import { execFileSync } from 'node:child_process';
import { existsSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';
import { gunzipSync } from 'node:zlib';
import { transform } from 'esbuild';
import { ARCHIVE, HAND_WRITTEN, PAGES } from '../../www/tools/pages.js';
import { expect, test } from './fixtures.js';
import { axeViolations, horizontalOverflow, saveScreenshot } from './page-helpers.js';
import { FOLDER } from './test-photos.js';

/** @typedef {import('@playwright/test').Page} Page */

const repository = join(import.meta.dirname, '../..');
const samples = join(repository, 'docs/samples');
const require = createRequire(import.meta.url);
const axe = readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');

/** @param {string} name */
const sample = (name) => readFileSync(join(samples, name), 'utf8');

/** Scrolls to each photograph and waits until it is drawn. @param {Page} page */
async function waitUntilDrawn(page) {
  for (const photo of await page.locator('relightable-photo').all()) {
    await photo.scrollIntoViewIfNeeded();
    await photo.locator('canvas').waitFor();
  }
  await page.evaluate('scrollTo(0, 0)');
}

/** The addresses in a page's attributes. @param {Page} page @returns {Promise<string[]>} */
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

test.describe('the site', () => {
  for (const name of PAGES) {
    // One load for all checks: it takes most of the time.
    test(`${name} is accessible and fits at every width, and needs no other host`, async ({
      openPage,
      server,
      step,
    }) => {
      const page = await openPage('/blank');
      /** @type {string[]} */
      const faults = [];
      page.on('console', (message) => {
        if (message.type() === 'error') faults.push(message.text());
      });
      page.on('request', (request) => {
        if (new URL(request.url()).origin !== server.origin) faults.push(request.url());
      });
      page.on('response', (response) => {
        if (response.status() >= 400) faults.push(`${response.status()} ${response.url()}`);
      });
      await page.goto(`/${name}`);
      await waitUntilDrawn(page);

      await step(`${name} has no broken link`, async () => {
        const inside = (await references(page)).filter((address) =>
          address.startsWith(server.origin),
        );
        expect(inside.length).toBeGreaterThan(8);
        /** @type {Map<string, string>} */
        const texts = new Map();
        for (const address of new Set(inside)) {
          const { href, hash } = new URL(address);
          const file = href.replace(hash, '');
          if (!texts.has(file)) {
            const response = await fetch(file);
            expect.soft(response.status, address).toBe(200);
            texts.set(file, await response.text());
          }
          if (hash)
            expect
              .soft(texts.get(file), `no element has the id of ${address}`)
              .toContain(`id="${hash.slice(1)}"`);
        }
      });

      // Without transitions, in which colours have less contrast.
      await page.emulateMedia({ reducedMotion: 'reduce' });
      await page.evaluate(axe);
      // Documents share one layout.
      const widths = HAND_WRITTEN.includes(name) ? [320, 390, 820, 1440] : [320, 1440];
      for (const width of widths) {
        await page.setViewportSize({ width, height: 900 });
        for (const colorScheme of /** @type {const} */ (['dark', 'light'])) {
          await page.emulateMedia({ colorScheme });
          const state = `${name} at ${width} pixels, ${colorScheme}`;
          await step(`${state}, does not scroll sideways`, async () =>
            expect(await horizontalOverflow(page)).toBe(0),
          );
          if (![390, 1440].includes(width)) continue;
          const picture = name.replace('.html', '').replace('/', '-');
          await saveScreenshot(page, `site-${picture}-${width}-${colorScheme}.png`);
          await step(`${state}, has no violation that axe finds`, async () =>
            expect(await axeViolations(page)).toStrictEqual([]),
          );
        }
      }

      await step(`${name} requests nothing from other hosts and logs no errors`, () =>
        expect(faults).toStrictEqual([]),
      );
    });
  }

  test('is readable without scripts, and has a title, a description and a menu entry for each page', async ({
    openPage,
    step,
  }) => {
    const page = await openPage('/blank', { javaScriptEnabled: false });
    const found = { titles: new Set(), descriptions: new Set() };
    for (const name of PAGES) {
      await page.goto(`/${name}`);
      await step(`${name} is readable without scripts`, async () => {
        expect(await page.getByRole('heading', { level: 1 }).first().isVisible()).toBeTruthy();
        const text = await page.getByRole('main').innerText();
        expect(text.length, `${text.length} characters`).toBeGreaterThan(500);
        for (const picture of await page.locator('relightable-photo noscript img').all()) {
          await picture.scrollIntoViewIfNeeded();
          expect(await picture.isVisible()).toBeTruthy();
        }
      });
      await step(`${name} has a language and a menu entry`, async () => {
        expect(await page.locator('html').getAttribute('lang')).toBe('en');
        const current = page.locator('nav [aria-current=page]').last();
        const href = (await current.getAttribute('href')) ?? '';
        expect(new URL(href, page.url()).pathname).toBe(`/${name}`);
      });
      found.titles.add(await page.title());
      found.descriptions.add(await page.locator('meta[name=description]').getAttribute('content'));
    }
    expect(found.titles.size).toBe(PAGES.length);
    expect(found.descriptions.size).toBe(PAGES.length);
    for (const text of [...found.titles, ...found.descriptions]) expect(text).toMatch(/\S{3}/);
  });

  test('begins with a skip link', async ({ openPage }) => {
    const page = await openPage('/how-it-works.html');
    await page.keyboard.press('Tab');
    await page.keyboard.press('Enter');
    expect(await page.evaluate('document.activeElement.id')).toBe('main');
  });

  test('pauses the fire under reduced motion, until the visitor starts it', async ({
    openPage,
  }) => {
    const page = await openPage('/?light=fire', { reducedMotion: 'reduce' });
    await page.locator('#photo canvas').waitFor();
    const paused = () => page.evaluate("document.getElementById('photo').paused");
    expect(await paused()).toBe(true);
    await page.getByRole('button', { name: 'Play the fire' }).click();
    expect(await paused()).toBe(false);
    await page.getByRole('button', { name: 'Pause the fire' }).click();
    expect(await paused()).toBe(true);
  });

  test('finds sections of the documents', async ({ openPage }) => {
    const page = await openPage('/docs/getting-started.html');
    const field = page.getByRole('searchbox', { name: 'Search the documents' });
    const results = page.locator('#search-results a');
    await field.fill('nginx');
    await expect(results.first()).toHaveText('nginx');
    await field.fill('Wordpres'); // with a missing letter
    await expect(page.locator('#search-results').getByText('WordPress').first()).toBeVisible();
    await field.fill('zyxwvut');
    await expect(page.getByRole('status').getByText('No results.')).toBeVisible();
    await field.fill('content security policy');
    await page.keyboard.press('Enter');
    await page.waitForURL(/#content-security-policy$/);
    await expect(
      page.getByRole('heading', { name: 'Content security policy' }).first(),
    ).toBeVisible();
  });

  test('offers the package for download', async ({ openPage, server }) => {
    const page = await openPage('/');
    const link = page.getByRole('link', { name: /^Download \d/ });
    expect(await link.getAttribute('href')).toBe(ARCHIVE);
    const response = await fetch(`${server.origin}/${ARCHIVE}`);
    expect(response.headers.get('content-type')).toBe('application/gzip');
    const archive = gunzipSync(Buffer.from(await response.arrayBuffer()));
    for (const name of ['package.json', 'dist/relightable-photo.js', 'docs/element.md']) {
      expect(archive.includes(`package/${name}\0`), name).toBeTruthy();
    }
  });
});

test.describe('the playground', () => {
  test('has a control for every attribute, and shows and keeps what it chooses', async ({
    openPage,
    step,
  }) => {
    const page = await openPage('/playground.html');
    await step('it has a control for every attribute', async () => {
      /** @type {string[]} */
      const attributes = await page.evaluate(async () => {
        const element = await customElements.whenDefined('relightable-photo');
        return [.../** @type {any} */ (element).observedAttributes];
      });
      for (const name of attributes) {
        if (name === 'lang') continue;
        expect(await page.getByLabel(name, { exact: true }).count(), name).toBe(1);
      }
    });
    // The chosen attributes, their HTML and the events are shown, and the address keeps them.
    await waitUntilDrawn(page);
    await page.getByLabel('light', { exact: true }).selectOption('stripes');
    await page.getByLabel('alt', { exact: true }).fill('A "window" & more');
    await page.getByLabel('controls', { exact: true }).uncheck();
    const html = page.locator('#html');
    await html.getByText('light="stripes"').waitFor();
    const code = await html.innerText();
    expect(code).toMatch(/alt="A &quot;window&quot; &amp; more"/);
    expect(code).not.toMatch(/controls/);
    await page.locator('#log').getByText('lightchange').first().waitFor();
    await page.reload();
    expect(await html.innerText()).toBe(code);
    expect(await page.locator('relightable-photo').getAttribute('light')).toBe('stripes');
    await page.getByRole('button', { name: 'Reset all' }).click();
    await html.getByText('light="torch"').waitFor();
    expect(new URL(page.url()).search).toBe('');
    await page.getByLabel('loading', { exact: true }).selectOption('lazy');
    await waitUntilDrawn(page);
    expect(await page.locator('relightable-photo').getAttribute('loading')).toBe('lazy');
  });
});

test.describe('the samples', () => {
  test('are shown unchanged', async ({ openPage }) => {
    const page = await openPage('/blank');
    const names = new Set();
    for (const name of PAGES.filter((page) => page.startsWith('docs/'))) {
      await page.goto(`/${name}`);
      for (const code of await page.locator('[data-sample]').all()) {
        const file = (await code.getAttribute('data-sample')) ?? '';
        expect(await code.textContent(), file).toBe(sample(file).trimEnd());
        names.add(file);
      }
    }
    expect([...names].sort()).toStrictEqual(readdirSync(samples).sort());
  });

  test('show their photograph', async ({ openPage, step }) => {
    const page = await openPage('/blank');
    for (const name of ['plain.html', 'iiif.html', 'kiosk.html']) {
      await step(`${name} shows its photograph`, async () => {
        await page.goto(`/samples/${name}`);
        await waitUntilDrawn(page);
        expect(await page.getByRole('img').first().getAttribute('aria-label')).toBeTruthy();
        expect(await page.getByRole('alert').count()).toBe(0);
      });
    }
  });

  test('the manifest follows IIIF Presentation 3', async ({ server }) => {
    const address = `${server.origin}/samples/manifest.json`;
    const manifest = await (await fetch(address)).json();
    expect(manifest['@context']).toBe('http://iiif.io/api/presentation/3/context.json');
    expect([manifest.id, manifest.type]).toStrictEqual([address, 'Manifest']);
    const ids = new Set();
    /** @param {any} thing @param {string} type */
    const checkResource = (thing, type) => {
      expect(thing.type).toBe(type);
      expect(URL.canParse(thing.id), thing.id).toBeTruthy();
      expect(thing.id.startsWith(server.origin), thing.id).toBeTruthy();
      expect(ids.has(thing.id), `${thing.id} is unique`).toBeFalsy();
      ids.add(thing.id);
      for (const text of [thing.label, thing.summary].filter(Boolean)) {
        for (const value of Object.values(text)) expect(Array.isArray(value)).toBeTruthy();
      }
    };
    checkResource(manifest, 'Manifest');
    expect(manifest.label, 'manifests must have a label').toBeTruthy();
    for (const canvas of manifest.items) {
      checkResource(canvas, 'Canvas');
      expect(canvas.width).toBeGreaterThan(0);
      expect(canvas.height).toBeGreaterThan(0);
      for (const [pages, motivation] of [
        [canvas.items, 'painting'],
        [canvas.annotations, 'supplementing'],
      ]) {
        for (const page of pages) {
          checkResource(page, 'AnnotationPage');
          for (const annotation of page.items) {
            checkResource(annotation, 'Annotation');
            expect(annotation.motivation).toBe(motivation);
            expect(annotation.target).toBe(canvas.id);
            checkResource(annotation.body, motivation === 'painting' ? 'Image' : 'Dataset');
            const response = await fetch(annotation.body.id);
            expect(response.headers.get('content-type')).toBe(annotation.body.format);
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

  test('Window.vue has a valid script and template', async ({ openPage }) => {
    const [, script = '', template = ''] =
      /^<script setup>\n(.*)<\/script>\n\n<template>\n(.*)<\/template>\n$/s.exec(
        sample('Window.vue'),
      ) ?? [];
    await transform(script, { target: 'es2022' });
    const page = await openPage('/blank');
    // An XML parser reports elements that are not closed. Vue's attribute names are not valid in XML.
    const xml = template.replace(/ [@:](?=[a-z])/g, ' v-').replaceAll('v-else', 'v-else=""');
    const fault = await page.evaluate(
      (xml) =>
        new DOMParser().parseFromString(xml, 'application/xml').querySelector('parsererror')
          ?.textContent,
      xml,
    );
    expect(fault).toBeUndefined();
  });

  test('the plugin for WordPress is PHP, and knows the element’s attributes', () => {
    const manifest = readFileSync(join(repository, 'dist/custom-elements.json'), 'utf8');
    /** @type {string[]} */
    const attributes = JSON.parse(manifest).modules[0].declarations.flatMap(
      (/** @type {any} */ declaration) =>
        declaration.customElement
          ? declaration.attributes.map((/** @type {any} */ { name }) => name)
          : [],
    );
    const { Engine } = require('php-parser');
    const parser = new Engine({ parser: { version: '7.4' } });
    const text = sample('relightable-photo.php');
    const program = parser.parseCode(text, 'plugin.php');
    // As on images.
    attributes.push('width', 'height');
    expect(program.kind).toBe('program');
    // The shortcode passes attributes on that the element has, among them those that place and expose the light.
    const names = stringsOf(program).filter((name) => attributes.includes(name));
    for (const [, list = ''] of text.matchAll(
      /\$(?:addresses|values|switches)\s*= array\(([^)]*)\)/g,
    )) {
      for (const [, name = ''] of list.matchAll(/'([^']*)'/g)) expect(attributes).toContain(name);
    }
    for (const name of ['src', 'alt', 'width', 'height', 'light-x', 'light-y', 'exposure']) {
      expect(names).toContain(name);
    }
    expect(() => parser.parseCode('<?php add_filter( ', 'plugin.php')).toThrow();
  });
});

/** All strings in a syntax tree of PHP. @param {unknown} node @returns {string[]} */
function stringsOf(node) {
  if (Array.isArray(node)) return node.flatMap(stringsOf);
  if (typeof node !== 'object' || node === null) return [];
  const { kind, value } = /** @type {{ kind?: string, value?: unknown }} */ (node);
  return kind === 'string' ? [String(value)] : Object.values(node).flatMap(stringsOf);
}

test('the exported site contains every file that it refers to', async () => {
  const out = join(repository, 'target/browser-tests/site');
  const exporter = join(repository, 'www/tools/export.js');
  execFileSync(process.execPath, [exporter, FOLDER, out, 'https://glass.example/photo/']);
  const manifest = readFileSync(join(out, 'samples/manifest.json'), 'utf8');
  expect(manifest).toMatch(/"https:\/\/glass\.example\/photo\/photos\/stained-glass\.ltm"/);
  expect(manifest).not.toMatch(/museum\.example/);
  for (const name of PAGES) {
    const html = readFileSync(join(out, name), 'utf8');
    for (const [, address = ''] of html.matchAll(
      /<[^>]* (?:href|src|data-index)="([^"#]+)[^"]*"/g,
    )) {
      if (/^https:/.test(address)) continue;
      expect(address, 'addresses are relative').not.toMatch(/^\//);
      const file = join(out, dirname(name), address);
      expect(existsSync(file), `${name} refers to ${address}`).toBeTruthy();
    }
  }
  for (const [, address = ''] of readFileSync(join(out, 'site/site.css'), 'utf8').matchAll(
    /url\("([^"]+)"\)/g,
  )) {
    expect(existsSync(join(out, 'site', address)), address).toBeTruthy();
  }
  rmSync(out, { recursive: true });
});
