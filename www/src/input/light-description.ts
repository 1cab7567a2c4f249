/** Describes the torch's position in words, for screen readers. */

import type { StringKey } from '../i18n/translations.js';
import type { PicturePoint } from '../shared/value-types.js';
import type { ViewerUi } from '../ui/viewer-ui.js';

const DIRECTIONS: readonly (readonly StringKey[])[] = [
  ['upperLeft', 'above', 'upperRight'],
  ['left', 'lightInMiddle', 'right'],
  ['lowerLeft', 'below', 'lowerRight'],
];

/** Half the side of the square around the centre that counts as the middle; of the picture. */
const MIDDLE_DISTANCE = 1 / 8;
/** The largest distance from the centre that counts as near; of the picture. */
const NEAR_DISTANCE = 0.3;

/** For example “Light from upper left, near, 35% · 30%”, which ends with the x and y coordinates. */
export function describeLight(
  { x, y }: PicturePoint,
  language: Pick<ViewerUi, 't' | 'percent'>,
): string {
  const direction = DIRECTIONS[third(y)]?.[third(x)] ?? 'lightInMiddle';
  const position = `${language.percent(x)} · ${language.percent(y)}`;
  if (direction === 'lightInMiddle') return `${language.t(direction)}, ${position}`;
  const distance = language.t(Math.hypot(x - 0.5, y - 0.5) < NEAR_DISTANCE ? 'near' : 'far');
  return language.t('lightAt', language.t(direction), distance, position);
}

function third(coordinate: number): number {
  if (coordinate < 0.5 - MIDDLE_DISTANCE) return 0;
  return coordinate > 0.5 + MIDDLE_DISTANCE ? 2 : 1;
}
