/**
 * Measures recovery in a page, by `relightable-photo/recover`, against `ltm-export recover` on one thread: the same
 * capture, from its files to the bytes of an `.ltm` file. Both do the same work, as their files are equal.
 */

import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { FILES, FIXTURE } from '../../tests/browser/recovery-page.js';
import { openPage } from './pages.js';

const EXPORTER = join(import.meta.dirname, '../../target/release/ltm-export');
const METHODS = ['learned', 'nnls'];
/** Rounds over both programs; the fastest counts. */
const TURNS = 3;

const files = FILES.map((name) => [name, readFileSync(join(FIXTURE, name)).toString('base64')]);

/**
 * @param {string} method
 * @param {number} workers
 * @returns {Promise<{ recovered: number, written: number }>} seconds to the recovered photograph, and to its file
 */
async function inPage(method, workers) {
  const page = await openPage({});
  const seconds = await page.evaluate(
    async ({ files, method, workers }) => {
      const script = '/relightable-photo/recover.js';
      const { recover } = await import(script);
      const folder = new Map(
        files.map(([name = '', base64 = '']) => [
          name,
          new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))]),
        ]),
      );
      const began = performance.now();
      const photograph = await recover({ folder }, { method }, { workers });
      const recovered = performance.now();
      await photograph.toBlob();
      const written = performance.now();
      photograph.free();
      return { recovered: (recovered - began) / 1000, written: (written - began) / 1000 };
    },
    { files, method, workers },
  );
  await page.context().close();
  return seconds;
}

/** @param {string} method @param {string} file @returns {number} seconds of computing */
function natively(method, file) {
  const options = ['--method', method, '--json', '-o', file];
  const env = { ...process.env, RAYON_NUM_THREADS: '1' };
  const output = execFileSync(EXPORTER, ['recover', FIXTURE, ...options], {
    env,
    encoding: 'utf8',
    stdio: ['ignore', 'pipe', 'ignore'],
  });
  return JSON.parse(output).seconds;
}

/** Prints a table and returns the figures. @param {string} folder for files */
export async function recovery(folder) {
  /** @type {Record<string, number>} */
  const figures = {};
  console.log(
    '\nRecovery of 64² camera pixels and 32² light elements from 54 of 60 patterns. Seconds: natively on one\n' +
      'thread, in a page with one and with two workers, and "recovered" with two workers, without the file\n',
  );
  const ratios = [];
  for (const method of METHODS) {
    const best = { native: Infinity, one: Infinity, two: Infinity, recovered: Infinity };
    for (let turn = 0; turn < TURNS; turn += 1) {
      best.native = Math.min(best.native, natively(method, join(folder, 'recovered.ltm')));
      best.one = Math.min(best.one, (await inPage(method, 1)).written);
      const two = await inPage(method, 2);
      best.two = Math.min(best.two, two.written);
      best.recovered = Math.min(best.recovered, two.recovered);
    }
    const ratio = best.native / best.one;
    ratios.push(ratio);
    figures[`recover_${method}_native_seconds`] = best.native;
    figures[`recover_${method}_page_seconds`] = best.one;
    figures[`recover_${method}_page_2_workers_seconds`] = best.two;
    figures[`recover_${method}_page_2_workers_recovered_seconds`] = best.recovered;
    figures[`recover_${method}_vs_native`] = ratio;
    const cells = Object.values(best).map((seconds) => seconds.toFixed(2).padStart(9));
    console.log(`${method.padEnd(10)}${cells.join('')}   ${ratio.toFixed(2)} of native speed`);
  }
  figures['recover_vs_native'] = Math.min(...ratios);
  return figures;
}
