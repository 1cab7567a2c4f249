/** The exports of the WebAssembly module `simulation` (src/web/simulation.rs). */

export interface Simulation {
  readonly tiles: number;
  readonly window: number;
  readonly correspondence: Float64Array;
  readonly dark: Float32Array;
  photograph(
    ensemble: string,
    count: number,
    electrons: number,
    seed: number,
    onJob: (done: number) => void,
  ): void;
  pattern(index: number): Float32Array;
  photo(index: number): Float32Array;
  picture(light: Float32Array): Float32Array;
  functions(x: number, y: number, width: number, height: number): Float32Array;
  tileError(
    x: number,
    y: number,
    width: number,
    height: number,
    window: number,
    functions: Float32Array,
  ): Float64Array;
  free(): void;
}

export interface TransportAnalysis {
  readonly band: Float32Array;
  readonly block: Uint32Array;
  addTile(x: number, y: number, width: number, height: number, functions: Float32Array): void;
  /** Frees the analysis. */
  singularValues(): Float64Array;
  free(): void;
}

export interface SimulationModule {
  default(options: { module_or_path: URL }): Promise<unknown>;
  Simulation: {
    build(
      scene: string,
      width: number,
      height: number,
      lightWidth: number,
      lightHeight: number,
      onJob: (done: number) => void,
    ): Simulation;
  };
  TransportAnalysis: new (
    width: number,
    height: number,
    lightWidth: number,
    lightHeight: number,
    window: number,
    correspondence: Float64Array,
    cells: number,
  ) => TransportAnalysis;
}
