/** The light transport functions of a recovered photograph, tile by tile. */

/** @param {import('./types.js').Result['recovered']} recovered */
export async function* tilesOf(recovered) {
  for (let index = 0; ; index += 1) {
    const tile = await recovered.tileFunctions(index);
    if (!tile) return;
    yield tile;
  }
}
