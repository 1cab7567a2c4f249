/**
 * Writes dist/THIRD-PARTY.md, the crates in the WebAssembly modules and the packages in the scripts, with their licences:
 * node www/tools/third-party.js
 * It needs the crates' sources, which cargo has downloaded once the modules are built.
 */

import { execFileSync } from 'node:child_process';
import { existsSync, readdirSync, readFileSync, statSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';

const repository = join(import.meta.dirname, '..', '..');
const TARGET = 'wasm32-unknown-unknown';

/** @param {string[]} args */
function cargo(...args) {
  const options = /** @type {const} */ ({ cwd: repository, encoding: 'utf8', maxBuffer: 1 << 28 });
  return execFileSync('cargo', [...args, '--locked'], options);
}

/** @typedef {{ name: string, version: string, license: string | null, license_file: string | null, manifest_path: string, source: string | null }} Crate */

/** Beside the default ones, those of the package's modules. */
const FEATURES = 'recovery,capture_reader';

/** The crates whose code is in the modules, without build tools and procedural macros. */
function compiledIn() {
  const edges = ['-e', 'normal,no-proc-macro', '--prefix', 'none'];
  const tree = cargo('tree', '--features', FEATURES, '--target', TARGET, ...edges);
  const names = new Set(tree.split('\n').map((line) => line.split(' ').slice(0, 2).join(' ')));
  /** @type {{ packages: Crate[] }} */
  const { packages } = JSON.parse(
    cargo('metadata', '--features', FEATURES, '--format-version', '1', '--filter-platform', TARGET),
  );
  return packages
    .filter(({ name, version, source }) => source !== null && names.has(`${name} v${version}`))
    .sort((a, b) => a.name.localeCompare(b.name) || a.version.localeCompare(b.version));
}

/**
 * The texts of a crate's licence; only MIT's if the crate may be used under MIT.
 *
 * @param {Crate} crate
 */
function licencesOf({ name, license, manifest_path }) {
  const folder = dirname(manifest_path);
  const files = readdirSync(folder).filter((file) => /^(licen[cs]e|copying|unlicense)/i.test(file));
  const mit = files.filter((file) => /mit/i.test(file));
  const chosen = (/\bMIT\b/.test(license ?? '') && mit.length > 0 ? mit : files).map((file) =>
    join(folder, file),
  );
  // C code inside a crate has its own licence.
  for (const inner of readdirSync(folder)) {
    const text = join(folder, inner, 'LICENSE');
    if (existsSync(text) && statSync(text).isFile()) chosen.push(text);
  }
  const texts = chosen
    .filter((path) => statSync(path).isFile())
    .map((path) => readFileSync(path, 'utf8').trim());
  return { name, texts };
}

/** The npm packages whose code is in the scripts. */
const PACKAGES = ['@zip.js/zip.js'];

/** @param {string} name @returns {[title: string, text: string]} */
function licenceOfPackage(name) {
  const folder = join(repository, 'node_modules', name);
  /** @type {{ version: string, license: string }} */
  const { version, license } = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
  const text = readFileSync(join(folder, 'LICENSE'), 'utf8').trim();
  return [`${name} ${version} (${license})`, text];
}

/** @param {Crate} crate */
const titleOf = ({ name, version, license }) => `${name} ${version} (${license ?? 'see below'})`;

const crates = compiledIn();
/** The crates with each licence text. @type {Map<string, string[]>} */
const byText = new Map();
/** @type {string[]} */
const without = [];
for (const crate of crates) {
  const { texts } = licencesOf(crate);
  if (texts.length === 0) without.push(titleOf(crate));
  for (const text of texts) byText.set(text, [...(byText.get(text) ?? []), titleOf(crate)]);
}
for (const [title, text] of PACKAGES.map(licenceOfPackage)) {
  byText.set(text, [...(byText.get(text) ?? []), title]);
}
const sections = [...byText].map(
  ([text, titles]) =>
    `${titles.map((title) => `- ${title}`).join('\n')}\n\n\`\`\`text\n${text}\n\`\`\`\n`,
);
const rest =
  without.length > 0
    ? ['Crates without a licence text:\n\n', ...without.map((title) => `- ${title}\n`)]
    : [];
writeFileSync(
  join(repository, 'dist/THIRD-PARTY.md'),
  [
    '# Third-party code in the WebAssembly modules and scripts\n\n',
    "Besides Rust's standard library (MIT OR Apache-2.0, https://www.rust-lang.org/policies/licenses):\n\n",
    sections.join('\n'),
    ...(rest.length > 0 ? ['\n', ...rest] : []),
  ].join(''),
);
console.log(
  `third-party: ${crates.length} crates, ${byText.size} texts, ${without.length} without`,
);
