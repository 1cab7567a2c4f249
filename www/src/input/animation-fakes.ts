/** Fakes that the tests of animations share. */

import { AnimationLoop } from './animation-loop.js';

/** An animation loop whose frames the test triggers. */
export function createLoop() {
  let now = 0;
  const requests: ((ms: number) => void)[] = [];
  const loop = new AnimationLoop((callback) => requests.push(callback));
  const frame = (ms: number) => {
    now += ms;
    for (const callback of requests.splice(0)) callback(now);
  };
  return { loop, frame, requests };
}
