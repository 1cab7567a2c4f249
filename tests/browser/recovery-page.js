/** What tests of recovery do with a page. */

import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { Uint8ArrayReader, Uint8ArrayWriter, ZipWriter } from '@zip.js/zip.js';

/** @typedef {import('./any-browser.js').AnyPage} AnyPage */
/** @typedef {import('../../www/src/recover.js').RecoveryProgress} RecoveryProgress */

export const FIXTURE = join(import.meta.dirname, '../fixtures/glass-s');

/** Names of the fixture's files, without the true transport. */
export const FILES = readdirSync(FIXTURE, { recursive: true, encoding: 'utf8' })
  .map((name) => name.replaceAll('\\', '/'))
  .filter((name) => /\.(json|png)$/.test(name) && !name.startsWith('truth'));

/** The fixture in a folder of a zip. */
export async function zipFixture() {
  const writer = new ZipWriter(new Uint8ArrayWriter());
  for (const name of FILES) {
    await writer.add(`glass/${name}`, new Uint8ArrayReader(readFileSync(join(FIXTURE, name))));
  }
  return Buffer.from(await writer.close());
}

/**
 * Loads the package's recovery into a page, and the fixture as a capture folder: the page's globals are then `recovery`,
 * the exports of `relightable-photo/recover`, `folder`, and `fails`, which gives code and message of a recovery's error.
 *
 * @param {AnyPage} page
 */
export async function prepareRecovery(page) {
  await page.evaluate(async (files) => {
    const script = '/relightable-photo/recover.js';
    const recovery = await import(script);
    const blobs = files.map(async (name) => {
      const response = await fetch(`/fixtures/glass-s/${name}`);
      return /** @type {const} */ ([name, await response.blob()]);
    });
    const folder = new Map(await Promise.all(blobs));
    const fails = async (/** @type {unknown[]} */ ...args) => {
      try {
        (await recovery.recover(...args)).free();
        return { code: 'none', message: '' };
      } catch (error) {
        const { code, message } = /** @type {any} */ (error);
        return { code, message };
      }
    };
    Object.assign(globalThis, { recovery, folder, fails });
  }, FILES);
}

/**
 * Recovers the fixture with two workers: the page's global is then `recovered`. Returns the file, the progress and facts.
 *
 * @param {AnyPage} page
 */
export async function recoverFixture(page) {
  const result = await page.evaluate(async () => {
    const { recovery, folder } = /** @type {any} */ (globalThis);
    /** @type {RecoveryProgress[]} */
    const reports = [];
    const onProgress = (/** @type {RecoveryProgress} */ report) => reports.push(report);
    const recovered = await recovery.recover({ folder }, {}, { workers: 2, onProgress });
    Object.assign(globalThis, { recovered });
    const bytes = new Uint8Array(await (await recovered.toBlob()).arrayBuffer());
    let text = '';
    for (const byte of bytes) text += String.fromCharCode(byte);
    const { seconds, expectedSnr, warnings } = recovered;
    const heldOutSnr = await recovered.evaluateHeldOut();
    return { file: btoa(text), reports, seconds, expectedSnr, warnings, heldOutSnr };
  });
  return { ...result, file: Buffer.from(result.file, 'base64') };
}
