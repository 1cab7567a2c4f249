/** The coordinator of a recovery, in a worker: reads, prepares, keeps the tiles, and answers questions about the result. */

import type { CaptureReader, CaptureReaderModule } from '../engine/capture-reader-exports.js';
import type {
  MeasurementBuilder,
  MeasurementInput,
  RecoveredTransport,
  Recovery,
  RecoveryModule,
} from '../engine/recovery-exports.js';
import { takeOut } from '../photo/types.js';
import { pageFiles } from './page-files.js';
import { PictureReader } from './picture-reader.js';
import { ConnectedGroup, type GroupMembership } from './process-group.js';
import {
  type Answers,
  type CoordinatorCalls,
  DEFAULT_GAMMA,
  type InputSummary,
  MAX_CODE,
  type PackedRows,
  type PictureError,
  type PictureSize,
  type PicturesHeader,
  type PreparationSettings,
  type PreparationSummary,
  type RecoverySummary,
  type SentPicture,
} from './protocol.js';
import type { Correspondence, FileQuality, TileFunctions, TransportFunction } from './types.js';

/** Of pictures that are compared with a photograph that was recovered from a folder. */
const DEFAULT_CODES = { lightGamma: DEFAULT_GAMMA, black: 0, white: MAX_CODE };

export class Coordinator implements Answers<CoordinatorCalls> {
  #header: PicturesHeader | null = null;
  #reader: PictureReader | null = null;
  #dark: Float32Array | null = null;
  #captureReader: CaptureReader | null = null;
  #builder: MeasurementBuilder | null = null;
  #input: MeasurementInput | null = null;
  #shotsUsed: readonly number[] = [];
  #recovery: Recovery | null = null;
  #transport: RecoveredTransport | null = null;
  #camera: PictureSize = { width: 0, height: 0 };
  #light: PictureSize = { width: 0, height: 0 };

  /**
   * `loadReader` is called when there are files to read. `report` tells the page the steps of the call in progress.
   */
  constructor(
    private readonly module: RecoveryModule,
    private readonly loadReader: () => Promise<CaptureReaderModule>,
    private readonly report: (steps: number) => void,
  ) {}

  async readFolder(
    files: ReadonlyMap<string, Blob>,
    shots: number | undefined,
  ): Promise<InputSummary> {
    const reader = await this.#openFolder(files);
    this.#captureReader = reader;
    const builder = new this.module.CaptureBuilder(reader.calibration(shots));
    for (const [i, shot] of builder.shots.entries()) {
      builder.addPhotograph(reader.photograph(shot));
      this.report(i + 1);
    }
    return this.#setInput(builder.finish(), reader.unknownFields);
  }

  beginPictures(header: PicturesHeader): void {
    const { width, height, lightWidth, lightHeight, quantum } = header;
    const { MeasurementBuilder } = this.module;
    this.#header = header;
    this.#reader = new PictureReader(this.module, this.loadReader, header);
    this.#camera = { width, height };
    this.#light = { width: lightWidth, height: lightHeight };
    this.#builder = new MeasurementBuilder(width, height, lightWidth, lightHeight, quantum);
  }

  async setDark(photograph: SentPicture): Promise<void> {
    this.#dark = await this.#readPhotograph(photograph, 'the dark photograph');
    existing(this.#builder).setDark(this.#dark);
  }

  setCorrespondence(correspondence: Correspondence): void {
    existing(this.#builder).setCorrespondence(Float64Array.from(correspondence.flat()));
  }

  async addGrayCode(
    axis: 'x' | 'y',
    bit: number,
    inverted: boolean,
    photograph: SentPicture,
  ): Promise<void> {
    const name = `the Gray code photograph of axis ${axis}, bit ${bit}, inverted ${inverted}`;
    const samples = await this.#readPhotograph(photograph, name);
    existing(this.#builder).addGrayCode(axis === 'y', bit, inverted, samples);
  }

  async addShot(
    index: number,
    pattern: SentPicture,
    photograph: SentPicture,
    exposure: number,
  ): Promise<void> {
    const emission = await existing(this.#reader).pattern(pattern, `pattern ${index}`, this.#light);
    const samples = await this.#readPhotograph(photograph, `photograph ${index}`);
    existing(this.#builder).addShot(emission, samples, exposure);
  }

  finishPictures(): InputSummary {
    const builder = existing(this.#builder);
    const { title, creator, rights } = existing(this.#header);
    this.#builder = null;
    return this.#setInput(builder.finish(title, creator, rights), []);
  }

  packInput(): Uint8Array {
    return existing(this.#input).pack();
  }

  async prepare(
    { method, basis, window }: PreparationSettings,
    member: GroupMembership | null,
  ): Promise<PreparationSummary> {
    const input = existing(this.#input);
    const { Recovery } = this.module;
    const group = member ? new ConnectedGroup(member, () => this.report(0)) : undefined;
    try {
      const prepared = Recovery.prepare(input, method, basis, window, this.report, group);
      this.#recovery = await prepared;
    } finally {
      group?.close();
    }
    this.#input = null;
    input.free();
    const { tiles, tileColumns, window: side, rank, expectedSnr } = this.#recovery;
    return { tiles, tileColumns, window: side, rank, expectedSnr };
  }

  pack(): Uint8Array {
    return existing(this.#recovery).pack();
  }

  packRows(tileRow: number): PackedRows {
    const recovery = existing(this.#recovery);
    const samples = recovery.packRows(tileRow, tileRow + 1);
    return { first: recovery.firstRow(tileRow), samples };
  }

  recoverTile(tile: number): void {
    existing(this.#recovery).recoverTile(tile);
  }

  putTile(tile: number, record: Uint8Array): void {
    existing(this.#recovery).putTile(tile, record);
  }

  finish(): RecoverySummary {
    const recovery = existing(this.#recovery);
    this.#transport = recovery.transport();
    const { lightWidth, lightHeight } = this.#transport;
    this.#light = { width: lightWidth, height: lightHeight };
    const { saturatedSamples, overexposedPixels, warnings } = recovery;
    return { lightWidth, lightHeight, saturatedSamples, overexposedPixels, warnings };
  }

  encode(quality: FileQuality | undefined): Uint8Array<ArrayBuffer> {
    const { snr, maxBytes } = Object(quality) as { snr?: number; maxBytes?: number };
    const isLossless = quality === 'lossless';
    const bytes = existing(this.#recovery).encode(snr, maxBytes, isLossless, this.report);
    return bytes as Uint8Array<ArrayBuffer>;
  }

  photo() {
    return takeOut(existing(this.#transport).photo());
  }

  relight(light: Float32Array): Float32Array {
    return existing(this.#transport).relight(light);
  }

  transportFunction(x: number, y: number): TransportFunction {
    const transport = existing(this.#transport);
    const values = transport.transportFunction(x, y);
    const [u = 0, v = 0] = transport.windowOrigin(x, y);
    return { origin: [u, v], values };
  }

  pointScatteringFunction(u: number, v: number): Float32Array {
    return existing(this.#transport).pointScatteringFunction(u, v);
  }

  tileFunctions(index: number): TileFunctions | undefined {
    const transport = existing(this.#transport);
    const rect = transport.tileRect(index);
    if (!rect) return undefined;
    const [x = 0, y = 0, width = 0, height = 0] = rect;
    return { x, y, width, height, values: transport.tileFunctions(index) };
  }

  async evaluatePair(
    index: number,
    light: SentPicture,
    photograph: SentPicture,
    exposure: number,
  ): Promise<PictureError> {
    const reader = existing(this.#reader);
    const rgb = await reader.light(light, `the light of pair ${index}`, this.#light);
    const samples = await this.#readPhotograph(photograph, `the photograph of pair ${index}`);
    const dark = this.#dark;
    const truth = samples.map((sample, i) => sample / exposure - (dark?.[i] ?? 0));
    return energies(existing(this.#transport).pictureError(rgb, truth));
  }

  async evaluateHeldOut(): Promise<PictureError> {
    const transport = existing(this.#transport);
    // Without a folder, the reader says that there is no manifest.
    const reader = this.#captureReader ?? (await this.#openFolder(new Map()));
    const sum = { signal: 0, error: 0 };
    for (let shot = 0; shot < reader.shots; shot += 1) {
      if (this.#shotsUsed.includes(shot)) continue;
      const picture = transport.pictureError(reader.light(shot), reader.photograph(shot));
      const { signal, error } = energies(picture);
      sum.signal += signal;
      sum.error += error;
    }
    return sum;
  }

  async #openFolder(files: ReadonlyMap<string, Blob>): Promise<CaptureReader> {
    const { CaptureReader } = await this.loadReader();
    return CaptureReader.open(pageFiles(files));
  }

  #setInput(input: MeasurementInput, unknownFields: readonly string[]): InputSummary {
    const { width, height } = input;
    const [a, b, c, d, e, f] = input.correspondence as unknown as number[] & { length: 6 };
    this.#input = input;
    this.#camera = { width, height };
    this.#shotsUsed = [...input.shotsUsed];
    this.#reader ??= new PictureReader(this.module, this.loadReader, DEFAULT_CODES);
    const correspondence = [
      [a, b, c],
      [d, e, f],
    ] as unknown as Correspondence;
    return { width, height, correspondence, shotsUsed: this.#shotsUsed, unknownFields };
  }

  #readPhotograph(photograph: SentPicture, name: string): Promise<Float32Array> {
    return existing(this.#reader).photograph(photograph, name, this.#camera);
  }
}

function energies([signal = 0, error = 0]: Float64Array): PictureError {
  return { signal, error };
}

/** What an earlier call has made. */
function existing<T>(value: T | null): T {
  if (value === null) throw new Error('The calls of a recovery came in another order.');
  return value;
}
