/** Searches the documents. The index is fetched when the field gets the focus. */

import MiniSearch from '../vendor/minisearch.js';
import { SEARCH_OPTIONS } from './search-options.js';

const MAX_RESULTS = 12;

const form = /** @type {HTMLFormElement} */ (document.querySelector('.search'));
const field = /** @type {HTMLInputElement} */ (document.getElementById('search'));
const list = /** @type {HTMLOListElement} */ (document.getElementById('search-results'));
const status = /** @type {HTMLElement} */ (document.getElementById('search-status'));

const indexUrl = new URL(form.dataset['index'] ?? '', document.baseURI);
/** The site's own folder: the index is in its folder docs/. */
const siteUrl = new URL('..', indexUrl);

/** @type {Promise<MiniSearch> | undefined} */
let loading;
form.hidden = false;
form.addEventListener('submit', (event) => {
  event.preventDefault();
  list.querySelector('a')?.click();
});
field.addEventListener('focus', () => void load().catch(() => {}));
field.addEventListener('input', () => void search());

function load() {
  loading ??= fetch(indexUrl)
    .then((response) => response.text())
    .then((text) => MiniSearch.loadJSON(text, SEARCH_OPTIONS))
    .catch((error) => {
      loading = undefined;
      throw error;
    });
  return loading;
}

async function search() {
  const query = field.value.trim();
  if (!query) return show([]);
  try {
    const index = await load();
    // A later input has its own call.
    if (field.value.trim() === query) show(index.search(query).slice(0, MAX_RESULTS), query);
  } catch {
    show([]);
    status.textContent = 'The search index could not be loaded.';
  }
}

/**
 * @param {import('minisearch').SearchResult[]} results
 * @param {string} [query] empty if there is none
 */
function show(results, query = '') {
  list.replaceChildren(
    ...results.map(({ id, title, page }) => {
      const link = document.createElement('a');
      link.href = new URL(id, siteUrl).href;
      link.textContent = title;
      const item = document.createElement('li');
      item.append(link);
      if (page !== title) {
        const where = document.createElement('small');
        where.textContent = page;
        item.append(where);
      }
      return item;
    }),
  );
  list.hidden = results.length === 0;
  status.classList.toggle('visually-hidden', !query || results.length > 0);
  status.textContent = query ? `${results.length || 'No'} results.` : '';
}
