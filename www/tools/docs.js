/**
 * Writes the generated parts of the documents: node www/tools/docs.js [--check]
 * With --check it changes nothing, and exits with 1 if a document is out of date.
 */

import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { elementOf, makeManifest } from './manifest.js';
import { parseTypeScript, ts } from './typescript-api.js';

const docs = join(import.meta.dirname, '..', '..', 'docs');
const ERROR_CODES = 'www/src/shared/error-codes.ts';
const ENGLISH_TEXTS = 'www/src/i18n/en.ts';

/** The generated parts, by the names in their marks: <!-- begin: NAME --> … <!-- end: NAME --> */
const PARTS = {
  'error codes': errorCodes,
  attributes: () => table(['attribute', ''], attributes()),
  properties: () => table(['property', 'type', ''], properties()),
  methods: () => table(['method', ''], methods(false)),
  configuration: () => table(['static member', ''], [...statics(), ...methods(true)]),
  texts: () => table(['name', 'English text'], texts()),
  events: () => table(['event', ''], named(element.events)),
  slots: () => table(['slot', ''], named(element.slots)),
  states: () => table(['state', ''], named(element.cssStates)),
  'css parts': () => table(['part', ''], named(element.cssParts)),
  'custom properties': () => table(['custom property', ''], named(element.cssProperties)),
};

/** @typedef {import('./manifest-plugin.js').Member} Member */

const element = elementOf(await makeManifest());

/**
 * The documents whose generated parts differ from their sources, with their text as it should be.
 *
 * @returns {Promise<{ path: string, text: string }[]>}
 */
export async function outdatedDocuments() {
  const outdated = [];
  for (const name of readdirSync(docs).filter((name) => name.endsWith('.md'))) {
    const path = join(docs, name);
    const current = readFileSync(path, 'utf8');
    const text = withParts(withSamples(current));
    if (text !== current) outdated.push({ path, text });
  }
  return outdated;
}

/**
 * Puts the sample files into the code blocks that follow their names: <!-- sample: samples/NAME -->
 *
 * @param {string} text of a document
 */
function withSamples(text) {
  return text.replaceAll(
    /^(<!-- sample: (samples\/\S+) -->\n```\w+\n)(?:(?!```)[^\n]*\n)*```$/gm,
    (_, head, file) => `${head}${readFileSync(join(docs, file), 'utf8').trimEnd()}\n\`\`\``,
  );
}

/** @param {string} text of a document */
function withParts(text) {
  let written = text;
  for (const [name, make] of Object.entries(PARTS)) {
    const [begin, end] = [`<!-- begin: ${name} -->\n`, `<!-- end: ${name} -->`];
    const [from, to] = [written.indexOf(begin), written.indexOf(end)];
    if (from < 0) continue;
    if (to < from) throw new Error(`docs: ${begin.trim()} has no end`);
    written = `${written.slice(0, from)}${begin}\n${make()}\n${written.slice(to)}`;
  }
  return written;
}

/** Every error code with its cause, what visitors see, and the remedy. */
function errorCodes() {
  return parseTypeScript(ERROR_CODES)
    .statements.filter(ts.isInterfaceDeclaration)
    .map((/** @type {any} */ group) => {
      const codes = group.members.map((/** @type {any} */ member) => {
        const code = member.name.text;
        const { visitor, remedy } = tagsOf(member);
        const cause = commentOf(member.jsDoc?.at(-1));
        if (!cause || !visitor || !remedy) {
          throw new Error(`docs: ${ERROR_CODES}: ${code} needs a cause, @visitor and @remedy`);
        }
        return `#### \`${code}\`\n\n${cause} Visitors see ${visitor}\n\n**Remedy:** ${remedy}\n`;
      });
      return `### ${commentOf(group.jsDoc?.at(-1))}\n\n${codes.join('\n')}`;
    })
    .join('\n');
}

/** The names and English texts that a page may replace. */
function texts() {
  const declared = parseTypeScript(ENGLISH_TEXTS)
    .statements.filter(ts.isVariableStatement)
    .flatMap((/** @type {any} */ statement) => [...statement.declarationList.declarations])
    .find((/** @type {any} */ { name }) => name.text === 'ENGLISH');
  const { properties } = declared.initializer.expression;
  return properties.map((/** @type {any} */ { name, initializer }) => [
    code(name.text),
    initializer.text,
  ]);
}

function attributes() {
  return named(element.attributes ?? []);
}

/** The properties without an attribute; `light` has both. */
function properties() {
  const fields = element.members.filter(
    ({ kind, static: ofClass, reflects }) => kind === 'field' && !ofClass && !reflects,
  );
  return fields.map(({ name, type, description = '', readonly }) => [
    code(name),
    code(type?.text ?? ''),
    readonly ? `${description} Read-only.` : description,
  ]);
}

function statics() {
  const fields = element.members.filter((member) => member.kind === 'field' && member.static);
  return named(fields);
}

/** @param {boolean} ofClass */
function methods(ofClass) {
  return element.members
    .filter((member) => member.kind === 'method' && Boolean(member.static) === ofClass)
    .map(({ name, parameters = [], description = '' }) => {
      // Defaults are in the descriptions.
      const names = parameters.map((parameter) => parameter.name.replaceAll(/ = [^,}]+/g, ''));
      return [code(`${name}(${names.join(', ')})`), description];
    });
}

/** @param {readonly { name: string, description?: string }[]} entries */
function named(entries) {
  return entries.map(({ name, description = '' }) => [name ? code(name) : 'none', description]);
}

/** @param {string} text */
function code(text) {
  return `\`${text}\``;
}

/** @param {string[]} head @param {string[][]} rows */
function table(head, rows) {
  const line = (/** @type {string[]} */ cells) =>
    `| ${cells.map((cell) => cell.replaceAll(/\s+/g, ' ').replaceAll('|', '\\|')).join(' | ')} |\n`;
  return [line(head), `|${'---|'.repeat(head.length)}\n`, ...rows.map(line)].join('');
}

/** The tags of a comment by their names. @param {any} node @returns {Record<string, string>} */
function tagsOf(node) {
  return Object.fromEntries(
    ts.getJSDocTags(node).map((/** @type {any} */ tag) => [tag.tagName.text, commentOf(tag)]),
  );
}

/** The text of a comment or a tag in one line. @param {any} node */
function commentOf(node) {
  return (ts.getTextOfJSDocComment(node?.comment) ?? '').replaceAll(/\s+/g, ' ');
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? '').href) {
  const outdated = await outdatedDocuments();
  const check = process.argv.includes('--check');
  for (const { path, text } of outdated) {
    if (check) console.error(`docs: ${path} is out of date. Run: npm run docs`);
    else writeFileSync(path, text);
  }
  if (check && outdated.length > 0) process.exitCode = 1;
}
