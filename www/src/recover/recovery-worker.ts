/** The script of the workers of a recovery: one is the coordinator, the others recover tiles. */

import { loadCaptureReader } from '../engine/capture-reader-module.js';
import { loadRecovery } from '../engine/recovery-module.js';
import type { ModuleExports } from '../engine/wasm-exports.js';
import { serve } from '../engine/worker-server.js';
import { messageOf, toPhotoError } from '../shared/errors.js';
import { Deferred } from '../shared/promises.js';
import { Coordinator } from './coordinator.js';
import type { RecoveryResult, RecoveryTask, SentError } from './protocol.js';
import { TileWorker } from './tile-worker.js';

/** Between two reports of progress. */
const REPORT_INTERVAL_MS = 50;
/** A module that stops with less memory has another fault than missing memory. */
const MIN_EXHAUSTED_BYTES = 256 << 20;

type Methods = Record<string, (...args: readonly unknown[]) => unknown>;
type Memory = ModuleExports['memory'];

/** Reports the steps of the task in progress, not too often. */
class TaskProgress {
  send: (steps: number) => void = () => {};
  #lastMs = 0;

  readonly report = (steps: number): void => {
    const now = performance.now();
    if (now - this.#lastMs < REPORT_INTERVAL_MS) return;
    this.#lastMs = now;
    this.send(steps);
  };
}

/** Rejects once the module stops in a later turn of the event loop, where nothing else catches it. */
function stopOfModule(): { readonly stopped: Promise<never>; readonly release: () => void } {
  const { promise, reject } = new Deferred<never>();
  const onError = (event: ErrorEvent): void => {
    event.preventDefault();
    reject(event.error);
  };
  globalThis.addEventListener('error', onError);
  return { stopped: promise, release: () => globalThis.removeEventListener('error', onError) };
}

function explainStop(thrown: unknown, memories: readonly Memory[]): SentError {
  const reason = messageOf(thrown);
  const bytes = memories.reduce((sum, { buffer }) => sum + buffer.byteLength, 0);
  if (bytes < MIN_EXHAUSTED_BYTES) {
    return { code: 'internal', message: `The recovery stopped: ${reason}.` };
  }
  const message =
    `The recovery stopped with ${Math.round(bytes / 2 ** 20)} MiB of memory, probably because the browser ` +
    `has no more (${reason}). Close other tabs, or recover with fewer camera pixels or photographs.`;
  return { code: 'recover-memory', message };
}

/** The memory of all arrays in a result, which is sent without a copy. */
function buffersOf(value: unknown): Transferable[] {
  if (ArrayBuffer.isView(value)) return [value.buffer as ArrayBuffer];
  return value !== null && typeof value === 'object' ? Object.values(value).flatMap(buffersOf) : [];
}

async function start() {
  const module = await loadRecovery();
  const memories = [(await module.default()).memory];
  const loadReader = async () => {
    const reader = await loadCaptureReader();
    const { memory } = await reader.default();
    if (!memories.includes(memory)) memories.push(memory);
    return reader;
  };
  const progress = new TaskProgress();
  const coordinator = new Coordinator(module, loadReader, progress.report);
  const tileWorker = new TileWorker(module, progress.report);
  const answer = async ({ method, args }: RecoveryTask): Promise<RecoveryResult> => {
    const target = method in tileWorker ? tileWorker : coordinator;
    const { stopped, release } = stopOfModule();
    try {
      const value = (target as unknown as Methods)[method]?.(...args);
      return { value: await Promise.race([value, stopped]) };
    } catch (thrown) {
      if (thrown instanceof WebAssembly.RuntimeError) {
        return { error: explainStop(thrown, memories), stopped: true };
      }
      const { code, message } = toPhotoError(thrown);
      return { error: { code, message }, stopped: false };
    } finally {
      release();
    }
  };
  return (task: RecoveryTask, onProgress: (steps: number) => void): Promise<RecoveryResult> => {
    progress.send = onProgress;
    return answer(task);
  };
}

serve(async () => {
  let error: SentError | null = null;
  const answer = await start().catch((thrown: unknown) => {
    const { code, message } = toPhotoError(thrown);
    error = { code, message };
    return null;
  });
  return {
    ready: error,
    handle: async (task: RecoveryTask, onProgress) => {
      const result = (await answer?.(task, onProgress)) ?? { value: undefined };
      return [result, buffersOf(result)] as const;
    },
  };
});
