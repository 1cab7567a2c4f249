/** A TCP proxy with limited bandwidth, shared by all connections, and latency. */

import { once } from 'node:events';
import { connect, createServer } from 'node:net';
import { setTimeout as sleep } from 'node:timers/promises';

/**
 * Forwards to a server on this machine. A new connection costs one round trip.
 *
 * @param {number} port of the server
 * @param {{ bytesPerSecond: number, latencyMs: number }} line latency of a round trip
 * @returns {Promise<{ origin: string, close: () => void }>}
 */
export async function slowLine(port, { bytesPerSecond, latencyMs }) {
  /** Time at which the line is free again. */
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
   * Forwards bytes in order; latencies overlap.
   *
   * @param {import('node:net').Socket} from
   * @param {import('node:net').Socket} to
   * @param {(bytes: number) => Promise<void>} way
   */
  async function carry(from, to, way) {
    let last = sleep(latencyMs);
    from.on('data', (bytes) => {
      // At most a connection's window of bytes is in flight.
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
