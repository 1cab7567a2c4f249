/** A worker that relights rows of photographs: what a `WorkerClient` starts and talks to. */

import { loadCpu } from '../../engine/cpu-module.js';
import { makeDisplay } from '../../engine/output-settings.js';
import type { BandRelighter, CpuModule, DrawnPhoto } from '../../engine/types.js';
import { setModuleFolder } from '../../engine/wasm-loader.js';
import { messageOf } from '../../shared/errors.js';
import { started, workerScope } from '../../shared/worker-scope.js';
import type { Answer, Request, Task } from './protocol.js';

/** Rows of a photograph. */
interface Band {
  readonly photo: DrawnPhoto;
  readonly firstRow: number;
  readonly rows: number;
  /** None while tiles come and go. */
  relighter: BandRelighter | null;
}

const scope = workerScope<Request, Answer>();
const bands = new Map<number, Band>();
const NOTHING = new ArrayBuffer(0);

function answer(module: CpuModule, photo: number, task: Task): ArrayBuffer {
  if (task.kind === 'open') {
    const { geometry, basis, firstRow, rows } = task;
    const room = module.Photo.receive(geometry, basis);
    bands.set(photo, { photo: room, firstRow, rows, relighter: null });
    return NOTHING;
  }
  const band = bands.get(photo);
  if (!band) throw new Error('It was asked for what it does not have.');
  switch (task.kind) {
    case 'plan':
      return Uint32Array.from(planned(module, band).lightRows).buffer;
    case 'relight': {
      const { light, showing, pixels } = task;
      const display = makeDisplay(module, showing.output, showing.gamut);
      try {
        const out = new Uint8Array(pixels);
        planned(module, band).relight(light, display, showing.detail, out);
      } finally {
        display.free();
      }
      return pixels;
    }
    case 'put':
      stop(band);
      band.photo.putTile(task.index, task.bytes);
      return NOTHING;
    case 'take':
      stop(band);
      return (band.photo.takeTile(task.index) as Uint8Array<ArrayBuffer>).buffer;
    case 'close':
      stop(band);
      band.photo.free();
      bands.delete(photo);
      return NOTHING;
  }
}

function planned(module: CpuModule, band: Band): BandRelighter {
  band.relighter ??= new module.BandRelighter(band.photo, band.firstRow, band.rows);
  return band.relighter;
}

function stop(band: Band): void {
  band.relighter?.free();
  band.relighter = null;
}

function fail(thrown: unknown): void {
  scope.postMessage({ kind: 'broken', message: messageOf(thrown) });
}

// Not awaited at the top level, which bundlers cannot put into the classic workers that they make.
async function start(): Promise<void> {
  try {
    setModuleFolder((await started(workerScope())).modules);
    const module = await loadCpu();
    scope.onmessage = ({ data: { number, photo, task } }) => {
      try {
        const bytes = answer(module, photo, task);
        scope.postMessage({ kind: 'done', number, bytes }, bytes.byteLength > 0 ? [bytes] : []);
      } catch (thrown) {
        fail(thrown);
      }
    };
    scope.postMessage({ kind: 'ready', kernel: module.cpuKernel() });
  } catch (thrown) {
    fail(thrown);
  }
}

void start();
