/** The script of a worker that relights row ranges of photographs for a `WorkerPool`. */

import { loadCpu } from '../../engine/core-modules.js';
import { createOutputTransform } from '../../engine/output-settings.js';
import type { CpuModule, ImportedPhoto, RowRangeRelighter } from '../../engine/wasm-exports.js';
import { serve } from '../../engine/worker-server.js';
import type { RelightWorkerTask, RowRange, RowRangeCommand } from './protocol.js';

interface WorkerPhoto extends RowRange {
  readonly photo: ImportedPhoto;
  /** `null` while tiles are moved. */
  relighter: RowRangeRelighter | null;
}

const storedRows = new Map<number, WorkerPhoto>();
const NO_BYTES = new ArrayBuffer(0);

function handle(module: CpuModule, photo: number, task: RowRangeCommand): ArrayBuffer {
  if (task.kind === 'open') {
    const { geometry, basis, firstRow, rows } = task;
    const received = module.Photo.receive(geometry, basis);
    storedRows.set(photo, { photo: received, firstRow, rows, relighter: null });
    return NO_BYTES;
  }
  const stored = storedRows.get(photo);
  if (!stored) throw new Error(`It has no photograph with the number ${photo}.`);
  switch (task.kind) {
    case 'plan':
      return Uint32Array.from(relighterOf(module, stored).lightRows).buffer;
    case 'relight': {
      const { light, settings, pixels } = task;
      const { output, colorMatrix, gamut } = settings;
      const transform = createOutputTransform(module, output, colorMatrix, gamut);
      try {
        const { left, top, right, bottom } = settings.view;
        const relighter = relighterOf(module, stored);
        relighter.setView(left, top, right, bottom);
        relighter.relight(light, transform, settings.quality, new Uint8Array(pixels));
      } finally {
        transform.free();
      }
      return pixels;
    }
    case 'put':
      freeRelighter(stored);
      stored.photo.putTile(task.index, task.bytes);
      return NO_BYTES;
    case 'take':
      freeRelighter(stored);
      return (stored.photo.takeTile(task.index) as Uint8Array<ArrayBuffer>).buffer;
    case 'close':
      freeRelighter(stored);
      stored.photo.free();
      storedRows.delete(photo);
      return NO_BYTES;
  }
}

function relighterOf(module: CpuModule, stored: WorkerPhoto): RowRangeRelighter {
  stored.relighter ??= new module.RowRangeRelighter(stored.photo, stored.firstRow, stored.rows);
  return stored.relighter;
}

function freeRelighter(stored: WorkerPhoto): void {
  stored.relighter?.free();
  stored.relighter = null;
}

serve(async () => {
  const module = await loadCpu();
  return {
    ready: module.cpuKernel(),
    handle: ({ photo, task }: RelightWorkerTask) => {
      const bytes = handle(module, photo, task);
      return [bytes, bytes.byteLength > 0 ? [bytes] : []] as const;
    },
  };
});
