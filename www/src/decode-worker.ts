/** The worker that decodes one photograph: what `WorkerDecoder` starts and talks to. */

import { stateOf } from './decoding.js';
import { type Decoder, loadEngine } from './engine.js';
import { toPhotoError } from './errors.js';
import type { Answer, Request } from './worker-decoder.js';
import { workerScope } from './worker-scope.js';

const scope = workerScope<Request, Answer>();

function fail(thrown: unknown): void {
  const { code, message } = toPhotoError(thrown);
  scope.postMessage({ kind: 'failed', code, message });
}

function answer(decoder: Decoder, request: Request): void {
  if (request.kind === 'feed') {
    decoder.feed(request.offset, request.bytes);
    scope.postMessage({ kind: 'fed', state: stateOf(decoder) });
    return;
  }
  const photo = decoder.finish();
  const { decodedBytes, metadata } = photo;
  const [geometry, basis] = [photo.geometryParcel(), photo.basisParcel()];
  scope.postMessage({ kind: 'photo', geometry, basis, metadata, decodedBytes });
  for (let index = 0; index < photo.tiles; index += 1) {
    const bytes = photo.takeTile(index) as Uint8Array<ArrayBuffer>;
    scope.postMessage({ kind: 'tile', bytes }, [bytes.buffer]);
  }
  scope.postMessage({ kind: 'done' });
}

// Not awaited at the top level, which bundlers cannot put into the classic workers that they make.
async function start(): Promise<void> {
  try {
    const engine = await loadEngine();
    const decoder = new engine.Decoder();
    scope.onmessage = ({ data }) => {
      try {
        answer(decoder, data);
      } catch (thrown) {
        fail(thrown);
      }
    };
    // Nothing is asked of it before this.
    scope.postMessage({ kind: 'ready', state: stateOf(decoder) });
  } catch (thrown) {
    fail(thrown);
  }
}

void start();
