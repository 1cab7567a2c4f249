/** Worker that copies its own memory: a message above 0 allocates so many bytes, a message of 0 copies them. */

const scope = /** @type {any} */ (globalThis);
let from = new Uint8Array();
let to = new Uint8Array();

scope.onmessage = (/** @type {MessageEvent<number>} */ { data: bytes }) => {
  if (bytes > 0) {
    from = new Uint8Array(bytes).fill(1);
    to = new Uint8Array(bytes).fill(2);
  } else {
    to.set(from);
  }
  scope.postMessage(null);
};
