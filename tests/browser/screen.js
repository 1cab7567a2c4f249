/** A screen that nobody sees, for browsers that have no graphics without one. */

import { spawn } from 'node:child_process';
import { once } from 'node:events';

/**
 * Starts an X server in memory, where Debian's `xvfb` is installed.
 *
 * @returns {Promise<{ display: string, close: () => Promise<void> }>} `display` is for the environment of
 *   whoever is to draw on it
 */
export async function openScreen() {
  const server = spawn('Xvfb', ['-displayfd', '3', '-screen', '0', '1280x1024x24'], {
    stdio: ['ignore', 'ignore', 'ignore', 'pipe'],
  });
  const ended = once(server, 'exit');
  const told = /** @type {import('node:stream').Readable} */ (server.stdio[3]);
  // It takes the first number that is free, and tells which once it is up.
  const [number] = await Promise.race([
    once(told, 'data'),
    ended.then(() => Promise.reject(new Error('Xvfb ended before it was up'))),
  ]);
  return {
    display: `:${String(number).trim()}`,
    close: async () => {
      server.kill();
      await ended;
    },
  };
}
