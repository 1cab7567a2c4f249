/** A line of limited speed in front of a server: what all connections bring together, and how late. */

import { once } from 'node:events';
import { connect, createServer } from 'node:net';
import { setTimeout as sleep } from 'node:timers/promises';

/**
 * Every byte to the client passes here. A connection takes a way there and back before it carries anything.
 *
 * @param {number} port of the server
 * @param {{ bytesPerSecond: number, latencyMs: number }} line latency of a way there and back
 * @returns {Promise<{ origin: string, close: () => void }>}
 */
export async function slowLine(port, { bytesPerSecond, latencyMs }) {
  /** When the line is free. */
  let free = 0;
  const server = createServer((client) => {
    const upstream = connect(port, '127.0.0.1');
    for (const socket of [client, upstream]) socket.on('error', () => {}).setNoDelay(true);
    void carry(client, upstream, async () => {
      await sleep(latencyMs / 2);
    });
    void carry(upstream, client, async (bytes) => {
      free = Math.max(free, performance.now()) + (1000 * bytes) / bytesPerSecond;
      await sleep(free - performance.now() + latencyMs / 2);
    });
  });
  /**
   * In order. What is on its way does not keep the next from setting out.
   *
   * @param {import('node:net').Socket} from
   * @param {import('node:net').Socket} to
   * @param {(bytes: number) => Promise<void>} way
   */
  async function carry(from, to, way) {
    let last = sleep(latencyMs);
    from.on('data', (bytes) => {
      // No more than a connection's window is under way.
      from.pause();
      const here = Promise.all([last, way(bytes.length)]);
      last = here.then(() => void (to.destroyed || to.write(bytes)));
      setTimeout(() => from.resume(), (1000 * bytes.length) / bytesPerSecond);
    });
    await once(from, 'close').catch(() => {});
    await last;
    to.destroy();
  }
  server.listen(0, '127.0.0.1');
  await once(server, 'listening');
  const address = /** @type {import('node:net').AddressInfo} */ (server.address());
  return { origin: `http://localhost:${address.port}`, close: () => server.close() };
}
