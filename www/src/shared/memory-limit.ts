/** A limit in bytes: at most `most`, and `perGib` for each GiB of the device's memory. Some browsers tell that, up to 8. */
export function memoryLimit(most: number, perGib: number): number {
  const { deviceMemory = 8 } = (globalThis.navigator ?? {}) as { readonly deviceMemory?: number };
  return Math.min(most, deviceMemory * perGib);
}
