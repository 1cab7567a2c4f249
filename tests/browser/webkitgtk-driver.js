/** WebKitGTK's MiniBrowser on a virtual display, controlled by WebDriver. */

import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { createServer } from 'node:net';
import { setTimeout as sleep } from 'node:timers/promises';
import { openVirtualDisplay } from './virtual-display.js';

/** @typedef {import('./any-browser.js').AnyPage} AnyPage */
/** @typedef {(method: 'GET' | 'POST' | 'DELETE', path: string, body?: object) => Promise<any>} Command */

const START_MS = 20_000;
/** Time-out of `waitForFunction`. */
const WAIT_MS = 30_000;
/** Time-out of scripts, one of which recovers a capture: that of a test. */
const SCRIPT_MS = 120_000;
const POLL_INTERVAL_MS = 50;
/** The protocol's name for a reference to an element. */
const ELEMENT = 'element-6066-11e4-a52e-4f735466cecf';
/** The protocol's code points for keys without a letter. */
const KEYS = /** @type {Record<string, string>} */ ({
  Tab: '\uE004',
  Enter: '\uE007',
  Escape: '\uE00C',
  End: '\uE010',
  Home: '\uE011',
  ArrowLeft: '\uE012',
  ArrowUp: '\uE013',
  ArrowRight: '\uE014',
  ArrowDown: '\uE015',
});

/**
 * Starts the driver and the browser.
 *
 * @param {string} driver the program WebKitWebDriver
 */
export async function launchWebKitGtk(driver) {
  const display = await openVirtualDisplay();
  const port = await freePort();
  const server = spawn(driver, [`--port=${port}`], {
    stdio: 'ignore',
    // Otherwise it waits for a portal and an accessibility bus.
    env: { ...process.env, DISPLAY: display.display, NO_AT_BRIDGE: '1', GTK_USE_PORTAL: '0' },
  });
  const exit = once(server, 'exit');
  const close = async () => {
    server.kill();
    await exit;
    await display.close();
  };
  try {
    const request = requestsTo(`http://127.0.0.1:${port}`);
    const isReady = async () => (await request('GET', '/status').catch(() => null))?.ready;
    await waitUntil(isReady, START_MS, 'WebKitWebDriver does not answer');
    const { sessionId } = await request('POST', '/session', {
      capabilities: { alwaysMatch: { timeouts: { script: SCRIPT_MS } } },
    });
    /** @type {Command} */
    const command = (method, path, body) => request(method, `/session/${sessionId}${path}`, body);
    await command('POST', '/window/rect', { x: 0, y: 0, width: 1100, height: 900 });
    const page = pageOf(command);
    return {
      close: async () => {
        await request('DELETE', `/session/${sessionId}`);
        await close();
      },
      open: async (/** @type {string} */ url) => {
        await command('POST', '/url', { url });
        return page;
      },
      /** Leaves the page, and returns what it complained of. @returns {Promise<string[]>} */
      leavePage: async () => {
        const complaints = await page.evaluate('globalThis.complaints ?? []');
        await command('DELETE', '/actions');
        await command('POST', '/url', { url: 'about:blank' });
        return complaints;
      },
    };
  } catch (error) {
    await close();
    throw error;
  }
}

/** @param {string} address @returns {Command} */
function requestsTo(address) {
  return async (method, path, body) => {
    const response = await fetch(address + path, {
      method,
      ...(method === 'POST' && { body: JSON.stringify(body ?? {}) }),
    });
    const { value } = /** @type {any} */ (await response.json());
    if (!response.ok) throw new Error(`${path}: ${value.error}: ${value.message}`);
    return value;
  };
}

/** @param {Command} command @returns {AnyPage} */
function pageOf(command) {
  const evaluate = async (/** @type {any} */ work, /** @type {unknown} */ argument) => {
    const expression = typeof work === 'string' ? work : `(${work})(argument)`;
    // A rejected promise is returned as data: it is no error of the protocol.
    const { value, failure } = await command('POST', '/execute/async', {
      script: `const [argument, done] = arguments;
        (async () => (${expression}))().then(
          (value) => done({ value }),
          (error) => done({ failure: String(error?.stack ? error + '\\n' + error.stack : error) }));`,
      args: [argument ?? null],
    });
    if (failure) throw new Error(failure);
    return value;
  };
  const pointer = (/** @type {object} */ action) =>
    command('POST', '/actions', {
      actions: [{ type: 'pointer', id: 'mouse', actions: [action] }],
    });
  return /** @type {AnyPage} */ (
    /** @type {unknown} */ ({
      evaluate,
      waitForFunction: async (/** @type {any} */ work, /** @type {unknown} */ argument) => {
        await waitUntil(() => evaluate(work, argument), WAIT_MS, `time-out: ${work}`);
      },
      mouse: {
        move: (/** @type {number} */ x, /** @type {number} */ y) =>
          pointer({ type: 'pointerMove', duration: 0, x: Math.round(x), y: Math.round(y) }),
        down: () => pointer({ type: 'pointerDown', button: 0 }),
        up: () => pointer({ type: 'pointerUp', button: 0 }),
      },
      keyboard: {
        press: (/** @type {string} */ key) => {
          const value = KEYS[key] ?? key;
          const actions = [
            { type: 'keyDown', value },
            { type: 'keyUp', value },
          ];
          return command('POST', '/actions', {
            actions: [{ type: 'key', id: 'keyboard', actions }],
          });
        },
      },
      locator: (/** @type {string} */ value) => ({
        screenshot: async () => {
          const found = await command('POST', '/element', { using: 'css selector', value });
          const png = await command('GET', `/element/${found[ELEMENT]}/screenshot`);
          return Buffer.from(png, 'base64');
        },
      }),
    })
  );
}

/**
 * @param {() => Promise<unknown>} condition
 * @param {number} timeout in milliseconds
 * @param {string} message of the error after the time-out
 */
async function waitUntil(condition, timeout, message) {
  const start = Date.now();
  while (!(await condition())) {
    if (Date.now() - start > timeout) throw new Error(message);
    await sleep(POLL_INTERVAL_MS);
  }
}

async function freePort() {
  const server = createServer().listen(0, '127.0.0.1');
  await once(server, 'listening');
  const { port } = /** @type {import('node:net').AddressInfo} */ (server.address());
  server.close();
  await once(server, 'close');
  return port;
}
