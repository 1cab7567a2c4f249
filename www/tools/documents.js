/** The documents that the site shows: Markdown files of the repository. */

/**
 * Paths in the repository and titles in the menu, by readers.
 *
 * @type {readonly { title: string, entries: readonly (readonly [path: string, title: string])[] }[]}
 */
export const DOCUMENT_GROUPS = [
  {
    title: 'Put it on a page',
    entries: [
      ['docs/getting-started.md', 'Getting started'],
      ['docs/package.md', 'Bundlers and Node'],
      ['docs/react.md', 'React and Next'],
      ['docs/vue.md', 'Vue'],
      ['docs/wordpress.md', 'WordPress'],
      ['docs/iiif.md', 'IIIF'],
      ['docs/kiosk.md', 'Kiosk'],
      ['docs/recover.md', 'Recovery in a page'],
    ],
  },
  {
    title: 'Reference',
    entries: [
      ['docs/element.md', 'The element'],
      ['docs/hosting.md', 'Hosting'],
      ['docs/troubleshooting.md', 'Troubleshooting'],
      ['CHANGELOG.md', 'Changes'],
    ],
  },
  {
    title: 'Make photographs',
    entries: [
      ['docs/shooting.md', 'From a display to a capture'],
      ['docs/capture.md', 'The capture folder'],
      ['docs/cli.md', 'ltm-export'],
      ['docs/cluster.md', 'Collections and clusters'],
      ['docs/results.md', 'Accuracy'],
    ],
  },
  {
    title: 'Work on it',
    entries: [
      ['docs/architecture.md', 'Architecture'],
      ['CONTRIBUTING.md', 'Contributing'],
      ['docs/format.md', 'The .ltm format'],
      ['docs/glossary.md', 'Glossary'],
    ],
  },
];

/** The paths of all documents. */
export const DOCUMENTS = DOCUMENT_GROUPS.flatMap(({ entries }) => entries.map(([path]) => path));

/** The documents in the npm package: the figures of this one are larger than all other documents. */
export const PACKED_DOCUMENTS = DOCUMENTS.filter((path) => path !== 'docs/results.md');

/** Folders of the repository that documents refer to, by their paths on the site. */
const SITE_FOLDERS = [['docs/samples/', 'samples/']];

/**
 * The path on the site of a file in the repository.
 *
 * @param {string} path
 */
export function sitePath(path) {
  if (DOCUMENTS.includes(path)) return path.replace(/\.md$/, '.html');
  for (const [from = '', to = ''] of SITE_FOLDERS) {
    if (path.startsWith(from)) return to + path.slice(from.length);
  }
  return path;
}
