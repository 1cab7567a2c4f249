/** The browser's implementation of the session's ports, for all elements of the page. */

import { forbiddenByPolicy } from '../loading/http-errors.js';
import { openPhoto } from '../loading/load.js';
import { createDecoder } from '../photo/create-decoder.js';
import { createRenderer, prepare } from '../renderers/renderer-factory.js';
import { withPolicyErrors } from '../shared/content-security-policy.js';
import { callLater } from '../shared/promises.js';
import type { SessionPorts } from './types.js';

export const BROWSER_PORTS: SessionPorts = {
  open: (src, credentials, options) =>
    openPhoto(src, options, {
      createDecoder,
      fetch: (input, init) =>
        withPolicyErrors(
          () => fetch(input, { ...init, credentials }),
          /^connect-src/,
          (directive, cause) => forbiddenByPolicy(src, directive, cause),
        ),
      yieldToPage,
      now: () => performance.now(),
    }),
  createRenderer,
  prepare: (options, signal) => void prepare(options, signal),
  nextFrame: (callback) => requestAnimationFrame(callback),
  callLater,
  now: () => performance.now(),
};

function yieldToPage(): Promise<void> {
  const { scheduler } = globalThis as { scheduler?: { yield?: () => Promise<void> } };
  return scheduler?.yield?.() ?? new Promise((resolve) => setTimeout(resolve));
}
