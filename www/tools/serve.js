/** Serves the demo site: node www/tools/serve.js [photos folder] */

import { createServer } from 'node:http';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { site } from './site.js';

const HOST = '127.0.0.1';

/**
 * Listens on a port of the loopback interface, or on the next free one.
 *
 * @param {import('node:http').RequestListener} handler
 * @param {number} port 0 for any
 * @returns {Promise<{ url: string, close: () => Promise<void> }>}
 */
export async function listen(handler, port) {
  const server = createServer(handler);
  for (let tried = port; ; tried += 1) {
    try {
      await new Promise((done, failed) => {
        server.once('error', failed);
        server.listen(tried, HOST, () => {
          server.off('error', failed);
          done(undefined);
        });
      });
      break;
    } catch (error) {
      const taken = /** @type {NodeJS.ErrnoException} */ (error).code === 'EADDRINUSE';
      if (!taken || tried - port >= 100) throw error;
    }
  }
  const address = /** @type {import('node:net').AddressInfo} */ (server.address());
  return {
    url: `http://${HOST}:${address.port}/`,
    close: () =>
      new Promise((done) => {
        server.close(() => done());
        server.closeAllConnections();
      }),
  };
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? '').href) {
  const photos = resolve(process.argv[2] ?? 'target/demo/photos');
  const port = Number(process.env['PORT'] ?? 8080);
  if (!Number.isInteger(port) || port < 0 || port > 65535) {
    console.error(`serve: PORT is ${process.env['PORT']}, but must be a number from 0 to 65535`);
    process.exit(2);
  }
  const { url } = await listen(site({ photos }), port);
  console.log(`Open ${url} in a browser. Stop with Ctrl-C.`);
}
