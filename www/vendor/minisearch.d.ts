/** The site serves MiniSearch's module under this name. */
export { default } from 'minisearch';
