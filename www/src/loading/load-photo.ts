/** Loads the photograph of an address, with the browser's `fetch`. */

import { createDecoder } from '../photo/create-decoder.js';
import type { LoadOptions } from '../photo/load-options.js';
import type { PhotoAddress } from '../photo/photo-library.js';
import { LoadedPhotograph } from '../photo/photograph.js';
import { withPolicyErrors } from '../shared/content-security-policy.js';
import { forbiddenByPolicy } from './http-errors.js';
import { openPhoto } from './load.js';

/** Rejects with a `PhotoError`, or with the signal's reason. */
export async function loadPhoto(
  { src, credentials }: PhotoAddress,
  options: LoadOptions,
): Promise<LoadedPhotograph> {
  if (typeof src !== 'string') {
    const { descriptor, tiles } = await src.load(options);
    return new LoadedPhotograph(descriptor, tiles);
  }
  return openPhoto(src, options, {
    createDecoder,
    fetch: (input, init) =>
      withPolicyErrors(
        () => fetch(input, { ...init, credentials }),
        /^connect-src/,
        (directive, cause) => forbiddenByPolicy(src, directive, cause),
      ),
    yieldToPage,
    now: () => performance.now(),
  });
}

function yieldToPage(): Promise<void> {
  const { scheduler } = globalThis as { scheduler?: { yield?: () => Promise<void> } };
  return scheduler?.yield?.() ?? new Promise((resolve) => setTimeout(resolve));
}
