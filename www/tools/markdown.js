/** How the site shows Markdown: ids of headings as on GitHub, links between pages, code samples and tables. */

import { posix } from 'node:path';
import { DOCUMENTS, sitePath } from './documents.js';

/**
 * @typedef {object} Token of markdown-it
 * @property {string} type
 * @property {string} tag
 * @property {string} content
 * @property {Token[] | null} children
 * @property {[name: string, value: string][] | null} attrs
 * @property {(name: string) => string | null} attrGet
 * @property {(name: string, value: string) => void} attrSet
 */

/**
 * The id that GitHub gives a heading; repeated ones get a number.
 *
 * @param {string} text
 * @param {Map<string, number>} used of the page
 */
export function headingId(text, used) {
  const id = text
    .toLowerCase()
    .replaceAll(/[^\p{L}\p{N}\s_-]/gu, '')
    .trim()
    .replaceAll(/\s/g, '-');
  const count = used.get(id) ?? 0;
  used.set(id, count + 1);
  return count === 0 ? id : `${id}-${count}`;
}

/** The plain text of an inline token. @param {Token} inline */
export function textOf(inline) {
  const text = (inline.children ?? []).map(({ type, content }) =>
    type === 'softbreak' || type === 'hardbreak' ? ' ' : content,
  );
  return text.join('');
}

/**
 * The address on the site of a document's reference.
 *
 * @param {string} reference as written
 * @param {string} document its path in the repository
 */
export function siteReference(reference, document) {
  if (/^([a-z]+:|#)/.test(reference)) return reference;
  const [path = '', hash] = reference.split('#');
  const target = posix.join(posix.dirname(document), path);
  const address = posix.relative(posix.dirname(sitePath(document)), sitePath(target));
  return hash === undefined ? address : `${address}#${hash}`;
}

/**
 * Changes the rendering of the documents. `env.page.inputPath` is the document's path in Eleventy's input folder, which
 * is that in the repository.
 *
 * @param {any} md an instance of markdown-it
 */
export function documentMarkdown(md) {
  // Eleventy disables indented code blocks.
  md.enable('code');
  md.core.ruler.push('document', (/** @type {{ tokens: Token[], env: any }} */ { tokens, env }) => {
    const document = documentOf(env);
    if (!document) return;
    const used = new Map();
    tokens.forEach((token, i) => {
      const inline = tokens[i + 1];
      if (token.type === 'heading_open' && inline) {
        token.attrSet('id', headingId(textOf(inline), used));
      }
      // A header cell without text is no header.
      if (token.type === 'th_open' && inline?.content === '') {
        token.tag = 'td';
        const close = tokens[i + 2];
        if (close) close.tag = 'td';
      }
      const style = token.attrGet('style');
      if (style) {
        // The site's policy allows no styles in elements.
        const alignment = style.replace('text-align:', '');
        token.attrs = [['class', alignment]];
      }
      for (const child of token.children ?? []) {
        for (const name of ['href', 'src']) {
          const reference = child.attrGet(name);
          if (reference) child.attrSet(name, siteReference(reference, document));
        }
      }
    });
  });
  md.renderer.rules.fence = md.renderer.rules.code_block = (
    /** @type {Token[]} */ tokens,
    /** @type {number} */ index,
  ) => {
    const content = tokens[index]?.content ?? '';
    const file = sampleBefore(tokens, index);
    const label = file ?? `Code ${countUpTo(tokens, index, ['fence', 'code_block'])}`;
    const code = md.utils.escapeHtml(content.replace(/\n$/, ''));
    const caption = file ? `<figcaption>${file}</figcaption>` : '';
    const sample = file ? ` data-sample="${file}"` : '';
    return `<figure class="code">${caption}<pre tabindex="0" role="region" aria-label="${label}"><code${sample}>${code}</code></pre></figure>\n`;
  };
  md.renderer.rules.table_open = (/** @type {Token[]} */ tokens, /** @type {number} */ index) => {
    const label = `Table ${countUpTo(tokens, index, ['table_open'])}`;
    return `<div class="table" tabindex="0" role="region" aria-label="${label}"><table>\n`;
  };
  md.renderer.rules.table_close = () => '</table></div>\n';
}

/** How many tokens of some types there are up to an index. @param {Token[]} tokens @param {number} index @param {string[]} types */
function countUpTo(tokens, index, types) {
  return tokens.slice(0, index + 1).filter(({ type }) => types.includes(type)).length;
}

/** The name of the sample file that a code block repeats. @param {Token[]} tokens @param {number} index */
function sampleBefore(tokens, index) {
  const before = tokens[index - 1];
  return before?.type === 'html_block'
    ? /^<!-- sample: samples\/(\S+) -->/.exec(before.content)?.[1]
    : undefined;
}

/** @param {{ page?: { inputPath?: string } }} env @returns {string | undefined} */
function documentOf(env) {
  const path = env.page?.inputPath ?? '';
  return DOCUMENTS.find((document) => path.endsWith(`/${document}`));
}
