/** The index for the search of the documents: a record for each section. */

import MiniSearch from 'minisearch';
import { SEARCH_OPTIONS } from '../site/search-options.js';

/** Path of the index on the site. */
export const SEARCH_INDEX = 'docs/search.json';

/**
 * @param {readonly (readonly [path: string, html: string])[]} pages
 * @returns {string} JSON for `MiniSearch.loadJSON`
 */
export function searchIndex(pages) {
  const search = new MiniSearch(SEARCH_OPTIONS);
  for (const [path, html] of pages) search.addAll(sections(path, html));
  return JSON.stringify(search);
}

/**
 * The sections of a document: the text from each heading to the next one.
 *
 * @param {string} path
 * @param {string} html
 */
function sections(path, html) {
  const article = /<article[^>]*>(.*)<\/article>/s.exec(html)?.[1] ?? '';
  const [, ...parts] = article.split(/(?=<h[1-4] id=)/);
  const page = textOf(/<h1[^>]*>(.*?)<\/h1>/s.exec(article)?.[1] ?? '');
  return parts.map((part) => {
    const [, id = '', heading = '', text = ''] =
      /^<h[1-4] id="([^"]*)"[^>]*>(.*?)<\/h[1-4]>(.*)$/s.exec(part) ?? [];
    return { id: `${path}#${id}`, page, title: textOf(heading), text: textOf(text) };
  });
}

/** @param {string} html */
function textOf(html) {
  return html
    .replaceAll(/<[^>]*>/g, ' ')
    .replaceAll('&lt;', '<')
    .replaceAll('&gt;', '>')
    .replaceAll('&quot;', '"')
    .replaceAll('&amp;', '&')
    .replaceAll(/\s+/g, ' ')
    .trim();
}
