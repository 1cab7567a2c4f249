/**
 * A plugin of the analyser: adds the properties that reflect attributes, leaves out what is private, and describes the
 * package's modules instead of the sources.
 */

/** The module that exports the class, and the one that defines the element. */
const CLASS_MODULE = 'dist/element.js';
const DEFINING_MODULE = 'dist/index.js';
export const CLASS = 'RelightablePhotoElement';
/** In reflect.ts: the interface with the reflected properties, and the object with their attributes. */
const INTERFACE = 'ReflectedProperties';
const REFLECTIONS = 'REFLECTED';

/**
 * @typedef {{ name: string, description?: string, type?: { text: string } }} Entry
 * @typedef {Entry & { optional?: boolean, default?: string }} Parameter
 * @typedef {Entry & { kind: string, privacy?: string, static?: boolean, readonly?: boolean, attribute?: string, reflects?: boolean, parameters?: Parameter[], return?: { type: { text: string } } }} Member
 * @typedef {Entry & { fieldName: string }} Attribute
 * @typedef {{ kind: string, name: string, members: Member[], events: Entry[], attributes?: Attribute[], cssParts: Entry[], cssProperties: Entry[], cssStates: Entry[], slots: Entry[], superclass?: unknown, customElement?: boolean }} Declaration
 * @typedef {{ schemaVersion: string, readme: string, modules: { kind: string, path: string, declarations: Declaration[], exports: object[] }[] }} Manifest
 */

export function elementPlugin() {
  /** @type {Member[]} */
  const reflected = [];
  /** Attributes by property. @type {Map<string, string>} */
  const attributes = new Map();
  return {
    name: 'element',
    /** @param {{ ts: any, node: any }} phase */
    analyzePhase({ ts, node }) {
      if (ts.isInterfaceDeclaration(node) && node.name.text === INTERFACE) {
        for (const member of node.members) {
          reflected.push({
            kind: 'field',
            name: member.name.text,
            type: { text: member.type.getText() },
            description: ts.getTextOfJSDocComment(member.jsDoc?.at(-1)?.comment) ?? '',
          });
        }
      }
      if (ts.isVariableDeclaration(node) && node.name.text === REFLECTIONS) {
        for (const property of node.initializer.properties) {
          const attribute = firstString(ts, property.initializer);
          if (attribute !== undefined) attributes.set(property.name.text, attribute);
        }
      }
    },
    /** @param {{ customElementsManifest: Manifest }} phase */
    packageLinkPhase({ customElementsManifest }) {
      const declarations = customElementsManifest.modules.flatMap((module) => module.declarations);
      const element = declarations.find(({ name }) => name === CLASS);
      if (!element) throw new Error(`manifest: there is no class ${CLASS} in the sources`);
      element.members.unshift(...reflected);
      tidy(element, attributes);
      const events = declarations.filter(({ name }) => /Event$/.test(name));
      for (const { members } of events) {
        for (const member of members ?? []) if (member.privacy !== 'private') delete member.privacy;
      }
      Object.assign(customElementsManifest, {
        schemaVersion: '2.1.0',
        readme: 'README.md',
        modules: modulesOf({ ...element, customElement: true }, events),
      });
    },
  };
}

/** The first string in an expression, which names the attribute. @param {any} ts @param {any} node */
function firstString(ts, node) {
  if (ts.isStringLiteral(node)) return node.text;
  return ts.forEachChild(node, (/** @type {any} */ child) => firstString(ts, child));
}

/**
 * Removes the private members of a class, and connects attributes with their properties.
 *
 * @param {Declaration} element
 * @param {ReadonlyMap<string, string>} reflections attributes by property
 */
function tidy(element, reflections) {
  element.members = element.members.filter(
    ({ name, privacy }) =>
      privacy !== 'private' &&
      !name.startsWith('#') &&
      !/Callback$/.test(name) &&
      name !== 'observedAttributes',
  );
  // The analyser lists static getters and setters separately, the setter without a description.
  element.members = element.members.filter(
    (member, i, all) => all.findIndex(({ name }) => name === member.name) === i,
  );
  // Events without a description are the analyser's guesses from calls of dispatchEvent.
  element.events = element.events.filter(({ description }) => description);
  element.superclass = { name: 'HTMLElement', package: 'global:' };
  const described = element.attributes ?? [];
  const fields = element.members.filter(
    ({ name }) => reflections.has(name) || described.some((attribute) => attribute.name === name),
  );
  element.attributes = fields.map((field) => {
    const name = reflections.get(field.name) ?? field.name;
    const own = described.find((attribute) => attribute.name === name);
    field.attribute = name;
    field.reflects = reflections.has(field.name);
    const { type = { text: 'string' }, description = '' } = field;
    return { name, fieldName: field.name, type, description, ...own };
  });
  for (const { name, description } of [...element.members, ...element.attributes]) {
    if (!description) throw new Error(`manifest: ${name} has no description`);
  }
}

/** @param {Declaration} element @param {Declaration[]} events */
function modulesOf(element, events) {
  const exported = [element, ...events].map(({ name }) => ({
    kind: 'js',
    name,
    declaration: { name, module: CLASS_MODULE },
  }));
  const definition = {
    kind: 'custom-element-definition',
    name: 'relightable-photo',
    declaration: { name: CLASS, module: CLASS_MODULE },
  };
  const kind = 'javascript-module';
  return [
    { kind, path: CLASS_MODULE, declarations: [element, ...events], exports: exported },
    { kind, path: DEFINING_MODULE, declarations: [], exports: [definition] },
  ];
}
