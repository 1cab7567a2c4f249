/** Builds the site's pages with Eleventy: those of www/pages, and the repository's documents. */

import { readdirSync, readFileSync, statSync } from 'node:fs';
import { join, relative } from 'node:path';
// @ts-expect-error: it comes without types
import Eleventy from '@11ty/eleventy';
import { DOCUMENT_GROUPS, DOCUMENTS, sitePath } from './documents.js';
import { documentMarkdown } from './markdown.js';
import { SEARCH_INDEX, searchIndex } from './search-index.js';

const repository = join(import.meta.dirname, '..', '..');
const PAGES_FOLDER = 'www/pages';

/** The hand-written pages, in the order of the menu. */
const OWN_PAGES = [
  { href: 'index.html', title: 'Gallery' },
  { href: 'playground.html', title: 'Playground' },
  { href: 'recover.html', title: 'Recover' },
  { href: 'how-it-works.html', title: 'How it works' },
];
/** The menu's entry for all documents leads to the first one. */
const DOCUMENTS_ENTRY = { href: sitePath(DOCUMENTS[0] ?? ''), title: 'Docs' };

/** The paths of the hand-written pages, and of all pages. */
export const HAND_WRITTEN = OWN_PAGES.map(({ href }) => href);
export const PAGES = [...HAND_WRITTEN, ...DOCUMENTS.map(sitePath)];

/** @typedef {{ page: { inputPath: string } }} Data of a page, from Eleventy */

/** The sample of a IIIF manifest, which contains the address of the site. */
export const MANIFEST = 'samples/manifest.json';

/** The package's version, and the name of its archive. */
export const { version: VERSION } = JSON.parse(
  readFileSync(join(repository, 'package.json'), 'utf8'),
);
export const ARCHIVE = `relightable-photo-${VERSION}.tgz`;

/** @returns {Promise<Map<string, string>>} the pages and the search index, by their paths on the site */
export async function buildPages() {
  const eleventy = new Eleventy(relative(process.cwd(), join(repository, PAGES_FOLDER)), '_site', {
    configPath: false,
    quietMode: true,
    config: configure,
  });
  /** @type {{ url: string, content: string }[]} */
  const built = await eleventy.toJSON();
  const pages = new Map(built.map(({ url, content }) => [url.slice(1) || 'index.html', content]));
  for (const page of PAGES) if (!pages.has(page)) throw new Error(`Eleventy built no ${page}`);
  const documents = DOCUMENTS.map(sitePath).map(
    (path) => /** @type {const} */ ([path, pages.get(path) ?? '']),
  );
  pages.set(SEARCH_INDEX, searchIndex(documents));
  return pages;
}

/** The pages, built again whenever a source is newer than they are. */
export function cachedPages() {
  let builtAt = 0;
  /** @type {Promise<Map<string, string>> | undefined} */
  let pages;
  return () => {
    const changedAt = lastChange();
    if (!pages || changedAt > builtAt) {
      builtAt = changedAt;
      pages = buildPages();
    }
    return pages;
  };
}

/**
 * The sample of a IIIF manifest with the URLs of the site.
 *
 * @param {string} base URL of the site, with a slash at its end
 */
export function manifestAt(base) {
  const text = readFileSync(join(repository, 'docs', MANIFEST), 'utf8');
  return text.replaceAll('https://museum.example/', base);
}

/** @param {any} config Eleventy's */
function configure(config) {
  config.setUseGitIgnore(false);
  config.setIncludesDirectory('_layouts');
  config.setTemplateFormats(['html', 'md', 'liquid']);
  config.setFrontMatterParsingOptions({ delimiters: ['<!--', '-->'] });
  config.amendLibrary('md', documentMarkdown);
  config.addGlobalData('layout', 'page.liquid');
  config.addGlobalData('permalink', () => addressOf);
  config.addGlobalData('version', VERSION);
  config.addGlobalData('archive', ARCHIVE);
  config.addGlobalData('menu', [...OWN_PAGES, DOCUMENTS_ENTRY]);
  config.addGlobalData('documents', documentMenu());
  config.addGlobalData('eleventyComputed', {
    href: addressOf,
    base: (/** @type {Data} */ data) => '../'.repeat(addressOf(data).split('/').length - 1),
    menuEntry: (/** @type {Data} */ data) =>
      HAND_WRITTEN.includes(addressOf(data)) ? addressOf(data) : DOCUMENTS_ENTRY.href,
  });
  for (const path of DOCUMENTS) {
    const text = readFileSync(join(repository, path), 'utf8');
    config.addTemplate(path, text, {
      layout: 'document.liquid',
      // Documents are Markdown alone.
      templateEngineOverride: 'md',
      title: `${titleOf(text)} · relightable-photo`,
      description: descriptionOf(text),
    });
  }
}

/** The path of a page on the site. Eleventy's input folder stands for the repository. @param {Data} data */
function addressOf({ page }) {
  return sitePath(page.inputPath.replace(`./${PAGES_FOLDER}/`, ''));
}

function documentMenu() {
  return DOCUMENT_GROUPS.map(({ title, entries }) => ({
    title,
    entries: entries.map(([path, title]) => ({ title, href: sitePath(path) })),
  }));
}

/** The text of a document's first heading. @param {string} text */
function titleOf(text) {
  return plain(/^# (.*)$/m.exec(text)?.[1] ?? '');
}

/** The first sentences of a document. @param {string} text */
function descriptionOf(text) {
  const paragraph = text.split(/\n{2,}/).find((block) => /^[A-Z`*]/.test(block)) ?? titleOf(text);
  return plain(paragraph).replace(/^(.{80,}?[.:]) .*$/, '$1');
}

/** Markdown without marks. @param {string} text */
function plain(text) {
  return text
    .replaceAll(/\[([^\]]*)\]\([^)]*\)/g, '$1')
    .replaceAll(/[`*]/g, '')
    .replaceAll(/\s+/g, ' ')
    .trim();
}

/** The time of the last change of a source. */
function lastChange() {
  const folders = [PAGES_FOLDER, `${PAGES_FOLDER}/_layouts`, 'docs'].flatMap((folder) =>
    readdirSync(join(repository, folder)).map((name) => join(folder, name)),
  );
  const files = [...folders, ...DOCUMENTS];
  return Math.max(...files.map((file) => statSync(join(repository, file)).mtimeMs));
}
