/**
 * The custom elements manifest (https://github.com/webcomponents/custom-elements-manifest), made from the
 * element's source, and from it the element's attributes in JSX.
 */

import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
// @ts-expect-error: it comes without types
import { create } from '@custom-elements-manifest/analyzer/src/create.js';
import { parseTypeScript, ts } from './typescript-api.js';

const repository = join(import.meta.dirname, '..', '..');

/** The module that exports the class, and the one that defines the element. */
const CLASS_MODULE = 'dist/element.js';
const DEFINING_MODULE = 'dist/index.js';
const CLASS = 'RelightablePhotoElement';
const SOURCES = ['www/src/element/element.ts', 'www/src/element/events.ts'];
/** The interface with the properties that reflect attributes. */
const REFLECTED = { file: 'www/src/element/reflect.ts', name: 'ReflectedProperties' };
/** Observed attributes that every element has. */
const GLOBAL = ['lang'];

/**
 * @typedef {{ name: string, description?: string, type?: { text: string } }} Entry
 * @typedef {Entry & { kind: string, privacy?: string, static?: boolean, readonly?: boolean, attribute?: string, reflects?: boolean }} Member
 * @typedef {Entry & { fieldName: string }} Attribute
 * @typedef {{ kind: string, name: string, members: Member[], events: Entry[], attributes: Attribute[], cssParts: Entry[], cssProperties: Entry[], slots: Entry[], superclass?: unknown }} Declaration
 */

/** @returns {Promise<{ manifest: object, attributes: string }>} needs dist/element.js */
export async function makeManifest() {
  const sources = SOURCES.map(parseTypeScript);
  const context = { dev: false, thirdPartyCEMs: [] };
  /** @type {{ modules: { declarations: Declaration[] }[] }} */
  const analysed = create({ modules: sources, plugins: [], context });
  const declarations = analysed.modules.flatMap(({ declarations }) => declarations);
  const element = declarations.find(({ name }) => name === CLASS);
  if (!element) throw new Error(`manifest: there is no class ${CLASS} in the sources`);
  /** @type {{ [CLASS]: { observedAttributes: readonly string[] } }} */
  const { [CLASS]: built } = await import(pathToFileURL(join(repository, CLASS_MODULE)).href);
  const own = reflected();
  element.members.unshift(...own);
  tidy(
    element,
    built.observedAttributes.filter((name) => !GLOBAL.includes(name)),
    new Set(own.map(({ name }) => name)),
  );
  const events = declarations.filter(({ name }) => /Event$/.test(name));
  for (const { members } of events) {
    for (const member of members ?? []) if (member.privacy !== 'private') delete member.privacy;
  }
  const manifest = {
    schemaVersion: '2.1.0',
    readme: 'README.md',
    modules: [
      {
        kind: 'javascript-module',
        path: CLASS_MODULE,
        declarations: [{ ...element, customElement: true }, ...events],
        exports: [element, ...events].map(({ name }) => ({
          kind: 'js',
          name,
          declaration: { name, module: CLASS_MODULE },
        })),
      },
      {
        kind: 'javascript-module',
        path: DEFINING_MODULE,
        declarations: [],
        exports: [
          {
            kind: 'custom-element-definition',
            name: 'relightable-photo',
            declaration: { name: CLASS, module: CLASS_MODULE },
          },
        ],
      },
    ],
  };
  return { manifest, attributes: jsxAttributes(element) };
}

/** The reflected properties. @returns {Member[]} */
function reflected() {
  const source = parseTypeScript(REFLECTED.file);
  const found = source.statements.find(
    (/** @type {any} */ node) =>
      ts.isInterfaceDeclaration(node) && node.name.text === REFLECTED.name,
  );
  if (!found) throw new Error(`manifest: there is no ${REFLECTED.name} in ${REFLECTED.file}`);
  return found.members.map((/** @type {any} */ member) => ({
    kind: 'field',
    name: member.name.text,
    type: { text: member.type.getText(source) },
    description: ts.getTextOfJSDocComment(member.jsDoc?.[0]?.comment) ?? '',
  }));
}

/**
 * Removes the private members of a class, and connects attributes with their properties.
 *
 * @param {Declaration} element
 * @param {readonly string[]} observed
 * @param {ReadonlySet<string>} reflected the properties that reflect attributes
 */
function tidy(element, observed, reflected) {
  const callbacks = /Callback$/;
  element.members = element.members.filter(
    ({ name, privacy, static: ofClass }) =>
      privacy !== 'private' && !name.startsWith('#') && !ofClass && !callbacks.test(name),
  );
  // Events without a description are the analyser's guesses from calls of dispatchEvent.
  element.events = element.events.filter(({ description }) => description);
  element.superclass = { name: 'HTMLElement', package: 'global:' };
  element.attributes = observed.map((name) => {
    const asField = name.replaceAll('-', '');
    const field = element.members.find((member) => member.name.toLowerCase() === asField);
    if (!field) throw new Error(`manifest: the attribute ${name} has no property`);
    field.attribute = name;
    field.reflects = reflected.has(field.name);
    const { type = { text: 'string' }, description = '' } = field;
    return { name, fieldName: field.name, type, description };
  });
  for (const { name, description } of [...element.members, ...element.attributes]) {
    if (!description) throw new Error(`manifest: ${name} has no description`);
  }
}

/** @param {Declaration} element */
function jsxAttributes({ attributes, events, members }) {
  /** @param {string} description @param {string} name @param {string} type */
  const line = (description, name, type) =>
    `  /** ${description.replaceAll(/\s+/g, ' ')} */\n  ${name}?: ${type} | undefined;\n`;
  const settable = members.filter(
    ({ kind, readonly, attribute }) => kind === 'field' && !readonly && !attribute,
  );
  const own = new Set(
    events.map(({ type }) => type?.text).filter((type) => /[a-z]Event$/.test(type ?? '')),
  );
  for (const builtin of ['Event', 'ProgressEvent']) own.delete(builtin);
  return [
    '/** Made from custom-elements.json. */\n\n',
    `import type { ${[...own].sort().join(', ')} } from './element/events.js';\n`,
    `import type { ${CLASS} } from './element/element.js';\n\n`,
    '/** Attributes by their names in HTML, properties without an attribute, and event handlers. */\n',
    'export interface RelightablePhotoAttributes {\n',
    ...attributes.map(({ name, fieldName, type, description = '' }) => {
      const { reflects } = members.find((member) => member.name === fieldName) ?? {};
      const jsx = reflects ? jsxType(type?.text ?? 'string') : `${CLASS}['${fieldName}']`;
      return line(description, /-/.test(name) ? `'${name}'` : name, jsx);
    }),
    ...settable.map(({ name, description = '' }) => line(description, name, `${CLASS}['${name}']`)),
    ...events.map(({ name, type, description = '' }) =>
      line(description, `on${name}`, `((event: ${type?.text ?? 'Event'}) => void)`),
    ),
    '}\n',
  ].join('');
}

/** The type of an attribute in JSX whose property has this type. @param {string} type */
function jsxType(type) {
  if (type === 'boolean') return 'boolean';
  return type === 'number' ? 'number | string' : 'string';
}
