import assert from 'node:assert/strict';
import test from 'node:test';
import { PhotoError } from './errors.js';
import { allowed } from './policy.js';

const refusal = (violated: string) => new PhotoError('csp-connect', violated);

/** Tells of a violation. */
function violate(hearer: EventTarget, effectiveDirective: string): void {
  hearer.dispatchEvent(Object.assign(new Event('securitypolicyviolation'), { effectiveDirective }));
}

const failing = () => Promise.reject(new TypeError('Failed to fetch'));

test('what fails while a policy tells of it, before or after, was refused', async () => {
  for (const after of [false, true]) {
    const hearer = new EventTarget();
    const work = () => {
      const tell = () => violate(hearer, 'connect-src');
      if (after) setTimeout(tell, 5);
      else tell();
      return failing();
    };
    await assert.rejects(allowed(work, /^connect-src/, refusal, hearer), {
      code: 'csp-connect',
      message: 'connect-src',
    });
  }
});

test('what a policy does not tell of, or tells of something else, fails as it did', async () => {
  const hearer = new EventTarget();
  await assert.rejects(allowed(failing, /^connect-src/, refusal, hearer), /Failed to fetch/);
  const other = () => {
    violate(hearer, 'img-src');
    return failing();
  };
  await assert.rejects(allowed(other, /^connect-src/, refusal, hearer), /Failed to fetch/);
  const fine = () => {
    violate(hearer, 'connect-src');
    return Promise.resolve(7);
  };
  assert.equal(await allowed(fine, /^connect-src/, refusal, hearer), 7, 'it was of something else');
});

test('on a server nobody is heard', async () => {
  await assert.rejects(allowed(failing, /^connect-src/, refusal), /Failed to fetch/);
});
