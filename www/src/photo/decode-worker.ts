/** The worker that decodes one photograph: what `WorkerDecoder` starts and talks to. */

import { loadDecoder } from '../engine/decoder-module.js';
import type { DecodedPhoto, Decoder } from '../engine/types.js';
import { setModuleFolder } from '../engine/wasm-loader.js';
import { toPhotoError } from '../shared/errors.js';
import { started, workerScope } from '../shared/worker-scope.js';
import { stateOf } from './main-thread-decoder.js';
import { headOf } from './photograph.js';
import type { Answer, Request } from './worker-decoder.js';

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
  const photo = request.kind === 'finish' ? decoder.finish() : decoder.preview();
  if (photo) give(photo);
  scope.postMessage({ kind: 'done' });
}

function give(photo: DecodedPhoto): void {
  const head = headOf(photo);
  scope.postMessage({ kind: 'head', head });
  for (let index = 0; index < head.tiles; index += 1) {
    const bytes = photo.takeTile(index) as Uint8Array<ArrayBuffer>;
    scope.postMessage({ kind: 'tile', bytes }, [bytes.buffer]);
  }
  photo.free();
}

// Not awaited at the top level, which bundlers cannot put into the classic workers that they make.
async function start(): Promise<void> {
  try {
    setModuleFolder((await started(workerScope())).modules);
    const { Decoder } = await loadDecoder();
    const decoder = new Decoder();
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
