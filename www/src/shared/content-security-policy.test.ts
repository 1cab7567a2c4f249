import assert from 'node:assert/strict';
import test from 'node:test';
import { withPolicyErrors } from './content-security-policy.js';
import { PhotoError } from './errors.js';

const CONNECT = /^connect-src/;
const toError = (violated: string) => new PhotoError('csp-connect', violated);

function violate(target: EventTarget, effectiveDirective: string): void {
  target.dispatchEvent(Object.assign(new Event('securitypolicyviolation'), { effectiveDirective }));
}

const failing = () => Promise.reject(new TypeError('Failed to fetch'));

test('a failure with a violation event before or after it is a policy error', async () => {
  for (const isLate of [false, true]) {
    const target = new EventTarget();
    const work = () => {
      const fire = () => violate(target, 'connect-src');
      if (isLate) setTimeout(fire, 5);
      else fire();
      return failing();
    };
    await assert.rejects(withPolicyErrors(work, CONNECT, toError, target), {
      code: 'csp-connect',
      message: 'connect-src',
    });
  }
});

test('a failure without a matching violation keeps its error, and success is not an error', async () => {
  const target = new EventTarget();
  await assert.rejects(withPolicyErrors(failing, CONNECT, toError, target), /Failed to fetch/);
  const otherDirective = () => {
    violate(target, 'img-src');
    return failing();
  };
  await assert.rejects(withPolicyErrors(otherDirective, CONNECT, toError, target), /Failed to/);
  const succeeding = () => {
    violate(target, 'connect-src');
    return Promise.resolve(7);
  };
  assert.equal(await withPolicyErrors(succeeding, CONNECT, toError, target), 7);
});

test('without a document the error is kept', async () => {
  await assert.rejects(withPolicyErrors(failing, CONNECT, toError), /Failed to fetch/);
});
