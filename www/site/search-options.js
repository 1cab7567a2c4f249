/** What the search of the documents indexes; the site's build and its pages have to agree. */

/** @type {import('minisearch').Options} */
export const SEARCH_OPTIONS = {
  fields: ['title', 'text', 'page'],
  storeFields: ['page', 'title'],
  searchOptions: { boost: { title: 4, page: 2 }, prefix: true, fuzzy: 0.15, combineWith: 'AND' },
};
