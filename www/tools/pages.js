/**
 * Composes the site's pages from www/pages and their common layout. The code samples are files of their own, so that
 * the tests run exactly what a page shows.
 */

import { readFileSync } from 'node:fs';
import { join } from 'node:path';

const www = join(import.meta.dirname, '..');

/** File names of the pages, in the order of the menu. */
export const PAGES = [
  'index.html',
  'playground.html',
  'how-it-works.html',
  'integration.html',
  'troubleshooting.html',
];

/**
 * @param {string} name one of `PAGES`
 * @returns {string} the whole page
 */
export function composePage(name) {
  const source = read(`pages/${name}`);
  const main = source
    .replace(/^(<!-- \w+: .* -->\n)+/, '')
    .replace(/^ *{{sample ([\w.-]+)}}$/gm, (_, file) => sample(file));
  const fields = {
    title: field(source, 'title'),
    description: field(source, 'description'),
    styles: field(source, 'styles')
      .split(' ')
      .filter(Boolean)
      .map((href) => `<link rel="stylesheet" href="${href}" />`)
      .join('\n    '),
    scripts: field(source, 'scripts')
      .split(' ')
      .filter(Boolean)
      .map((src) => `<script type="module" src="${src}"></script>`)
      .join('\n    '),
    main,
  };
  return read('pages/layout.html')
    .replaceAll(`<a href="${name}">`, `<a href="${name}" aria-current="page">`)
    .replace(/{{(\w+)}}/g, (_, key) => fields[/** @type {keyof typeof fields} */ (key)]);
}

/**
 * The sample of a IIIF manifest with the URLs of the site.
 *
 * @param {string} base URL of the site, with a slash at its end
 */
export function manifestAt(base) {
  return read('samples/manifest.json').replaceAll('https://museum.example/', base);
}

/** @param {string} text */
function escapeHtml(text) {
  return text.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('>', '&gt;');
}

/** @param {string} file in www/samples */
function sample(file) {
  const code = escapeHtml(read(`samples/${file}`).trimEnd());
  return `<figure class="code"><figcaption>${file}</figcaption><pre tabindex="0" role="region" aria-label="${file}"><code data-sample="${file}">${code}</code></pre></figure>`;
}

/** @param {string} source @param {string} name of one of the comments at the beginning */
function field(source, name) {
  return new RegExp(`^<!-- ${name}: (.*) -->$`, 'm').exec(source)?.[1] ?? '';
}

/** @param {string} path in www */
function read(path) {
  return readFileSync(join(www, path), 'utf8');
}
