/**
 * The custom elements manifest (https://github.com/webcomponents/custom-elements-manifest), made from the
 * element's source, and from it the element's attributes in JSX.
 */

import { join } from 'node:path';
// @ts-expect-error: it comes without types
import { cli } from '@custom-elements-manifest/analyzer/cli.js';
import { CLASS } from './manifest-plugin.js';

/** @typedef {import('./manifest-plugin.js').Declaration} Declaration */
/** @typedef {import('./manifest-plugin.js').Manifest} Manifest */

const repository = join(import.meta.dirname, '..', '..');

/** @returns {Promise<Manifest>} */
export function makeManifest() {
  const argv = ['analyze', '--quiet', '--config', 'www/tools/manifest-config.js'];
  return cli({ argv, cwd: repository, noWrite: true });
}

/** The declaration of the element. @param {Manifest} manifest */
export function elementOf(manifest) {
  const declarations = manifest.modules.flatMap((module) => module.declarations);
  const element = declarations.find(({ customElement }) => customElement);
  if (!element) throw new Error('manifest: it has no element');
  return element;
}

/** The types of the element's attributes in JSX. @param {Declaration} element */
export function jsxAttributes({ attributes = [], events, members }) {
  /** @param {string} description @param {string} name @param {string} type */
  const line = (description, name, type) =>
    `  /** ${description.replaceAll(/\s+/g, ' ')} */\n  ${name}?: ${type} | undefined;\n`;
  const settable = members.filter(
    ({ kind, readonly, attribute, static: ofClass }) =>
      kind === 'field' && !readonly && !attribute && !ofClass,
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
