/** What becomes of tests whose browser is not there. */

import { test } from 'node:test';

/**
 * Says so where people see it. Where `CI` is set, which has what Debian has, it is a failure.
 *
 * @param {string} name
 * @param {string} variable that would name its program
 * @param {string} packages of Debian that have it
 */
export function missingBrowser(name, variable, packages) {
  const text =
    `NOT TESTED in ${name}: it is not installed. On Debian: apt-get install ${packages}. ` +
    `${variable} can name its program where it is not on PATH.`;
  console.error(`\n*** ${text}\n`);
  test(`in ${name}`, { skip: process.env['CI'] ? false : text }, () => {
    throw new Error(text);
  });
}
