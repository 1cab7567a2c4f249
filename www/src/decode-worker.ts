/** The worker that decodes one photograph: what `WorkerDecoder` starts and talks to. */

import { stateOf } from './decoding.js';
import { type Decoder, loadEngine } from './engine.js';
import { toPhotoError } from './errors.js';
import type { Answer, Request } from './worker-decoder.js';

/** What of a worker's global scope is used; the compiler knows that of pages only. */
interface Scope {
  onmessage: ((event: MessageEvent<Request>) => void) | null;
  postMessage(message: Answer, transfer?: Transferable[]): void;
}
const scope = globalThis as unknown as Scope;

let decoder: Decoder | undefined;

/** Does what it is told, or says why it cannot. */
function doing(work: () => void): void {
  try {
    work();
  } catch (thrown) {
    const { code, message } = toPhotoError(thrown);
    scope.postMessage({ kind: 'failed', code, message });
  }
}

function answer(of: Decoder, request: Request): void {
  if (request.kind === 'feed') {
    of.feed(request.offset, request.bytes);
    scope.postMessage({ kind: 'fed', state: stateOf(of) });
    return;
  }
  const photo = of.finish();
  const [geometry, basis] = [photo.geometryParcel(), photo.basisParcel()];
  scope.postMessage({ kind: 'photo', geometry, basis, metadata: photo.metadata });
  for (let index = 0; index < photo.tiles; index += 1) {
    const bytes = photo.takeTile(index) as Uint8Array<ArrayBuffer>;
    scope.postMessage({ kind: 'tile', index, bytes }, [bytes.buffer]);
  }
  scope.postMessage({ kind: 'done' });
}

scope.onmessage = ({ data }) => {
  doing(() => {
    if (decoder) answer(decoder, data);
  });
};

try {
  const engine = await loadEngine();
  decoder = new engine.Decoder();
  scope.postMessage({ kind: 'ready', state: stateOf(decoder) });
} catch (thrown) {
  const { code, message } = toPhotoError(thrown);
  scope.postMessage({ kind: 'failed', code, message });
}
