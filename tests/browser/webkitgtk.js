/** WebKitGTK's MiniBrowser, on a screen that nobody sees, by the W3C's WebDriver protocol. */

import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { createServer } from 'node:net';
import { setTimeout as sleep } from 'node:timers/promises';
import { origin } from './browser.js';
import { openScreen } from './screen.js';

/** @typedef {import('./any-browser.js').AnyPage} AnyPage */
/** @typedef {(method: 'GET' | 'POST' | 'DELETE', path: string, body?: object) => Promise<any>} Command */

const START_MS = 20_000;
const WAIT_MS = 30_000;
/** What the protocol calls a reference to an element. */
const ELEMENT = 'element-6066-11e4-a52e-4f735466cecf';
/** Keys as the protocol writes them, for those that have no letter. */
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
 * @param {string} driver the program WebKitWebDriver
 * @returns {Promise<{ name: string, close: () => Promise<void> } & import('./any-browser.js').AnyBrowser>}
 */
export async function launchWebKitGtk(driver) {
  const screen = await openScreen();
  const port = await freePort();
  const server = spawn(driver, [`--port=${port}`], {
    stdio: 'ignore',
    // No portal or accessibility bus is there to be waited for.
    env: { ...process.env, DISPLAY: screen.display, NO_AT_BRIDGE: '1', GTK_USE_PORTAL: '0' },
  });
  const ended = once(server, 'exit');
  const close = async () => {
    server.kill();
    await ended;
    await screen.close();
  };
  try {
    const ask = commandsTo(`http://127.0.0.1:${port}`);
    const began = Date.now();
    while (!(await ask('GET', '/status').catch(() => null))?.ready) {
      if (Date.now() - began > START_MS) throw new Error('WebKitWebDriver does not answer');
      await sleep(50);
    }
    const { sessionId, capabilities } = await ask('POST', '/session', {
      capabilities: { alwaysMatch: { timeouts: { script: WAIT_MS } } },
    });
    /** @type {Command} */
    const command = (method, path, body) => ask(method, `/session/${sessionId}${path}`, body);
    await command('POST', '/window/rect', { x: 0, y: 0, width: 1100, height: 900 });
    return {
      name: `WebKitGTK ${capabilities.browserVersion}`,
      close: async () => {
        await ask('DELETE', `/session/${sessionId}`);
        await close();
      },
      open: async (test, path) => {
        const page = pageOf(command);
        test.after(async () => {
          const faults = await page.evaluate('globalThis.complaints ?? []');
          await command('DELETE', '/actions');
          await command('POST', '/url', { url: 'about:blank' });
          if (faults.length > 0) throw new Error(`the page complained:\n${faults.join('\n')}`);
        });
        await command('POST', '/url', { url: origin + path });
        return page;
      },
    };
  } catch (error) {
    await close();
    throw error;
  }
}

/** @param {string} address @returns {Command} */
function commandsTo(address) {
  return async (method, path, body) => {
    const answer = await fetch(address + path, {
      method,
      ...(method === 'POST' && { body: JSON.stringify(body ?? {}) }),
    });
    const { value } = /** @type {any} */ (await answer.json());
    if (!answer.ok) throw new Error(`${path}: ${value.error}: ${value.message}`);
    return value;
  };
}

/** @param {Command} command @returns {AnyPage} */
function pageOf(command) {
  const evaluate = async (/** @type {any} */ work, /** @type {unknown} */ argument) => {
    const expression = typeof work === 'string' ? work : `(${work})(given)`;
    // The answer to a promise that rejects is no failure of the protocol.
    const { value, failure } = await command('POST', '/execute/async', {
      script: `const [given, done] = arguments;
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
        const began = Date.now();
        while (!(await evaluate(work, argument))) {
          if (Date.now() - began > WAIT_MS) throw new Error(`waited in vain for ${work}`);
          await sleep(50);
        }
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

async function freePort() {
  const server = createServer().listen(0, '127.0.0.1');
  await once(server, 'listening');
  const { port } = /** @type {import('node:net').AddressInfo} */ (server.address());
  server.close();
  await once(server, 'close');
  return port;
}
