/** An X server without a screen. Firefox and WebKitGTK have no WebGL without a display. */

import { spawn } from 'node:child_process';
import { once } from 'node:events';

/**
 * Starts Xvfb (Debian: `xvfb`) on a free display.
 *
 * @returns {Promise<{ display: string, close: () => Promise<void> }>} `display` is the value for `DISPLAY`
 */
export async function openVirtualDisplay() {
  const server = spawn('Xvfb', ['-displayfd', '3', '-screen', '0', '1280x1024x24'], {
    stdio: ['ignore', 'ignore', 'ignore', 'pipe'],
  });
  const exit = once(server, 'exit');
  const displayNumber = /** @type {import('node:stream').Readable} */ (server.stdio[3]);
  // Xvfb writes the number of its display once it accepts connections.
  const [number] = await Promise.race([
    once(displayNumber, 'data'),
    exit.then(() => Promise.reject(new Error('Xvfb ended before it was ready'))),
  ]);
  return {
    display: `:${String(number).trim()}`,
    close: async () => {
      server.kill();
      await exit;
    },
  };
}
